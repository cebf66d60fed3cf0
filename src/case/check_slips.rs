//! The part of the check that warns of values that run but are hardly meant: slips of a unit, a sign or a place.

use super::check::{Checker, length};
use super::{AXES, Face, OutputKind, Tank, Vector, output};
use crate::scheme::Gradient;
use glam::{DMat3, DVec3};

/// Gravity and speeds beyond which a number is a slip [m/s2, m/s], and speeds that nothing has [m/s].
const MOST_GRAVITY: f64 = 1000.0;
const MOST_SPEED: f64 = 300.0;
const IMPOSSIBLE_SPEED: f64 = 1e6;
/// Speed of water at the start over sqrt(g H), the same [-].
const MOST_FROUDE: f64 = 100.0;
/// Densities of liquids [kg/m3], that of a body over the water's [-], friction [-].
const DENSITIES: std::ops::RangeInclusive<f64> = 10.0..=2e4;
const LEAST_BODY: f64 = 1e-3;
const MOST_FRICTION: f64 = 5.0;
/// Effective radius up to which the pressure of the free surface carries its weight within 0.1 % of 0.2 m of water at l0 = 10 mm [-].
const MOST_RADIUS: f64 = 2.6;

/// Threshold of the free surface below which water on the surface is taken for inner water [-].
const LEAST_THRESHOLD: f64 = 0.8;
/// Arm of a hinge over the body's size beyond which it is a place mistaken for a way [-].
const LONGEST_ARM: f64 = 10.0;

/// Length of an absorber over that of the wave below which much of it comes back; 0.3 of its height with a twelfth.
const SHORT: f64 = 0.5;

impl Checker<'_> {
    pub(super) fn slips(&mut self) {
        self.slips_of_nothing();
        self.slips_of_gravity();
        self.slips_of_water();
        self.slips_of_bodies();
        self.slips_of_motions();
        self.slips_of_places();
        self.slips_of_output();
    }

    fn slips_of_gravity(&mut self) {
        let (case, key) = (self.case, "run.gravity");
        let gravity = case.run.gravity;
        let g = length(&gravity);
        if g.is_finite() && g > MOST_GRAVITY {
            let message = format!("{g:.3e} m/s2 is {:.0} times that of the Earth", g / 9.806_65);
            self.warn(key, message, "write it in m/s2, e.g. [0, 0, -9.80665]");
        }
        // Along z at least half of it, as on a slope.
        if !case.gauge.level.is_empty() && gravity[2].abs() < 0.5 * g {
            let message = format!("levels are read along z, and gravity, {gravity:?}, pulls across");
            self.warn("gauge.level.0", message, "turn the scene so that z is up, or leave the levels out");
        }
        let (Some(tank), Some(fluid), Some(l0)) = (&case.tank, &case.fluid, self.spacing()) else { return };
        let low = fluid.block.iter().any(|b| b.min[2] - tank.min[2] < l0) || !fluid.fill.is_empty();
        if gravity[2] > 0.0 && (tank.open.contains(&Face::ZMax) || low) {
            let message = "the water falls upwards, out of its tank or to its ceiling".to_owned();
            self.warn(key, message, "z is up: give the third number a minus, e.g. [0, 0, -9.80665]");
        }
    }

    /// A case in which nothing ever moves.
    fn slips_of_nothing(&mut self) {
        let case = self.case;
        if case.fluid.is_none() && case.body.is_empty() && case.moving_wall.is_empty() {
            let message = "there is no water, no body and no moving wall: nothing happens".to_owned();
            self.warn("run", message, "add [fluid] with a block, a [[body]] or a [[moving_wall]]");
        }
    }

    fn slips_of_water(&mut self) {
        let case = self.case;
        let Some(fluid) = &case.fluid else { return };
        let beta = fluid.free_surface_threshold;
        if (0.0..LEAST_THRESHOLD).contains(&beta) {
            let message = format!(
                "with {beta} particles of the surface are taken for inner ones, and pressed as these are"
            );
            self.warn(
                "fluid.free_surface_threshold",
                message,
                "0.9 to 0.97 in most work; leave it out for 0.97",
            );
        }
        let radius = case.run.effective_radius;
        // The paper's gradient has no pressure of the surface.
        if fluid.gradient() == Gradient::Consistent && radius > MOST_RADIUS && radius.is_finite() {
            let message = format!(
                "with {radius} the pressure below a free surface is too small: 20 spacings of still water weigh 0.6 % too little on their \
                 floor with 3.1, 2 % with 4.1"
            );
            self.warn("run.effective_radius", message, "use 2.1 to 2.6");
        }
        if fluid.density > 0.0 && fluid.density.is_finite() && !DENSITIES.contains(&fluid.density) {
            let message = format!("{} kg/m3 is the density of no liquid", fluid.density);
            self.warn("fluid.density", message, "write it in kg/m3: fresh water has 1000");
        }
        let most = self.most_speed();
        for (k, block) in fluid.block.iter().enumerate() {
            self.speed(&format!("fluid.block.{k}.velocity"), length(&block.velocity), most);
            let half = DVec3::from(block.max) - DVec3::from(block.min);
            let added = |m: &[Vector; 3]| length(&m.map(|row| 0.5 * DVec3::from(row).abs().dot(half.abs())));
            if let Some(gradient) = &block.velocity_gradient {
                self.speed(&format!("fluid.block.{k}.velocity_gradient"), added(gradient), most);
            }
        }
        for (k, shape) in fluid.shape.iter().enumerate() {
            self.speed(&format!("fluid.shape.{k}.velocity"), length(&shape.velocity), most);
        }
        for (k, fill) in fluid.fill.iter().enumerate() {
            self.speed(&format!("fluid.fill.{k}.velocity"), length(&fill.velocity), most);
        }
    }

    /// Speed of water beyond which a number is a slip [m/s].
    pub(super) fn most_speed(&self) -> f64 {
        let case = self.case;
        let tall = |lo: &Vector, hi: &Vector| (hi[2] - lo[2]).max(0.0);
        let tank = case.tank.iter().map(|t| tall(&t.min, &t.max));
        let blocks = case.fluid.iter().flat_map(|f| &f.block).map(|b| tall(&b.min, &b.max));
        let height = tank.chain(blocks).fold(0.0, f64::max);
        let falls = MOST_FROUDE * (length(&case.run.gravity) * height).sqrt();
        if falls > 0.0 { falls.min(MOST_SPEED) } else { MOST_SPEED }
    }

    /// Warns of a speed above `most`, refuses one that nothing has [m/s].
    pub(super) fn speed(&mut self, path: &str, speed: f64, most: f64) {
        if speed > IMPOSSIBLE_SPEED {
            self.add(
                path,
                format!("more than {IMPOSSIBLE_SPEED:.0e} m/s: nothing is so fast"),
                "write it in m/s",
            );
        } else if speed > most {
            let message = format!("{speed:.4} m/s, more than {most:.1} m/s, is hardly meant");
            self.warn(path, message, "check the unit: lengths are metres, times seconds");
        }
    }

    fn slips_of_bodies(&mut self) {
        let case = self.case;
        let (Some(l0), flat) = (self.spacing(), self.flat()) else { return };
        let water = case.fluid.as_ref().map(|f| f.density);
        for (k, body) in case.body.iter().enumerate().filter(|(_, b)| !b.is_driven()) {
            let path = |key: &str| format!("body.{k}.{key}");
            self.speed(&path("velocity"), length(&body.velocity), MOST_SPEED);
            let Ok((shape, share)) = body.form().shape(l0, flat) else { continue };
            let radius = shape.radius();
            self.speed(&path("angular_velocity"), radius * length(&body.angular_velocity), MOST_SPEED);
            let arm = body.hinge.as_ref().map_or(0.0, |hinge| {
                let mut arm = DVec3::from(hinge.at) - DVec3::from(body.center);
                arm[hinge.axis as usize] = 0.0;
                arm.length()
            });
            if arm.is_finite() && arm > LONGEST_ARM * radius {
                let message =
                    format!("it turns about a place {arm:.4} m away, {:.0} times its size", arm / radius);
                self.warn(
                    &path("hinge.at"),
                    message,
                    "give the place of the hinge [m], in the tank's coordinates",
                );
            }
            let volume = shape.volume();
            let mass = body.mass.map(|m| m * share).or(body.density.map(|d| d * volume)).unwrap_or(0.0);
            if !(mass > 0.0 && volume > 0.0) {
                continue;
            }
            let density = mass / volume;
            if let Some(water) = water.filter(|w| density < LEAST_BODY * w) {
                let key = if body.mass.is_some() { "mass" } else { "density" };
                let message = format!("{density:.3e} kg/m3 is {:.1e} of the water's", density / water);
                self.warn(&path(key), message, "write it in kg/m3 (density) or kg (mass)");
            }
            // Of all masses within the radius, the most that any has about any axis.
            let most = mass * radius * radius / share;
            let moments = body.moments(flat).unwrap_or_default();
            let about = if flat { vec![moments.y] } else { moments.to_array().to_vec() };
            if let Some(moment) = about.into_iter().find(|&i| i > 1.001 * most) {
                let message = format!(
                    "a moment of {moment} kg m2 is more than any mass of {:.4e} kg within {radius:.4} m has",
                    mass / share
                );
                let remedy = format!("use {most:.2e} kg m2 or less, or leave it out for a uniform body");
                self.add(path("inertia"), message, remedy);
            }
        }
        if let Some(contact) = &case.contact {
            let of_pairs = contact.pair.iter().enumerate();
            let of_pairs =
                of_pairs.filter_map(|(k, p)| Some((format!("contact.pair.{k}.friction"), p.friction?)));
            for (key, friction) in of_pairs.chain([("contact.friction".into(), contact.friction)]) {
                if friction.is_finite() && friction > MOST_FRICTION {
                    let message = format!("a coefficient of friction of {friction} is that of no two solids");
                    self.warn(&key, message, "0.1 to 1 is usual");
                }
            }
        }
    }

    fn slips_of_motions(&mut self) {
        let case = self.case;
        let walls = case.moving_wall.iter().enumerate().map(|(k, w)| {
            let period = w.wave.as_ref().and_then(|wave| wave.ramp);
            (format!("moving_wall.{k}"), w.sine.as_ref(), w.swing.as_ref(), period)
        });
        let bodies = case.body.iter().enumerate();
        let bodies = bodies.map(|(k, b)| (format!("body.{k}"), b.sine.as_ref(), b.swing.as_ref(), None));
        for (path, sine, swing, wave) in walls.chain(bodies) {
            let ramps = [("wave", wave), ("sine", sine.map(|s| s.ramp)), ("swing", swing.map(|s| s.ramp))];
            for (name, ramp) in ramps {
                let Some(ramp) = ramp else { continue };
                self.longer(&format!("{path}.{name}.ramp"), ramp, "the motion never reaches its size");
            }
            if let Some(swing) =
                swing.filter(|s| s.amplitude_deg.is_finite() && s.amplitude_deg.abs() > 360.0)
            {
                let message = format!("{} degrees is more than a turn", swing.amplitude_deg);
                self.warn(
                    &format!("{path}.swing.amplitude_deg"),
                    message,
                    "write it in degrees; `rotation` turns on and on",
                );
            }
        }
    }

    /// Warns of a time that is longer than the run.
    fn longer(&mut self, path: &str, time: f64, so: &str) {
        let end = self.case.run.end;
        if time.is_finite() && end > 0.0 && time > end * (1.0 + 1e-9) {
            let message = format!("{time} s is longer than the run of {end} s: {so}");
            self.warn(path, message, "shorten it, or lengthen run.end");
        }
    }

    fn slips_of_places(&mut self) {
        let case = self.case;
        let Some(l0) = self.spacing() else { return };
        self.slips_of_absorbers();
        self.slips_of_damped_waves();
        let Some(tank) = &case.tank else { return };
        let axes: Vec<usize> = self.axes().collect();
        // The axis along which a box lies beyond the tank by more than `reach` [m].
        let beyond = |low: Vector, high: Vector, reach: f64| {
            axes.iter().copied().find(|&k| high[k] < tank.min[k] - reach || low[k] > tank.max[k] + reach)
        };
        for (k, obstacle) in case.obstacle.iter().enumerate() {
            let Some((low, high)) = obstacle.corners() else { continue };
            if let Some(axis) = beyond(low, high, case.run.effective_radius * l0) {
                let message = format!(
                    "obstacle `{}` lies outside of the tank along {}, where nothing comes",
                    obstacle.name, AXES[axis]
                );
                self.warn(&format!("obstacle.{k}"), message, "move it into the tank, or enlarge [tank]");
            }
        }
        for (k, plane) in case.plane.iter().enumerate() {
            let (Some(normal), Some(along)) =
                (DVec3::from(plane.normal).try_normalize(), DVec3::from(plane.along).try_normalize())
            else {
                continue;
            };
            let Some(along) = along.reject_from(normal).try_normalize() else { continue };
            let edges = [along * plane.size[0], normal.cross(along) * plane.size[1]];
            let half =
                DMat3::from_cols(edges[0].abs(), edges[1].abs(), DVec3::ZERO) * DVec3::new(0.5, 0.5, 0.0);
            let center = DVec3::from(plane.center);
            if let Some(axis) = beyond((center - half).into(), (center + half).into(), l0) {
                let message = format!(
                    "plane `{}` lies outside of the tank along {}: it holds no water",
                    plane.name, AXES[axis]
                );
                self.warn(&format!("plane.{k}.center"), message, "move it into the tank");
            }
        }
    }

    /// Absorbers that no wave runs into: these come in across gravity, in the water.
    fn slips_of_absorbers(&mut self) {
        let case = self.case;
        let periodic = case.tank.as_ref().map_or([false; 3], Tank::periodic);
        let weight = |k: usize| if periodic[k] { 0.0 } else { case.run.gravity[k].abs() };
        let Some(axis) = self.axes().max_by(|&a, &b| weight(a).total_cmp(&weight(b))) else { return };
        if weight(axis) == 0.0 {
            return;
        }
        let up = -case.run.gravity[axis].signum();
        let height = |low: &Vector, high: &Vector| {
            if up > 0.0 { [low[axis], high[axis]] } else { [-high[axis], -low[axis]] }
        };
        let blocks = case.fluid.iter().flat_map(|f| &f.block).map(|b| height(&b.min, &b.max)[1]);
        let fills = case.fluid.iter().flat_map(|f| &f.fill).map(|f| f.level);
        let level = blocks.chain(fills).fold(f64::NEG_INFINITY, f64::max);
        // What else brings water brings it to a height that is not known here; a fill's level is one along z.
        let other = case
            .fluid
            .as_ref()
            .is_none_or(|f| !f.shape.is_empty() || !(f.fill.is_empty() || axis == 2 && up > 0.0));
        let other = other || !case.inflow.is_empty();
        let across: Vec<&str> = self.axes().filter(|&k| k != axis).map(|k| AXES[k]).collect();
        for (k, absorber) in case.absorber.iter().enumerate() {
            if absorber.way().0 == axis {
                let message = format!(
                    "waves come in along {}: this damps from the floor up, or down",
                    across.join(" or ")
                );
                self.warn(
                    &format!("absorber.{k}.towards"),
                    message,
                    "name the side that they should not come back from",
                );
            }
            let begins = height(&absorber.min, &absorber.max)[0];
            if !other && begins >= level {
                let message = format!("it begins {:.4} m above the water", begins - level);
                self.warn(&format!("absorber.{k}.min"), message, "let it reach down to the floor");
            }
        }
    }

    /// Absorbers that take the waves of a piston where they are made, from the wrong side, or not on their way through.
    fn slips_of_damped_waves(&mut self) {
        let case = self.case;
        for piston in &case.moving_wall {
            let (Some(keys), Some((low, high))) = (&piston.wave, piston.straight_box()) else { continue };
            let push = keys.direction();
            let Some(axis) = (0..3).find(|&k| push[k].abs() > 0.99 * DVec3::from(push).length()) else {
                continue;
            };
            let ahead = push[axis] > 0.0;
            // Along the way of the waves, from the piston's face.
            let way = |x: f64| if ahead { x - high[axis] } else { low[axis] - x };
            for (k, absorber) in case.absorber.iter().enumerate().filter(|(_, a)| a.way().0 == axis) {
                let (a, b) = (way(absorber.min[axis]), way(absorber.max[axis]));
                let (from, to) = (a.min(b), a.max(b));
                let (name, l0) = (&piston.name, case.run.spacing);
                if to < l0 {
                    continue;
                }
                if from < l0 {
                    let message =
                        format!("it lies at the piston `{name}`: waves are damped where they are made");
                    self.warn(
                        &format!("absorber.{k}.min"),
                        message,
                        "let it begin where they have been used",
                    );
                    continue;
                }
                if absorber.way().1 != ahead {
                    let message = format!(
                        "the waves of `{name}` come in where the damping is full: they are thrown back"
                    );
                    self.warn(
                        &format!("absorber.{k}.towards"),
                        message,
                        "name the side that they should not come back from",
                    );
                    continue;
                }
                let length = piston.wave(case).map_or(0.0, |wave| wave.length);
                if to - from < SHORT * length {
                    let message = format!(
                        "it is {:.2} of the wave of `{name}` long, {length:.3} m: a good part of it comes back",
                        (to - from) / length
                    );
                    self.warn(&format!("absorber.{k}"), message, "make it a wave length long");
                }
            }
        }
    }

    fn slips_of_output(&mut self) {
        let case = self.case;
        let output = &case.output;
        let first = "there are no rows or frames but the first and the last";
        self.longer("output.every", output.every, first);
        if let Some(every) = output.table_every {
            self.longer("output.table_every", every, first);
        }
        if let Some(every) = case.gauge.every {
            self.longer("gauge.every", every, first);
        }
        let mut all = vec![("output.kinds".to_owned(), &output.kinds)];
        for (k, series) in output.series.iter().enumerate() {
            self.longer(&format!("output.series.{k}.every"), series.every, first);
            all.push((format!("output.series.{k}.kinds"), &series.kinds));
        }
        let walls = case.tank.is_some() || !case.obstacle.is_empty() || !case.plane.is_empty();
        for (path, kinds) in all {
            if let Some(k) = (1..kinds.len()).find(|&k| kinds[..k].contains(&kinds[k])) {
                self.add(format!("{path}.{k}"), "a kind is named twice", "name each kind once");
            }
            // What is written if nothing is said fits every case.
            if *kinds == output::kinds() {
                continue;
            }
            for (k, kind) in kinds.iter().enumerate() {
                let (there, what) = match kind {
                    OutputKind::Fluid => (case.fluid.is_some(), "[fluid]"),
                    OutputKind::Body => {
                        (!case.body.is_empty() || !case.moving_wall.is_empty(), "body or moving wall")
                    }
                    OutputKind::Wall | OutputKind::Dummy => (walls, "fixed wall"),
                };
                if !there {
                    let message = format!("there is no {what} to write");
                    self.warn(&format!("{path}.{k}"), message, "remove it");
                }
            }
        }
    }
}
