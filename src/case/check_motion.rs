//! The part of the check that judges motion: tables, formulas, and waves against what theory and resolution allow.

use super::check::{Checker, length};
use super::{AXES, Guide, MovingWall, Vector};
use crate::waves::{MCCOWAN, SECOND_ORDER, WaveKind, miche};
use glam::DVec3;

/// Shortest wave over the spacing that a piston is asked for [-].
const SHORTEST: f64 = 10.0;
/// Height over the spacing below which a wave is lost to the particles soon [-].
const LOW: f64 = 4.0;

/// Sine of the angle between a piston's way and the normal of its face up to which these are one.
const ASKEW: f64 = 0.01;

/// What a table of rows is at t = 0, on straight lines between them.
fn at_start(rows: &[[f64; 4]]) -> Vector {
    let after = rows.iter().position(|r| r[0] > 0.0).unwrap_or(rows.len());
    [1, 2, 3].map(|axis| match (after.checked_sub(1).map(|k| rows[k]), rows.get(after)) {
        (Some(a), Some(b)) => a[axis] - (b[axis] - a[axis]) * a[0] / (b[0] - a[0]),
        (Some(a), None) => a[axis],
        (None, first) => first.map_or(0.0, |r| r[axis]),
    })
}

impl Checker<'_> {
    /// What moves a wall: at most one thing that shifts it and one that turns it, at least one of both.
    pub(super) fn wall_guided(&mut self, path: &str, w: &MovingWall) {
        let guide = w.guide();
        if guide.motion.is_none() && guide.sine.is_none() && w.wave.is_none() && !guide.turns() {
            self.motion(&format!("{path}.motion"), &[]);
        }
        self.guided(
            path,
            &guide,
            w.wave.is_some(),
            w.reach_and_middle(self.spacing().unwrap_or_default(), self.flat()),
        );
        self.wave(&format!("{path}.wave"), w);
    }

    /// What moves a solid that reaches so far [m] from its middle: at most one thing that shifts it, a `wave` or another, and one that
    /// turns it.
    pub(super) fn guided(&mut self, path: &str, guide: &Guide, wave: bool, (reach, middle): (f64, Vector)) {
        let key = |key: &str| format!("{path}.{key}");
        let shifts = [("motion", guide.motion.is_some()), ("sine", guide.sine.is_some()), ("wave", wave)];
        let turns = [("rotation", !guide.rotation.is_empty()), ("swing", guide.swing.is_some())];
        self.one_of(path, &shifts);
        self.one_of(path, &turns);
        if let Some(rows) = guide.motion {
            self.motion(&key("motion"), rows);
        }
        let pivot = guide.pivot.filter(|_| guide.swing.is_none());
        self.rotation(path, guide.rotation, (pivot, middle), reach);
        if let Some(sine) = guide.sine {
            let times = [sine.period, sine.phase_deg, sine.ramp];
            self.in_plane(&key("sine.axis"), &sine.axis);
            if self.sine(&key("sine"), &sine.axis, times) && sine.amplitude.is_finite() {
                self.steady(&key("sine"), sine.formula().fastest(0.0, f64::INFINITY));
            }
        }
        if let Some(swing) = guide.swing {
            let times = [swing.period, swing.phase_deg, swing.ramp];
            self.about_y(&key("swing.axis"), &swing.axis);
            if let Some(pivot) = &guide.pivot {
                self.place(&key("pivot"), pivot);
            }
            if self.sine(&key("swing"), &swing.axis, times) && swing.amplitude_deg.is_finite() {
                let arm = guide.pivot.map_or(0.0, |p| length(&[0, 1, 2].map(|k| p[k] - middle[k])));
                self.steady(&key("swing"), (arm + reach) * swing.formula().fastest(0.0, f64::INFINITY));
            }
        }
    }

    /// Axis, period, phase and ramp of a sine; whether they make one.
    fn sine(&mut self, path: &str, axis: &Vector, [period, phase, ramp]: [f64; 3]) -> bool {
        if length(axis) == 0.0 {
            self.add(format!("{path}.axis"), "the axis has no length", "give a direction, e.g. [1, 0, 0]");
        }
        self.positive(&format!("{path}.period"), period, "s");
        self.not_negative(&format!("{path}.ramp"), ramp, "s (0: no ramp)");
        if ramp == 0.0 && phase.to_radians().sin().abs() > 1e-9 {
            let message = "without a ramp the solid would jump to its phase in the first step";
            self.add(
                format!("{path}.phase_deg"),
                message,
                format!("add `ramp`, one period ({period} s) say"),
            );
        }
        [period, phase, ramp].into_iter().all(f64::is_finite) && period > 0.0 && ramp >= 0.0
    }

    /// How many spacings a driven solid may go in a time step, and what helps beside a shorter one: an adaptive step follows a fast wall, but
    /// not one that is there at once, and only in water.
    fn pace_of_solids(&self) -> (f64, &'static str) {
        match (self.case.fluid.is_some(), self.case.run.adaptive) {
            (true, true) => (100.0, ""),
            (true, false) => (1.0, ", or run.adaptive = true"),
            (false, _) => (1.0, ""),
        }
    }

    /// A solid that crosses whole particles within a step passes through the water instead of pushing it.
    fn steady(&mut self, path: &str, speed: f64) {
        let run = &self.case.run;
        let Some(l0) = self.spacing().filter(|_| run.time_step > 0.0) else { return };
        let (most, adaptive) = self.pace_of_solids();
        let spacings = speed * run.time_step / l0;
        if spacings > most {
            let message = format!(
                "up to {speed:.3e} m/s, {spacings:.1} particles in a time step: the solid would jump through what is \
                 in its way"
            );
            let remedy = format!(
                "check its period [s] and how far it goes, or use run.time_step = {:.1e} or less{adaptive}",
                l0 / speed
            );
            self.add(path, message, remedy);
        }
    }

    /// Keys of a wave, and the wave against the limits of theory, resolution and tank.
    fn wave(&mut self, path: &str, w: &MovingWall) {
        let Some(keys) = &w.wave else { return };
        let key = |key: &str| format!("{path}.{key}");
        let count = self.problems.len();
        self.positive(&key("height"), keys.height, "m");
        for (name, value, unit) in
            [("period", keys.period, "s"), ("depth", keys.depth, "m"), ("ramp", keys.ramp, "s")]
        {
            if let Some(value) = value {
                self.positive(&key(name), value, unit);
            }
        }
        if let Some(gamma) = keys.peak_enhancement {
            let what = "1 to 10 (3.3 in the mean of the measured ones)";
            self.range(&key("peak_enhancement"), gamma, (1.0..=10.0).contains(&gamma), what);
        }
        let (solitary, jonswap) = (keys.kind == WaveKind::Solitary, keys.kind == WaveKind::Jonswap);
        let foreign = [
            ("period", solitary && keys.period.is_some()),
            ("ramp", solitary && keys.ramp.is_some()),
            ("seed", !jonswap && keys.seed.is_some()),
            ("peak_enhancement", !jonswap && keys.peak_enhancement.is_some()),
            ("profile", !solitary && keys.profile.is_some()),
        ];
        for (name, _) in foreign.into_iter().filter(|f| f.1) {
            let message = format!("a {} wave has no `{name}`", keys.kind.name());
            self.add(key(name), message, format!("remove `{name}`"));
        }
        if !solitary && keys.period.is_none() {
            self.add(path, format!("a {} wave without `period`", keys.kind.name()), "add `period` [s]");
        }
        let direction = keys.direction();
        if direction[2] != 0.0 || length(&direction) == 0.0 || self.flat() && direction[1] != 0.0 {
            let axes = if self.flat() { "x" } else { "x, y" };
            let message = format!("a piston pushes along a horizontal direction, {axes}");
            self.add(key("direction"), message, "e.g. [1, 0, 0], or leave it out");
        } else if let Some(facing) = w.facing() {
            self.faces(&key("direction"), &direction, facing);
        }
        let g = self.case.run.gravity;
        if g[2] >= 0.0 || g[0] != 0.0 || !self.flat() && g[1] != 0.0 {
            let message = "wave theory needs gravity straight down along z";
            self.add(path, message, "set run.gravity = [0, 0, -9.80665], or move the wall by `sine`");
        }
        if self.problems.len() > count {
            return;
        }
        let Some(wave) = w.wave(self.case) else {
            let message = "there is no block of water at the piston's face to take the depth from";
            self.add(
                path,
                message,
                "add `depth` [m], or let a [[fluid.block]] or [[fluid.fill]] begin at the face",
            );
            return;
        };
        let (height, depth) = (keys.height, wave.wanted.depth);
        let most = if solitary { MCCOWAN * depth } else { miche(wave.length, depth) };
        if height > most {
            let law = if solitary { "0.78 d (McCowan)" } else { "0.142 L tanh k d (Miche)" };
            let message = format!(
                "a wave of {height} m breaks at the piston: in water {depth:.4} m deep it can be {most:.3e} m high, {law}"
            );
            self.add(key("height"), message, format!("use {:.1e} m or less", 0.9 * most));
            return;
        }
        self.resolved(path, &wave, height);
        self.steady(path, wave.formula.fastest(0.0, f64::INFINITY));
        self.kept(path, w, wave.formula.reach());
    }

    /// A piston makes the wave of its stroke only where its face stands across it: its nearest one looks along `facing`.
    fn faces(&mut self, path: &str, direction: &Vector, facing: DVec3) {
        if facing.cross(DVec3::from(*direction).normalize()).length() < ASKEW {
            return;
        }
        let tidy = facing.to_array().map(|x| (x * 1e4).round() / 1e4 + 0.0);
        let along = match tidy.iter().position(|x| x.abs() == 1.0) {
            Some(axis) => AXES[axis].to_owned(),
            None => format!("{tidy:?}"),
        };
        let turn = "turn it by `orientation` (a box with `size` and `center`)";
        let use_it = if tidy[2] == 0.0 { format!(", or use {tidy:?}") } else { String::new() };
        let message = format!("the piston would push along {direction:?}, and its face looks along {along}");
        self.add(path, message, format!("{turn}{use_it}"));
    }

    /// The wave against the spacing, and against what second order describes.
    fn resolved(&mut self, path: &str, wave: &crate::waves::Wave, height: f64) {
        let Some(l0) = self.spacing() else { return };
        let regular = wave.wanted.kind == WaveKind::Regular;
        if wave.length < SHORTEST * l0 {
            let message = format!(
                "the wave is {:.3e} m long, {:.1} particles of {l0} m: it cannot be told from noise",
                wave.length,
                wave.length / l0
            );
            let remedy = format!(
                "use run.spacing = {:.1e} or less, or a longer period",
                wave.length / (2.0 * SHORTEST)
            );
            self.add(path, message, remedy);
        } else if height < LOW * l0 {
            let message = format!("the wave is {:.1} particles high and will lose height soon", height / l0);
            self.warn(
                &format!("{path}.height"),
                message,
                &format!("use run.spacing = {:.1e} or less", height / 8.0),
            );
        }
        let number = height * wave.length.powi(2) / wave.wanted.depth.powi(3);
        if regular && number > SECOND_ORDER {
            let message = format!(
                "H L^2 / d^3 = {number:.0} is above {SECOND_ORDER:.0}: so long a wave sheds others that second order does not know"
            );
            self.warn(
                &format!("{path}.height"),
                message,
                "use a lower or shorter wave, or kind = \"solitary\"",
            );
        }
    }

    /// The piston's face must stay within the tank.
    fn kept(&mut self, path: &str, w: &MovingWall, [back, forth]: [f64; 2]) {
        let (Some((axis, sign, face)), Some(tank)) = (w.face(), &self.case.tank) else { return };
        let ends = [face + sign * back, face + sign * forth];
        if let Some(end) = ends.into_iter().find(|&x| x <= tank.min[axis] || x >= tank.max[axis]) {
            let message = format!(
                "the stroke of {:.4} m takes the piston's face from {face} to {end:.4} m, beyond the tank's {} to {} m",
                forth - back,
                tank.min[axis],
                tank.max[axis]
            );
            self.add(path, message, "move the piston, lengthen the tank, or use a lower or shorter wave");
        }
    }

    /// A table of motion: at least one row, times increasing, at rest where the case puts it at t = 0, no jumps.
    pub(super) fn motion(&mut self, path: &str, rows: &[[f64; 4]]) {
        if rows.is_empty() {
            self.add(
                path,
                "the table of motion has no rows",
                "write rows of time, x, y, z, e.g. [[0, 0, 0, 0], [3, 0, 0, 0.33]]; what stands still is an \
                 [[obstacle]]",
            );
        }
        if !self.increases(path, rows) {
            return;
        }
        if !rows.is_empty() && rows.iter().flatten().all(|x| x.is_finite()) {
            rows.iter().enumerate().for_each(|(k, row)| self.place(&format!("{path}.{k}"), &row[1..]));
            self.motion_start(path, rows);
            rows.iter()
                .enumerate()
                .for_each(|(k, row)| self.in_plane(&format!("{path}.{k}"), &[row[1], row[2], row[3]]));
            let flat = self.flat();
            let way = |a: &[f64; 4], b: &[f64; 4]| {
                length(&[b[1] - a[1], if flat { 0.0 } else { b[2] - a[2] }, b[3] - a[3]])
            };
            self.jumps(path, rows, &way);
        }
    }

    /// Times that increase from row to row.
    fn increases(&mut self, path: &str, rows: &[[f64; 4]]) -> bool {
        let wrong = rows.windows(2).position(|pair| pair[1][0] <= pair[0][0]);
        if let Some(k) = wrong {
            let message = format!("time {} does not come after {}", rows[k + 1][0], rows[k][0]);
            self.add(format!("{path}.{}.0", k + 1), message, "times must increase from row to row");
        }
        wrong.is_none()
    }

    /// A table of angles of a solid at `path`: times increasing, no angle at t = 0, no jumps of a point `far` [m] from
    /// the centre, about y alone in two dimensions.
    pub(super) fn rotation(
        &mut self,
        path: &str,
        rows: &[[f64; 4]],
        (pivot, center): (Option<Vector>, Vector),
        far: f64,
    ) {
        let rotation = format!("{path}.rotation");
        if rows.is_empty() {
            if pivot.is_some() {
                let message = "nothing turns about it: there is no `rotation`";
                let remedy = "add `rotation`, a `hinge` for a body that forces turn, or remove `pivot`";
                self.add(format!("{path}.pivot"), message, remedy);
            }
            return;
        }
        if let Some(pivot) = &pivot {
            self.place(&format!("{path}.pivot"), pivot);
        }
        if !self.increases(&rotation, rows) || !rows.iter().flatten().all(|x| x.is_finite()) {
            return;
        }
        let across = |r: &[f64; 4]| r[1] != 0.0 || r[3] != 0.0;
        if let Some(k) = rows.iter().position(across).filter(|_| self.flat()) {
            let message = "in two dimensions a solid turns about y alone";
            self.add(format!("{rotation}.{k}"), message, "set the angles about x and z to 0");
        }
        let start = at_start(rows);
        if length(&start) > 1e-6 {
            let message = format!(
                "the table is at ({}, {}, {}) degrees at t = 0, so that the solid would turn there in the first step",
                start[0], start[1], start[2]
            );
            let remedy = "angles count from the orientation given by the case: begin with [0, 0, 0, 0]";
            self.add(format!("{rotation}.0"), message, remedy);
        }
        let arm = pivot.map_or(0.0, |p| length(&[0, 1, 2].map(|axis| p[axis] - center[axis])));
        let reach = (arm + far).to_radians();
        let way = |a: &[f64; 4], b: &[f64; 4]| reach * length(&[b[1] - a[1], b[2] - a[2], b[3] - a[3]]);
        self.jumps(&rotation, rows, &way);
    }

    /// Displacements count from where the case puts the solid: at t = 0 there is none.
    fn motion_start(&mut self, path: &str, rows: &[[f64; 4]]) {
        let [x, y, z] = at_start(rows);
        let start = [x, if self.flat() { 0.0 } else { y }, z];
        let l0 = self.spacing().unwrap_or(0.0);
        if length(&start) > 1e-6 * l0 {
            let message = format!(
                "the table is at ({}, {}, {}) m at t = 0, so that the solid would jump there in the first step",
                start[0], start[1], start[2]
            );
            let remedy = "displacements count from the place given by the case: begin with [0, 0, 0, 0]";
            self.add(format!("{path}.0"), message, remedy);
        }
    }

    /// A solid that crosses whole particles within a step passes through the water instead of pushing it.
    fn jumps(&mut self, path: &str, rows: &[[f64; 4]], way: &dyn Fn(&[f64; 4], &[f64; 4]) -> f64) {
        let run = &self.case.run;
        let Some(l0) = self.spacing().filter(|_| run.time_step > 0.0) else { return };
        let (most, adaptive) = self.pace_of_solids();
        for (k, pair) in rows.windows(2).enumerate() {
            let way = way(&pair[0], &pair[1]);
            let speed = way / (pair[1][0] - pair[0][0]);
            let spacings = speed * run.time_step / l0;
            if way > l0 && spacings > most {
                let message = format!(
                    "{way} m in {:.3e} s is {speed:.3e} m/s, {spacings:.1} particles in a time step: the solid would \
                     jump through what is in its way",
                    pair[1][0] - pair[0][0]
                );
                let remedy = format!(
                    "give the motion more time, or use run.time_step = {:.1e} or less{adaptive}",
                    l0 / speed
                );
                self.add(format!("{path}.{}", k + 1), message, remedy);
            }
        }
    }
}
