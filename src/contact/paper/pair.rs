//! Eqs. (10) to (14) for a pair of solids.

use super::facing::Facing;
use crate::body::{Body, Wrench};
use crate::contact::broad::PointGrid;
use crate::contact::candidates::image;
use glam::DVec3;

/// Constants of the law.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Constants {
    /// K [N/m].
    pub spring: f64,
    /// C [kg/s].
    pub damping: f64,
    /// eta [kg/s].
    pub viscous_friction: f64,
    /// d_c = sqrt(1.5) l0 [m].
    pub distance: f64,
    /// Whether forces turn bodies.
    pub torque: bool,
}

/// The wall layer of a solid: offsets from its centre, and the ways that its particles face, solid's frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layer {
    pub offsets: Vec<DVec3>,
    pub normals: Vec<Facing>,
}

/// The fixed wall particles.
#[derive(Clone, Debug)]
pub(crate) struct Walls {
    pub grid: PointGrid,
    pub normals: Vec<Facing>,
    /// Number in [`Scene::walls`](crate::scene::Scene::walls) of the one that each is of.
    pub of: Vec<u32>,
}

/// A free solid and what it may touch: candidates (i, j), found once and kept while nothing has moved
/// further than the skin.
#[derive(Clone, Debug)]
pub(crate) struct Pair {
    /// A free solid.
    pub a: usize,
    /// Another solid, or the fixed walls.
    pub b: Option<usize>,
    /// The way from it to its image beside `a` [m].
    pub image: DVec3,
    /// Candidates: particle of `a`, particle of `b`.
    pub candidates: Vec<(u32, u32)>,
    /// Wrench on `a` and on `b`, of the last evaluation.
    pub wrench: [Wrench; 2],
    /// Part of that on `a` that comes from each fixed wall, by its number.
    pub from_walls: Vec<(u32, Wrench)>,
    /// Pairs of particles within d_c, n_c.
    pub count: usize,
    /// Mean over the pairs of K (d_c - d)^2 / 2 [J].
    pub energy: f64,
    /// Smallest distance of two particles [m].
    pub closest: f64,
    /// Force on `a` along the normals [N].
    pub normal_force: f64,
}

impl Pair {
    pub fn new(a: usize, b: Option<usize>, image: DVec3) -> Self {
        Self {
            a,
            b,
            image,
            candidates: vec![],
            wrench: Default::default(),
            from_walls: vec![],
            count: 0,
            energy: 0.0,
            closest: f64::INFINITY,
            normal_force: 0.0,
        }
    }

    /// Candidates within `reach` [m].
    pub fn collect(&mut self, bodies: &[Body], layers: &[Layer], walls: &Walls, reach: f64) {
        self.candidates.clear();
        let body = &bodies[self.a];
        let at = |body: &Body, way: DVec3, offset: DVec3| body.pose.position + way + body.rotation * offset;
        let still = DVec3::ZERO;
        let offsets = layers[self.a].offsets.iter().enumerate();
        match self.b {
            None => {
                for (i, o) in offsets {
                    walls.grid.near(at(body, still, *o), reach, |j| self.candidates.push((i as u32, j)));
                }
            }
            Some(b) => {
                // only what lies inside the other's box, widened by the reach
                let near = |own: (&Body, DVec3), layer: &Layer, other: (&Body, DVec3)| {
                    let inside = |x: &DVec3| {
                        let q = other.0.rotation.transpose() * (*x - (other.0.shape_center() + other.1));
                        other.0.shape.outside(q) < reach
                    };
                    let points = layer.offsets.iter().enumerate();
                    let points = points.map(|(k, o)| (k as u32, at(own.0, own.1, *o)));
                    points.filter(|(_, x)| inside(x)).collect::<Vec<_>>()
                };
                let (own, other) = ((body, still), (&bodies[b], self.image));
                let theirs = near(other, &layers[b], own);
                for (i, x) in near(own, &layers[self.a], other) {
                    let close = theirs.iter().filter(|(_, y)| y.distance_squared(x) < reach * reach);
                    self.candidates.extend(close.map(|(j, _)| (i, *j)));
                }
            }
        }
    }

    /// Eq. (14) at the bodies' poses and velocities.
    pub fn evaluate(&mut self, law: &Constants, bodies: &[Body], layers: &[Layer], walls: &Walls) {
        let a = &bodies[self.a];
        let mut sum = [Wrench::default(); 2];
        self.from_walls.clear();
        let (mut count, mut energy, mut closest, mut normal_force) = (0, 0.0, f64::INFINITY, 0.0);
        let mut last = u32::MAX;
        let b = self.b.map(|b| (image(&bodies[b], self.image), bodies[b].rotation, &layers[b]));
        let (mut x_i, mut v_i) = (DVec3::ZERO, DVec3::ZERO);
        for &(i, j) in &self.candidates {
            if i != last {
                x_i = a.pose.position + a.rotation * layers[self.a].offsets[i as usize];
                v_i = a.pose.velocity_at(x_i);
                last = i;
            }
            let x_j = match &b {
                None => walls.grid.point(j),
                Some((pose, rotation, layer)) => pose.position + *rotation * layer.offsets[j as usize],
            };
            let r = x_j - x_i;
            let squared = r.length_squared();
            if squared >= law.distance * law.distance || squared == 0.0 {
                continue;
            }
            let d = squared.sqrt();
            let e = r / d;
            let (v_j, normal) = match &b {
                None => (DVec3::ZERO, walls.normals[j as usize].towards(-e)),
                Some((pose, rotation, layer)) => {
                    let normal = layer.normals[j as usize].towards(-(rotation.transpose() * e));
                    (pose.velocity_at(x_j), *rotation * normal)
                }
            };
            let v = v_j - v_i;
            let along = (-law.spring * (law.distance - d) * e + law.damping * v).dot(normal);
            let force = along * normal + law.viscous_friction * (v - v.dot(e) * e);
            count += 1;
            normal_force += along;
            energy += 0.5 * law.spring * (law.distance - d).powi(2);
            closest = closest.min(d);
            let on_a = Wrench { force, torque: (x_i - a.pose.position).cross(force) };
            sum[0] += on_a;
            match &b {
                Some((pose, ..)) => {
                    let arm = x_i - pose.position;
                    sum[1] += Wrench { force: -force, torque: -arm.cross(force) };
                }
                None => add_to(&mut self.from_walls, walls.of[j as usize], on_a),
            }
        }
        let share = 1.0 / count.max(1) as f64;
        let mean = |w: Wrench| Wrench {
            force: w.force * share,
            torque: if law.torque { w.torque * share } else { DVec3::ZERO },
        };
        self.wrench = sum.map(mean);
        self.from_walls.iter_mut().for_each(|(_, w)| *w = mean(*w));
        (self.count, self.energy, self.closest) = (count, energy * share, closest);
        self.normal_force = normal_force * share;
    }
}

/// Adds what comes from the fixed wall `wall`.
fn add_to(from_walls: &mut Vec<(u32, Wrench)>, wall: u32, wrench: Wrench) {
    match from_walls.iter_mut().find(|(known, _)| *known == wall) {
        Some((_, sum)) => *sum += wrench,
        None => from_walls.push((wall, wrench)),
    }
}
