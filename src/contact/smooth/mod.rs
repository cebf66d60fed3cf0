//! The conservative law: contact of true surfaces, one spring a pair of solids.
//!
//! Points of one solid's surface that lie inside the other's box give depths d_i >= 0 with constant
//! weights w_i that sum to 1 over a face. The pair's *effective depth* is the generalised mean
//!
//! D = (sum_i w_i d_i^p)^(1/p),  p = 8,
//!
//! where edges carry their weight along their length and the sum over them is an integral (`edges`),
//!
//! and the contact stores U = K D^2 / 2. With all of a face in contact D is the depth and K the
//! stiffness of the contact as a whole, whatever the resolution: what Eq. (14) wants of 1/n_c. Unlike
//! that average, U is a continuous function of the two poses and the forces
//! f_i = -dU/dd_i = K s_i d_i, s_i = w_i (d_i / D)^(p - 2), derive from it, so no energy appears when
//! points come and go. p = 2 would be fixed weights, whose corners are N_face times softer than faces
//! (0.34 l0 deep where a face takes a micrometre); with p = 8 a corner has w^(1/4) of K, 0.38 for 49
//! points. Larger p stiffens rocking, (p - 1) K, as fast as corners and wins nothing.
//!
//! Beyond a quarter spacing a second spring joins, stiff enough to stop the fastest body of the scene
//! within half a spacing more; it is never reached with a sensible K, and it is conservative too. In solids of
//! less than two spacings both lengths shrink with their thickness: they must not be pressed to their middle.

mod answer;
mod constants;
mod coulomb;
pub mod device;
mod fault;
mod flush;
mod frame;
mod friction;
mod held;
mod pair;
mod patch;
mod probe;
mod round;
mod stability;
mod walls;

use super::between::Against;
use super::candidates::{Candidates, Close, MANY_PAIRS, reduced_mass};
use super::device::Link;
use super::fixed::FixedWalls;
use super::law::{Fault, Kind, Law, Now, Summary};
use super::probe::Probe;
use super::substeps::{Cut, Limits, Worst};
use crate::body::{Body, Wrench};
use crate::checkpoint::Archive;
use crate::error::Result;
use crate::scene::{Scene, Solid};
use crate::shape::{Cuboid, Geometry, Surface};
use constants::Constants;
use fault::Middles;
use friction::Friction;
use glam::DVec3;
use pair::{LEAST, Other, Pair};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;
use walls::WallBox;

/// The smooth law.
pub(super) const KIND: Kind = Kind {
    make: |_, scene, bodies, limits| Ok(Box::new(Smooth::new(scene, bodies, limits))),
    gap: |_| 0.0,
    program: |scene| {
        // the kernel presses the points of boxes into boxes
        if scene.solids.iter().any(|s| s.shape.as_cuboid().is_none()) {
            return Err("the device has no kernel of law \"smooth\" for bodies that are no boxes");
        }
        if scene.solids.iter().any(|s| s.shape_offset != DVec3::ZERO) {
            return Err(
                "the device has no kernel of law \"smooth\" for bodies with a `mass_offset` or a hinge",
            );
        }
        Ok(&device::PROGRAM)
    },
    device_tells_walls_apart: true,
};

/// Exponent p of the effective depth.
pub(super) const EXPONENT: f64 = 8.0;
/// Depth at which the second spring joins, over the spacing (or half of the thinner solid, if that is less) [-].
const STOP_DEPTH: f64 = 0.25;

/// The law: geometry, pairs, and those on a device.
pub(crate) struct Smooth {
    /// One for all solids that are alike.
    pub surfaces: Vec<Arc<Surface>>,
    /// Fixed walls and still boxes.
    pub walls: Vec<WallBox>,
    /// Which solids press nothing as such: they are among `walls`, or are layers in openings, of which the tank's wall is as high.
    still: Vec<bool>,
    /// Places of the solids in the order of their heights at the start: what the pairs follow, and not the order of the case's tables.
    rank: Vec<usize>,
    /// Smallest weight of a point of a free body [-].
    lightest_point: f64,
    pub pairs: Vec<Pair>,
    friction: Friction,
    middles: Middles,
    /// Depth [m] below which no pair of the scene can be in trouble.
    harmless: f64,
    pub spacing: f64,
    generation: u64,
    /// Sub-step and longest step [s] that the pairs have the constants of.
    constants: Option<(f64, f64)>,
    device: Option<Box<device::Pairs>>,
    /// The last evaluation was the device's.
    on_device: bool,
}

/// The surface of each solid: of a thousand equal ones there is one, which stays in the processor's caches.
fn shared(scene: &Scene) -> Vec<Arc<Surface>> {
    let equal = |a: &Solid, b: &Solid| {
        a.shape == b.shape
            && a.shape_offset == b.shape_offset
            && a.wall_offset == b.wall_offset
            && a.wall_to_surface == b.wall_to_surface
    };
    // what is equal is so in this; a hundred thousand that are not need not all be compared
    let mark = |solid: &Solid| {
        let last = solid.wall_offset.last().copied().unwrap_or_default();
        (solid.wall_offset.len(), last.to_array().map(f64::to_bits))
    };
    let mut made: HashMap<_, Vec<(&Solid, Arc<Surface>)>> = HashMap::new();
    let of = |solid| {
        let alike = made.entry(mark(solid)).or_default();
        if let Some((_, surface)) = alike.iter().find(|(known, _)| equal(known, solid)) {
            return surface.clone();
        }
        let surface = Arc::new(solid.surface(scene.spacing, scene.dimensions));
        alike.push((solid, surface.clone()));
        surface
    };
    let mut surfaces: Vec<Arc<Surface>> = scene.solids.iter().map(of).collect();
    flush::take_covered(scene, &mut surfaces);
    surfaces
}

/// Places of the solids in the order of their heights at the start. Sweeps over friction end before all digits are settled, so that their
/// order shows.
fn rank(scene: &Scene) -> Vec<usize> {
    let mut order: Vec<usize> = (0..scene.solids.len()).collect();
    let place = |k: usize| scene.solids[k].position;
    order.sort_by(|&i, &j| {
        let (p, q) = (place(i), place(j));
        p.z.total_cmp(&q.z).then(p.y.total_cmp(&q.y)).then(p.x.total_cmp(&q.x))
    });
    let mut rank = vec![0; order.len()];
    order.into_iter().enumerate().for_each(|(place, k)| rank[k] = place);
    rank
}

impl Smooth {
    pub fn new(scene: &Scene, bodies: &[Body], limits: &mut Limits) -> Self {
        let surfaces = shared(scene);
        let walls = walls::walls(scene);
        let still = (0..scene.solids.len())
            .map(|k| k >= scene.followed() || walls::still_box(scene, k).is_some())
            .collect();
        let free = bodies.iter().zip(&surfaces).filter(|(b, _)| b.is_free());
        let lightest_point = free.map(|(_, s)| s.smallest_weight).fold(1.0, f64::min);
        let middles = Middles::new(bodies, &surfaces, &walls);
        let harmless = (fault::THROUGH * middles.least()).min(fault::DRIVEN * scene.spacing);
        limits.lambda = bodies.iter().zip(&surfaces).map(|(b, s)| stability::lambda(b, s)).collect();
        Self {
            surfaces,
            walls,
            still,
            rank: rank(scene),
            lightest_point,
            middles,
            harmless,
            pairs: vec![],
            friction: Friction::default(),
            spacing: scene.spacing,
            generation: 0,
            constants: None,
            device: None,
            on_device: false,
        }
    }

    /// The pairs of the last evaluation.
    fn evaluated(&self) -> &[Pair] {
        match &self.device {
            Some(device) if self.on_device => &device.pairs,
            _ => &self.pairs,
        }
    }

    /// Whether any solid is round somewhere.
    fn is_round(&self) -> bool {
        self.surfaces.iter().any(|s| s.is_round())
    }

    /// Whether the lists are those of `candidates`.
    fn is_current(&self, candidates: &Candidates) -> bool {
        self.generation == candidates.generation()
    }

    /// Pairs of solids that are close, each with its skin [m]; without points.
    pub fn close(&self, candidates: &Candidates, bodies: &[Body]) -> Vec<(Pair, f64)> {
        let mut pairs: Vec<(Pair, f64)> = vec![];
        for (a, body) in bodies.iter().enumerate().filter(|(_, b)| b.is_free()) {
            for (w, wall) in self.walls.iter().enumerate() {
                let q = wall.axes.transpose() * (body.shape_center() - wall.center);
                let extent = body.shape.extent(wall.axes.transpose() * body.rotation);
                if (Cuboid { half: wall.half + extent }).outside(q) < candidates.skin(a) {
                    pairs.push((Pair::new(a, Other::Wall(w), DVec3::ZERO), candidates.skin(a)));
                }
            }
        }
        for &Close { a, b, image } in candidates.close.iter().filter(|close| !self.still[close.b]) {
            let skin = candidates.skin(a) + candidates.skin(b);
            let swap = bodies[b].is_free() && self.rank[b] < self.rank[a];
            let (a, b, image) = if swap { (b, a, -image) } else { (a, b, image) };
            pairs.push((Pair::new(a, Other::Solid(b), image), skin));
        }
        let place = |(pair, _): &(Pair, f64)| match pair.b {
            Other::Wall(w) => (false, self.rank[pair.a], w),
            Other::Solid(b) => (true, self.rank[pair.a], self.rank[b]),
        };
        pairs.sort_by_key(place);
        pairs
    }

    /// Smallest weight that a touch of `a` and `b` may have [-]: that of a corner of either, as far as forces move it; a ball
    /// touches as a whole.
    fn lightest_touch(&self, a: usize, b: Option<usize>, bodies: &[Body]) -> f64 {
        let either = || std::iter::once(a).chain(b);
        if either().any(|k| self.surfaces[k].ball.is_some()) {
            return 1.0;
        }
        let free = either().filter(|&k| bodies[k].is_free());
        free.map(|k| self.surfaces[k].smallest_weight).fold(1.0, f64::min)
    }

    /// Hands the depths of the pairs before on to `pairs`: what had none was apart.
    fn carry(before: &[Pair], is_first: bool, pairs: &mut [Pair]) {
        if is_first {
            return;
        }
        let deep = before.iter().filter(|p| p.depth > 0.0);
        let key = |p: &Pair| (p.a, p.b, p.image.to_array().map(f64::to_bits));
        let depths: HashMap<_, f64> = deep.map(|p| (key(p), p.depth)).collect();
        for pair in pairs {
            pair.depth = depths.get(&key(pair)).copied().unwrap_or(0.0);
        }
    }

    /// Makes the lists of points.
    fn collect(&mut self, candidates: &Candidates, bodies: &[Body]) {
        let is_first = self.generation == 0;
        self.generation = candidates.generation();
        let pairs = self.close(candidates, bodies);
        let before = std::mem::take(&mut self.pairs);
        let fill = |(mut pair, skin): (Pair, f64)| {
            pair.collect(bodies, &self.surfaces, &self.walls, skin);
            (!pair.is_empty()).then_some(pair)
        };
        self.pairs = if pairs.len() >= MANY_PAIRS {
            pairs.into_par_iter().filter_map(fill).collect()
        } else {
            pairs.into_iter().filter_map(fill).collect()
        };
        Self::carry(&before, is_first, &mut self.pairs);
    }

    /// Lists, constants and forces by the host.
    fn press_on_host(&mut self, now: Now) {
        if !self.is_current(now.candidates) {
            self.collect(now.candidates, now.bodies);
            self.constants = None;
        }
        let wanted = Some((now.substep, now.limits.longest_step));
        if self.constants != wanted {
            let mut pairs = std::mem::take(&mut self.pairs);
            self.set_constants(&mut pairs, now.limits, now.bodies, now.substep);
            (self.pairs, self.constants) = (pairs, wanted);
        }
        self.press(now.bodies, LEAST, Some(&now.candidates.travel));
    }

    /// What `b` is of the scene.
    fn against(&self, b: Other) -> Against {
        match b {
            Other::Solid(b) => Against::Solid(b),
            Other::Wall(w) => self.walls[w].of,
        }
    }

    /// Constants of `pair` for the longest sub-steps of `limits`.
    fn constants_of(&self, pair: &Pair, limits: &Limits, bodies: &[Body]) -> Constants {
        let [a, b] = self.middles.of(pair);
        let weight = self.lightest_touch(pair.a, pair.b.solid(), bodies);
        let between = limits.between.of(pair.a, self.against(pair.b));
        limits.constants(bodies, pair.a, pair.b.solid(), between, weight, self.spacing.min(a).min(b))
    }

    /// Constants of `pairs` for sub-steps of `h` [s].
    fn set_constants(&self, pairs: &mut [Pair], limits: &Limits, bodies: &[Body], h: f64) {
        for pair in pairs {
            pair.constants = self.constants_of(pair, limits, bodies);
            // before the first step there is no sub-step to follow
            if h > 0.0 {
                let mass = reduced_mass(bodies, pair.a, pair.b.solid());
                pair.constants.discretise(mass, h, limits.restores());
            }
        }
    }

    /// Forces of all pairs, of those alone that `travel` [m] of each solid since the lists were made does not leave apart.
    fn press(&mut self, bodies: &[Body], least: f64, travel: Option<&[f64]>) {
        let (surfaces, walls, spacing) = (&self.surfaces, &self.walls, self.spacing);
        let press = |pair: &mut Pair| {
            let apart = travel.is_some_and(|travel| {
                let way = travel[pair.a] + pair.b.solid().map_or(0.0, |b| travel[b]);
                pair.stays_apart(way, bodies, surfaces, walls)
            });
            if !apart {
                pair.evaluate(bodies, surfaces, walls, spacing, least);
            }
        };
        if self.pairs.len() >= MANY_PAIRS {
            self.pairs.par_iter_mut().for_each(press);
        } else {
            self.pairs.iter_mut().for_each(press);
        }
    }
}

impl Law for Smooth {
    fn evaluate(&mut self, now: Now, device: Option<Link>) -> Result<()> {
        // the kernel presses points of boxes into boxes
        let Some(mut link) = device.filter(|_| !self.is_round()) else {
            (self.device, self.on_device) = (None, false);
            self.press_on_host(now);
            return Ok(());
        };
        let mut pairs = match self.device.take() {
            Some(pairs) => pairs,
            None => device::Pairs::new(&self.surfaces, &mut link)?.into(),
        };
        if !pairs.is_current(now.candidates) {
            pairs.search(self, now.candidates, now.bodies, &mut link)?;
        }
        pairs.set_constants(self, now.limits, now.bodies, now.substep);
        pairs.evaluate(self, now.bodies, &mut link)?;
        (self.device, self.on_device) = (Some(pairs), true);
        Ok(())
    }

    fn add_loads(&self, bodies: &[Body], load: &mut [Wrench]) {
        for pair in self.evaluated() {
            load[pair.a] += pair.wrench[0];
            match pair.b {
                Other::Solid(b) => load[b] += pair.wrench[1],
                Other::Wall(w) => {
                    let wall = &self.walls[w];
                    if let Against::Solid(b) = wall.of {
                        let Wrench { force, torque } = pair.wrench[0];
                        let arm = bodies[pair.a].pose.position - wall.middle;
                        load[b] += Wrench { force: -force, torque: -torque - arm.cross(force) };
                    }
                }
            }
        }
    }

    fn press_walls(&self, bodies: &[Body], span: f64, fixed: &mut FixedWalls) {
        for pair in self.evaluated() {
            if let Against::Wall(k) = self.against(pair.b) {
                let (on_body, at) = (&pair.wrench[0], bodies[pair.a].pose.position);
                fixed.touch(k, -span * on_body.force, at, -span * on_body.torque);
            }
        }
    }

    fn act(&mut self, bodies: &mut [Body], fixed: &mut FixedWalls, limits: &Limits, h: f64) -> Summary {
        let mut friction = std::mem::take(&mut self.friction);
        friction.apply(self.evaluated(), bodies, limits.viscous_friction, h);
        friction.press_walls(bodies, &self.walls, fixed);
        self.friction = friction;
        Summary::default()
    }

    fn summary(&self) -> Summary {
        let mut summary = Summary::default();
        self.evaluated().iter().for_each(|p| summary.add(p.contact_count(), p.energy, p.depth));
        summary
    }

    fn fault(&self, now: Now) -> Option<Fault> {
        self.first_fault(&now)
    }

    fn hurry(&self, now: Now, dt: f64, cut: Cut) -> std::result::Result<Cut, Fault> {
        self.cut_of_way(&now, dt, cut)
    }

    fn nears_stop(&self, now: Now) -> bool {
        self.is_near_stop(&now)
    }

    fn forget(&mut self) {
        self.generation = 0;
        self.device = None;
        self.friction.forget();
    }

    fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        self.friction.exchange(archive)
    }

    fn brought_back(&mut self) {
        // the first lists know of none before
        self.generation = 0;
        self.device.iter_mut().for_each(|device| device.forget());
    }

    fn moved(&mut self) {
        let device = self.device.iter_mut().flat_map(|d| &mut d.pairs);
        self.pairs.iter_mut().chain(device).for_each(Pair::moved);
    }

    fn energy(&mut self, now: Now) -> f64 {
        self.press_on_host(now);
        self.pairs.iter_mut().for_each(Pair::looked_at);
        self.pairs.iter().map(|p| p.energy).sum()
    }

    fn worst(&self, limits: &Limits, bodies: &[Body], dt: f64) -> Worst {
        stability::worst(self, limits, bodies, dt)
    }

    fn spring(&self, energy: f64) -> Option<(f64, &'static str)> {
        let corner = self.lightest_point.powf(2.0 / EXPONENT);
        let spring = energy / (STOP_DEPTH * self.spacing).powi(2) / corner;
        Some((spring, "hard impacts reach a quarter of the spacing, where a stiffer stop takes over"))
    }

    fn softens(&self) -> bool {
        true
    }

    fn probe(&mut self, bodies: &[Body], device: Option<Link>, probe: &mut Probe) -> Result<()> {
        if !self.on_device {
            // at a glance nothing is left out, as on a device, which leaves next to nothing out
            self.press(bodies, 0.0, None);
        }
        probe::fill(self, bodies, device, probe)
    }
}
