//! Candidates: which solids, and which of their points, may touch within the next steps.
//!
//! Lists are made with a skin and kept until some body has travelled through its share of it, so a
//! body at rest costs only its contacts.

use super::broad::{Bounds, PointGrid, meeting};
use super::friction::Friction;
use super::geometry::{self, WallBox};
use super::stiffness::{self, Damping, MOST_SUBSTEPS};
use super::{Limits, paper, smooth};
use crate::body::{Body, Pose};
use crate::scene::Scene;
use crate::shape::{Cuboid, Geometry, Surface};
use rayon::prelude::*;

/// Pairs from which the evaluation is spread over threads.
pub(crate) const MANY_PAIRS: usize = 64;
/// Steps that the lists of a body in steady flight should last.
const STEPS_AHEAD: f64 = 6.0;

/// The lists' validity, and the pairs of solids that are close.
pub(crate) struct Candidates {
    /// Path of each solid's fastest point since the lists were made [m].
    pub(super) travel: Vec<f64>,
    /// Path that each solid may make [m].
    pub(super) skin: Vec<f64>,
    pub(super) valid: bool,
    /// Counts how often the pairs were made.
    pub(super) generation: u64,
    /// Poses that the lists were made in, and the step that they were made for [s].
    pub(super) made: Vec<Pose>,
    pub(super) made_dt: f64,
    /// Pairs of solids (a free one first) whose bounding boxes meet, sorted.
    pub close: Vec<(usize, usize)>,
}

impl Candidates {
    pub fn new(poses: &[Pose]) -> Self {
        let solids = poses.len();
        Self {
            made: poses.to_vec(),
            made_dt: 0.0,
            travel: vec![0.0; solids],
            skin: vec![0.0; solids],
            valid: false,
            generation: 0,
            close: vec![],
        }
    }

    /// Drops the lists.
    pub fn forget(&mut self) {
        self.valid = false;
    }

    /// Changes whenever the pairs are made anew; never 0 then.
    pub fn generation(&self) -> u64 {
        self.generation
    }

    /// Skin of solid `k` [m].
    pub fn skin(&self, k: usize) -> f64 {
        self.skin[k]
    }

    /// Notes that `body` moved for `h` [s].
    pub fn travelled(&mut self, k: usize, body: &Body, h: f64) {
        let speed = body.pose.velocity.length() + body.pose.angular_velocity.length() * body.radius();
        self.travel[k] += h * speed;
        // a state that is no number must not keep the lists alive
        self.valid &= self.travel[k] <= self.skin[k];
    }

    /// Makes the pairs of solids anew if the old ones no longer hold.
    pub fn refresh(&mut self, bodies: &[Body], spacing: f64, dt: f64) {
        if self.valid {
            return;
        }
        self.made_dt = dt;
        for (k, body) in bodies.iter().enumerate() {
            self.made[k] = body.pose;
            let speed = body.pose.velocity.length() + body.pose.angular_velocity.length() * body.radius();
            self.skin[k] = 0.25 * spacing + STEPS_AHEAD * dt * speed;
            self.travel[k] = 0.0;
        }
        let bounds: Vec<Bounds> = bodies
            .iter()
            .enumerate()
            .map(|(k, b)| {
                // a spacing more: the paper's law reaches d_c - l0 beyond the surfaces
                let reach = b.extent() + self.skin[k] + 0.5 * spacing;
                (b.pose.position - reach, b.pose.position + reach)
            })
            .collect();
        self.close = meeting(&bounds)
            .into_iter()
            .filter(|&(i, j)| bodies[i].is_free() || bodies[j].is_free())
            .map(|(i, j)| if bodies[i].is_free() { (i, j) } else { (j, i) })
            .collect();
        self.valid = true;
        self.generation += 1;
    }
}

/// The smooth law's geometry and pairs.
pub(crate) struct Smooth {
    pub surfaces: Vec<Surface>,
    pub walls: Vec<WallBox>,
    pub pairs: Vec<smooth::Pair>,
    pub friction: Friction,
    pub spacing: f64,
    generation: u64,
}

impl Smooth {
    pub fn new(scene: &Scene) -> Self {
        Self {
            surfaces: scene.solids.iter().map(|s| s.surface(scene.spacing, scene.dimensions)).collect(),
            walls: geometry::walls(scene),
            pairs: vec![],
            friction: Friction::default(),
            spacing: scene.spacing,
            generation: 0,
        }
    }

    /// Whether any solid is round somewhere.
    pub fn is_round(&self) -> bool {
        self.surfaces.iter().any(Surface::is_round)
    }

    /// Whether the lists are those of `candidates`.
    pub fn is_current(&self, candidates: &Candidates) -> bool {
        self.generation == candidates.generation
    }

    /// Pairs of solids that are close, each with its skin [m]; without points.
    pub fn close(&self, candidates: &Candidates, bodies: &[Body]) -> Vec<(smooth::Pair, f64)> {
        let mut pairs: Vec<(smooth::Pair, f64)> = vec![];
        for (a, body) in bodies.iter().enumerate().filter(|(_, b)| b.is_free()) {
            for (w, wall) in self.walls.iter().enumerate() {
                let q = wall.axes.transpose() * (body.pose.position - wall.center);
                let extent = body.shape.extent(wall.axes.transpose() * body.rotation);
                if (Cuboid { half: wall.half + extent }).outside(q) < candidates.skin(a) {
                    pairs.push((smooth::Pair::new(a, smooth::Other::Wall(w)), candidates.skin(a)));
                }
            }
        }
        for &(a, b) in &candidates.close {
            let skin = candidates.skin(a) + candidates.skin(b);
            pairs.push((smooth::Pair::new(a, smooth::Other::Solid(b)), skin));
        }
        pairs
    }

    /// Makes the lists of points.
    pub fn collect(&mut self, candidates: &Candidates, bodies: &[Body]) {
        self.generation = candidates.generation;
        let pairs = self.close(candidates, bodies);
        let fill = |(mut pair, skin): (smooth::Pair, f64)| {
            pair.collect(bodies, &self.surfaces, &self.walls, skin);
            (!pair.is_empty()).then_some(pair)
        };
        self.pairs = if pairs.len() >= MANY_PAIRS {
            pairs.into_par_iter().filter_map(fill).collect()
        } else {
            pairs.into_iter().filter_map(fill).collect()
        };
    }

    /// Constants of every pair for sub-steps of `h` [s].
    pub fn set_constants(&mut self, limits: &Limits, bodies: &[Body], spacing: f64, h: f64) {
        set_constants(&mut self.pairs, &self.surfaces, limits, bodies, spacing, h);
    }

    pub fn evaluate(&mut self, bodies: &[Body]) {
        let (surfaces, walls, spacing) = (&self.surfaces, &self.walls, self.spacing);
        if self.pairs.len() >= MANY_PAIRS {
            self.pairs.par_iter_mut().for_each(|p| p.evaluate(bodies, surfaces, walls, spacing));
        } else {
            self.pairs.iter_mut().for_each(|p| p.evaluate(bodies, surfaces, walls, spacing));
        }
    }
}

/// Constants of `pairs` for sub-steps of `h` [s].
pub(crate) fn set_constants(
    pairs: &mut [smooth::Pair],
    surfaces: &[Surface],
    limits: &Limits,
    bodies: &[Body],
    spacing: f64,
    h: f64,
) {
    for pair in pairs {
        let b = pair.b.solid();
        let weight = surfaces[pair.a].smallest_weight;
        pair.constants = limits.constants(bodies, pair.a, b, weight, spacing);
        pair.constants.discretise(reduced_mass(bodies, pair.a, b), h, limits.damping.is_ratio());
    }
}

/// The paper's law's geometry and pairs.
pub(crate) struct Paper {
    pub layers: Vec<paper::Layer>,
    pub walls: paper::Walls,
    pub pairs: Vec<paper::Pair>,
    generation: u64,
}

impl Paper {
    pub fn new(scene: &Scene) -> Self {
        let layers = scene.solids.iter().map(|s| paper::Layer {
            offsets: s.wall_offset.clone(),
            normals: s.wall_area.iter().map(|a| a.normalize_or_zero()).collect(),
        });
        let positions = scene.position[scene.groups.static_wall_range()].to_vec();
        Self {
            layers: layers.collect(),
            walls: paper::Walls {
                grid: PointGrid::new(positions, 2.0 * scene.spacing),
                normals: scene.static_wall_normal.clone(),
            },
            pairs: vec![],
            generation: 0,
        }
    }

    /// Whether the lists are those of `candidates`.
    pub fn is_current(&self, candidates: &Candidates) -> bool {
        self.generation == candidates.generation
    }

    /// Pairs of solids that are close, each with the reach of its particles [m]; without particles.
    pub fn close(&self, candidates: &Candidates, bodies: &[Body], distance: f64) -> Vec<(paper::Pair, f64)> {
        let mut pairs: Vec<(paper::Pair, f64)> = vec![];
        for (a, body) in bodies.iter().enumerate().filter(|(_, b)| b.is_free()) {
            let reach = body.extent() + candidates.skin(a) + distance;
            if self.walls.grid.meets(&(body.pose.position - reach, body.pose.position + reach)) {
                pairs.push((paper::Pair::new(a, None), distance + candidates.skin(a)));
            }
        }
        for &(a, b) in &candidates.close {
            let reach = distance + candidates.skin(a) + candidates.skin(b);
            pairs.push((paper::Pair::new(a, Some(b)), reach));
        }
        pairs
    }

    /// Makes the lists of particle pairs within `distance` [m].
    pub fn collect(&mut self, candidates: &Candidates, bodies: &[Body], distance: f64) {
        self.generation = candidates.generation;
        let pairs = self.close(candidates, bodies, distance);
        let fill = |(mut pair, reach): (paper::Pair, f64)| {
            pair.collect(bodies, &self.layers, &self.walls, reach);
            (!pair.candidates.is_empty()).then_some(pair)
        };
        self.pairs = if pairs.len() >= MANY_PAIRS {
            pairs.into_par_iter().filter_map(fill).collect()
        } else {
            pairs.into_iter().filter_map(fill).collect()
        };
    }

    pub fn evaluate(&mut self, law: &paper::Law, bodies: &[Body]) {
        let (layers, walls) = (&self.layers, &self.walls);
        if self.pairs.len() >= MANY_PAIRS {
            self.pairs.par_iter_mut().for_each(|p| p.evaluate(law, bodies, layers, walls));
        } else {
            self.pairs.iter_mut().for_each(|p| p.evaluate(law, bodies, layers, walls));
        }
    }
}

/// Mass of the relative motion of two solids [kg]; `None` is a wall.
pub(crate) fn reduced_mass(bodies: &[Body], a: usize, b: Option<usize>) -> f64 {
    1.0 / (1.0 / bodies[a].mass + b.map_or(0.0, |b| 1.0 / bodies[b].mass))
}

impl Limits {
    /// dt sqrt(K / m_e) of a sub-step: smaller where the energy of an impact is what the case is about,
    /// because it gives a restitution or has next to no damping to take an error away.
    pub fn omega_step(&self) -> f64 {
        let elastic = match self.damping {
            Damping::Ratio(_) => true,
            Damping::Coefficient(c) => c < 0.02 * (self.spring * self.lightest).sqrt(),
        };
        if elastic { stiffness::ELASTIC_OMEGA_STEP } else { stiffness::OMEGA_STEP }
    }

    /// Constants of the contact of `a` with `b` as the smooth law uses them: what the case asks for, as
    /// far as the sub-steps of the longest step so far can carry it.
    pub fn constants(
        &self,
        bodies: &[Body],
        a: usize,
        b: Option<usize>,
        weight: f64,
        spacing: f64,
    ) -> smooth::Constants {
        let mass = reduced_mass(bodies, a, b);
        let both =
            |of: fn(&stiffness::Lambda) -> f64| of(&self.lambda[a]) + b.map_or(0.0, |b| of(&self.lambda[b]));
        let shortest = self.longest_step / f64::from(self.forced.unwrap_or(MOST_SUBSTEPS));
        let carried = (self.omega_step() / shortest).powi(2) / both(|l| l.spring);
        let spring = if self.forced.is_some() { self.spring } else { self.spring.min(carried) };
        let closing = if b.is_some() { 2.0 } else { 1.0 } * self.fastest;
        let corner = weight.powf(2.0 / stiffness::EXPONENT);
        let stop = mass * (2.0 * closing / spacing).powi(2) / corner;
        let damping = self.damping.coefficient(spring, self.spring, mass);
        let carried_damping = stiffness::DAMPING_STEP / shortest / both(|l| l.damping);
        smooth::Constants {
            spring,
            stop: stop.min(carried).max(spring),
            stop_depth: 0.25 * spacing,
            step: shortest,
            damping: if self.forced.is_some() { damping } else { damping.min(carried_damping) },
        }
    }
}
