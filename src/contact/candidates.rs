//! Candidates: which solids, and which of their points, may touch within the next steps.
//!
//! Lists are made with a skin and kept until some body has travelled through its share of it, so a
//! body at rest costs only its contacts.

use super::broad::{Bounds, meeting_images};
use crate::body::{Body, Pose};
use crate::periodic::Periodic;
use glam::DVec3;

/// Pairs from which the evaluation is spread over threads.
pub(crate) const MANY_PAIRS: usize = 64;
/// Steps that the lists of a body in steady flight should last.
const STEPS_AHEAD: f64 = 6.0;

/// Two solids whose bounding boxes meet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Close {
    /// A free solid.
    pub a: usize,
    /// The other one.
    pub b: usize,
    /// The way from it to its image beside the first, over a periodic side [m].
    pub image: DVec3,
}

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
    /// Pairs of solids whose bounding boxes meet, sorted.
    pub close: Vec<Close>,
    pub(super) periodic: Periodic,
}

impl Candidates {
    pub fn new(poses: &[Pose], periodic: Periodic) -> Self {
        let solids = poses.len();
        Self {
            made: poses.to_vec(),
            made_dt: 0.0,
            travel: vec![0.0; solids],
            skin: vec![0.0; solids],
            valid: false,
            generation: 0,
            close: vec![],
            periodic,
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
        self.travel[k] += h * body.speed();
        // a state that is no number must not keep the lists alive
        self.valid &= self.travel[k] <= self.skin[k];
    }

    /// Drops the lists unless they hold for `h` [s] more at the speeds as they are: bodies may have been hit, or steps have become
    /// longer, since they were made.
    pub fn reach_ahead(&mut self, bodies: &[Body], h: f64) {
        let holds = |(k, body): (usize, &Body)| self.travel[k] + h * body.speed() <= self.skin[k];
        self.valid &= bodies.iter().enumerate().all(holds);
    }

    /// Makes the pairs of solids anew if the old ones no longer hold.
    pub fn refresh(&mut self, bodies: &[Body], spacing: f64, dt: f64) {
        if self.valid {
            return;
        }
        self.made_dt = dt;
        for (k, body) in bodies.iter().enumerate() {
            self.made[k] = body.pose;
            self.skin[k] = 0.25 * spacing + STEPS_AHEAD * dt * body.speed();
            self.travel[k] = 0.0;
        }
        let bounds: Vec<Bounds> = bodies
            .iter()
            .enumerate()
            .map(|(k, b)| {
                // a spacing more: the paper's law reaches d_c - l0 beyond the surfaces
                let reach = b.extent() + self.skin[k] + 0.5 * spacing;
                (b.shape_center() - reach, b.shape_center() + reach)
            })
            .collect();
        let way = |turns| self.periodic.way(turns);
        self.close = meeting_images(&bounds, &self.periodic)
            .into_iter()
            .filter(|&(i, j, _)| bodies[i].is_free() || bodies[j].is_free())
            .map(|(i, j, turns)| match bodies[i].is_free() {
                true => Close { a: i, b: j, image: way(turns) },
                false => Close { a: j, b: i, image: way(-turns) },
            })
            .collect();
        self.valid = true;
        self.generation += 1;
    }
}

/// Pose of `body` moved to its image `way` [m] from it.
pub(crate) fn image(body: &Body, way: DVec3) -> Pose {
    Pose { position: body.pose.position + way, ..body.pose }
}

/// Mass of the relative motion of two solids [kg]; `None` is a wall. Where they are locked in some directions it is that of
/// those in which it is largest; where forces move neither, of what they would be without.
pub(crate) fn reduced_mass(bodies: &[Body], a: usize, b: Option<usize>) -> f64 {
    let give = bodies[a].inverse_mass + b.map_or(DVec3::ZERO, |b| bodies[b].inverse_mass);
    let least = give.to_array().into_iter().filter(|&give| give > 0.0).fold(f64::INFINITY, f64::min);
    match least.is_finite() {
        true => 1.0 / least,
        false => 1.0 / (1.0 / bodies[a].mass + b.map_or(0.0, |b| 1.0 / bodies[b].mass)),
    }
}
