//! The inertia of the water in slots. What comes nearer to a floor presses the water between out at the sides, and what is lifted
//! draws it in, the faster the narrower the gap h: the water's momentum is a body's as well.
//!
//! Water in a gap moves along it. With u = -grad phi, the closing speed w of the surfaces, and phi = 0 at the rim,
//!
//! div(h grad phi) = -w,  p = rho dphi/dt - rho u^2 / 2 + const,
//!
//! with p = 0 at the rim where it flows out, and -rho u^2 / 2 where it comes in from rest; what flows from a narrower into a wider part of a gap loses what a
//! jet does. By the body's velocity V, phi = -X V, and by its acceleration a the pressure is -rho X a: with the rows R of S in the slot the body has the
//! added inertia
//!
//! A = rho R^T L^-1 R,  X = L^-1 R,
//!
//! L the operator of the gap on the rows of the wall layer, each with those beside it. The rest of p goes with the square of V: it brakes
//! what comes down, 2 A V^2 / h of a plate, which takes the force as -D V of the speed at the end of the step, D = f f^T / -(f . V), so that it
//! cannot throw the plate back. Where what is before a row moves, or is a free body, the gap ends.

use super::{Field, Found, Opposite, Slots};
use crate::body::{Mobility, Pose, Six, Wrench};
use crate::kernels::coupling::row;
use glam::DVec3;

/// Least gap that water is pressed through, over l0: what stands on a floor stands on its unevenness.
const LEAST: f64 = 0.1;
/// A face of a row looks out of the slot beside what of the row looks into it if their directions are so far apart (cosine of the angle).
const ASIDE: f64 = 0.7;
/// Where the residual ends, over the first [-].
const TOLERANCE: f64 = 1e-6;
/// Most iterations; they go with the rows across the slot.
const ITERATIONS: usize = 2000;

/// What the water in a slot does as it is pressed out or drawn in.
#[derive(Clone, Debug, PartialEq)]
pub struct Pressing {
    /// Index of the body.
    pub solid: usize,
    /// Added inertia A, world axes about its position.
    inertia: Six,
    /// What the speed at the step's start makes press on it.
    pub speed: Wrench,
    /// How much less that is [-] for each watt that the end of the step takes from its power.
    braked: f64,
    /// Rows of its layer in the slot.
    rows: Vec<PressedRow>,
}

/// A row in such a slot.
#[derive(Clone, Debug, PartialEq)]
struct PressedRow {
    row: usize,
    /// Pressure by unit accelerations of the body [Pa s2/m], [Pa s2].
    by_acceleration: [f64; 6],
    /// Pressure by the speed at the step's start [Pa].
    by_speed: f64,
}

fn six(w: &Wrench) -> [f64; 6] {
    let Wrench { force, torque } = w;
    [force.x, force.y, force.z, torque.x, torque.y, torque.z]
}

fn wrench(v: [f64; 6]) -> Wrench {
    Wrench { force: DVec3::new(v[0], v[1], v[2]), torque: DVec3::new(v[3], v[4], v[5]) }
}

fn dot(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn velocity(pose: &Pose) -> [f64; 6] {
    six(&Wrench { force: pose.velocity, torque: pose.angular_velocity })
}

impl Pressing {
    /// Adds its A to `added`.
    pub fn add_inertia(&self, added: &mut Six) {
        add(added, |i, j| self.inertia[i][j]);
    }

    /// Adds to `added` what takes from [`Self::speed`] as the body, which moves by `mobility` and is at `before`, slows down in `dt` [s]; not what would
    /// stop it at once along what it hardly moves along.
    pub fn add_braking(&mut self, added: &mut Six, mobility: &Mobility, before: &Pose, dt: f64) {
        let f = six(&self.speed);
        let power = -dot(&f, &velocity(before));
        let (velocity, turn) = mobility.answer(&self.speed);
        let stops = dt * dot(&f, &six(&Wrench { force: velocity, torque: turn }));
        self.braked = if power > 0.0 { power.max(stops).recip() } else { 0.0 };
        add(added, |i, j| dt * self.braked * f[i] * f[j]);
    }

    /// How much of what the speed makes is left at the end of a step of `dt` [s] with the acceleration `a` [-].
    fn left(&self, a: &[f64; 6], dt: f64) -> f64 {
        1.0 - self.braked * dt * dot(&six(&self.speed), a)
    }

    /// What it did to the body, which went from the pose `before` to `after` in `dt` [s].
    pub fn force(&self, before: &Pose, after: &Pose, dt: f64) -> Wrench {
        let a = acceleration(before, after, dt);
        let mut sum = wrench(std::array::from_fn(|i| -dot(&self.inertia[i], &a)));
        sum.add(self.left(&a, dt), &self.speed);
        sum
    }

    /// The pressure of it in the rows of the slot [Pa], the same.
    pub fn pressures(
        &self,
        before: &Pose,
        after: &Pose,
        dt: f64,
    ) -> impl Iterator<Item = ((usize, usize), f64)> {
        let a = acceleration(before, after, dt);
        let left = self.left(&a, dt);
        let of = move |r: &PressedRow| ((self.solid, r.row), dot(&r.by_acceleration, &a) + left * r.by_speed);
        self.rows.iter().map(of)
    }
}

fn add(sum: &mut Six, of: impl Fn(usize, usize) -> f64) {
    for (i, row) in sum.iter_mut().enumerate() {
        row.iter_mut().enumerate().for_each(|(j, x)| *x += of(i, j));
    }
}

fn acceleration(before: &Pose, after: &Pose, dt: f64) -> [f64; 6] {
    let (v, w) = (velocity(before), velocity(after));
    std::array::from_fn(|k| (w[k] - v[k]) / dt)
}

/// A slot as water flows through it.
struct Gap {
    /// Rows of the layer.
    rows: Vec<usize>,
    /// Of each the gap [m], whether that is more than the least, and its row of S [m2], [m3].
    width: Vec<f64>,
    is_open: Vec<bool>,
    pressed: Vec<[f64; 6]>,
    /// Area [m2].
    area: Vec<f64>,
    /// Of each those beside it, with the breadth of the way there over its length [-].
    ways: Vec<Vec<(usize, f64)>>,
    /// The same of the ways out at the rim, in all, and of one of them.
    out: Vec<f64>,
    steep: Vec<f64>,
    spacing: f64,
}

/// What stands at the way from row `k` to another in a gap of the widths `h` [m]: its breadth over its length times the gap [m].
fn through(h: &[f64], k: usize, (j, way): (usize, f64)) -> f64 {
    0.5 * (h[k] + h[j]) * way
}

impl Gap {
    /// L x of the gap with the widths `h` [m].
    fn apply(&self, h: &[f64], x: &[f64]) -> Vec<f64> {
        let of = |k: usize| {
            let beside = self.ways[k].iter().map(|&way| through(h, k, way) * (x[k] - x[way.0]));
            beside.sum::<f64>() + h[k] * self.out[k] * x[k]
        };
        (0..x.len()).map(of).collect()
    }

    /// L^-1 b, by conjugate gradients.
    fn solve(&self, b: &[f64]) -> Vec<f64> {
        let h = &self.width;
        let mut x = vec![0.0; b.len()];
        let diagonal: Vec<f64> = (0..b.len())
            .map(|k| {
                let beside = self.ways[k].iter().map(|&way| through(h, k, way));
                beside.sum::<f64>() + h[k] * self.out[k]
            })
            .collect();
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let divided = |r: &[f64]| r.iter().zip(&diagonal).map(|(r, d)| r / d).collect::<Vec<f64>>();
        let mut r = b.to_vec();
        let mut z = divided(&r);
        let mut p = z.clone();
        let first = product(&r, &z);
        let mut now = first;
        for _ in 0..ITERATIONS {
            if now <= TOLERANCE * TOLERANCE * first {
                break;
            }
            let q = self.apply(h, &p);
            let step = now / product(&p, &q);
            x.iter_mut().zip(&p).for_each(|(x, p)| *x += step * p);
            r.iter_mut().zip(&q).for_each(|(r, q)| *r -= step * q);
            z = divided(&r);
            let next = product(&r, &z);
            p.iter_mut().zip(&z).for_each(|(p, z)| *p = z + next / now * *p);
            now = next;
        }
        x
    }

    /// Pressure over density of the rows by the speed `v` of the body, with the `phi` that it makes [m2/s2].
    fn by_speed(&self, v: &[f64; 6], phi: &[f64]) -> Vec<f64> {
        // The gap closes at -row . v over its area; water in the least one is pressed out still, and not drawn in.
        let closing = |k: usize| {
            let speed = -dot(&self.pressed[k], v) / self.area[k];
            if self.is_open[k] { speed } else { speed.max(0.0) }
        };
        let closing: Vec<f64> = (0..phi.len()).map(closing).collect();
        // Half of the square of the speed, along each axis from the ways to both sides.
        let scale = 0.25 / self.spacing.powi(2);
        let half_square = |k: usize| {
            let along = |&(j, way): &(usize, f64)| (way * (phi[k] - phi[j])).powi(2);
            scale
                * (self.ways[k].iter().map(along).sum::<f64>() + self.out[k] * self.steep[k] * phi[k].powi(2))
        };
        let energy: Vec<f64> = (0..phi.len()).map(half_square).collect();
        // What is lost where the gap widens is that of a jet, by Borda and Carnot.
        let lost = |from: usize, to: usize, flow: f64| {
            let (narrow, wide) = (self.width[from], self.width[to]);
            if wide > narrow {
                0.5 * (flow / (self.spacing * narrow) * (1.0 - narrow / wide)).powi(2)
            } else {
                0.0
            }
        };
        let mut b = self.apply(&closing, phi);
        for (k, b) in b.iter_mut().enumerate() {
            for &(j, way) in &self.ways[k] {
                let through = through(&self.width, k, (j, way));
                let flow = through * (phi[k] - phi[j]);
                let lost = if flow > 0.0 { lost(k, j, flow) } else { -lost(j, k, -flow) };
                *b += through * (energy[j] - energy[k] + lost);
            }
            // Water comes in from rest, and goes out with its speed, at the pressure that is there.
            let leaves = 0.5 * (self.steep[k] * phi[k].max(0.0) / self.spacing).powi(2);
            *b += self.width[k] * self.out[k] * (leaves - energy[k]);
        }
        self.solve(&b)
    }
}

impl Slots {
    /// What the water in the slot `found` of a free body at `pose` does as that is pressed out or drawn in, by its `field`, without which all of it
    /// is under water; `None` where nothing that stands still is before it, or no way leads out.
    pub(super) fn pressing(&self, found: &Found, field: Option<&Field>, pose: &Pose) -> Option<Pressing> {
        let Found { slot, faced, .. } = found;
        let layer = &self.layers[slot.solid];
        let l0 = self.spacing;
        let stands = |on: Opposite| match on {
            Opposite::Wall(_) => true,
            Opposite::Solid(k, _) => self.layers[k].still,
        };
        let areas = layer.areas(&layer.area, found, pose);
        let mut gap = Gap {
            rows: vec![],
            width: vec![],
            is_open: vec![],
            pressed: vec![],
            area: vec![],
            ways: vec![],
            out: vec![],
            steep: vec![],
            spacing: l0,
        };
        let mut inwards = vec![];
        for (&(n, share), &area) in slot.inside.iter().zip(&areas) {
            let place = pose.orientation * layer.offset[n];
            let wet = field.is_none_or(|field| self.in_slot(field, place, place) > field.lowest);
            if !wet || area == DVec3::ZERO || !faced[n].all().all(stands) {
                continue;
            }
            let mut pressed = Wrench::default();
            for (area, at) in layer.faces(n, area, pose) {
                pressed.add(share, &row(area, at));
            }
            gap.rows.push(n);
            inwards.push(pose.orientation.inverse() * area.normalize());
            gap.width.push(faced[n].gap.max(LEAST * l0));
            gap.is_open.push(faced[n].gap > LEAST * l0);
            gap.pressed.push(six(&pressed));
            gap.area.push(area.length());
        }
        for (&n, &inwards) in gap.rows.iter().zip(&inwards) {
            let (mut ways, mut rims, mut ends) = (vec![], 0, 0);
            // Not those on the other side of a plate.
            for &m in layer.adjacent[n].iter().filter(|&&m| layer.go_on(n, m as usize)) {
                match gap.rows.binary_search(&(m as usize)) {
                    Ok(k) => ways.push((k, l0 / (layer.offset[n] - layer.offset[m as usize]).length())),
                    Err(_) if slot.rim.binary_search(&(m as usize)).is_ok() => rims += 1,
                    Err(_) => ends += 1,
                }
            }
            // What of a row at an edge looks out of the slot is half a spacing away; a surface that bends goes on to the rim.
            let aside = |way: DVec3| way.dot(inwards).abs() < ASIDE;
            let looks_out = faced[n].by_face.iter().filter(|face| face.1.is_none() && aside(face.0)).count();
            let (beside, steep) = if looks_out > 0 { (2 * looks_out, 2.0) } else { (rims, 1.0) };
            gap.ways.push(ways);
            gap.out.push((beside + ends) as f64);
            gap.steep.push(steep);
        }
        if gap.out.iter().all(|&out| out == 0.0) {
            return None;
        }
        let density = self.density;
        let modes: [Vec<f64>; 6] = std::array::from_fn(|mode| {
            let b: Vec<f64> = gap.pressed.iter().map(|row| row[mode]).collect();
            gap.solve(&b)
        });
        let by_acceleration = |k: usize| std::array::from_fn(|mode| -density * modes[mode][k]);
        let inertia = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                density * gap.pressed.iter().zip(&modes[j]).map(|(row, x)| row[i] * x).sum::<f64>()
            })
        });
        let v = velocity(pose);
        let phi: Vec<f64> =
            (0..gap.rows.len()).map(|k| -(0..6).map(|m| modes[m][k] * v[m]).sum::<f64>()).collect();
        let by_speed: Vec<f64> = gap.by_speed(&v, &phi).into_iter().map(|p| density * p).collect();
        let mut speed = [0.0; 6];
        for (row, p) in gap.pressed.iter().zip(&by_speed) {
            speed.iter_mut().zip(row).for_each(|(sum, r)| *sum += p * r);
        }
        let rows = gap.rows.iter().enumerate().map(|(k, &row)| PressedRow {
            row,
            by_acceleration: by_acceleration(k),
            by_speed: by_speed[k],
        });
        Some(Pressing { solid: slot.solid, inertia, speed: wrench(speed), braked: 0.0, rows: rows.collect() })
    }
}
