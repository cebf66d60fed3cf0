//! What the water does between its particles.

use crate::case::Case;
use crate::periodic::Periodic;
use glam::{DMat3, DVec3};

/// Distance from a wall of the tank, over l0, below which a place is on it.
const ON_WALL: f64 = 0.25;
/// Square of the distance of a place from the middle of the particles about it along an axis, over the square of their spread along it, up
/// to which their slopes count in full: 3 to 6 on walls and in corners of water that is shaken by a tenth of a spacing, 20 where the second row is two
/// spacings off the wall.
const BEYOND: f64 = 8.0;

/// What the water does at a place.
#[derive(Clone, Copy, Debug, Default)]
pub struct Value {
    /// [m/s].
    pub velocity: DVec3,
    /// [Pa].
    pub pressure: f64,
}

/// Reads between particles.
#[derive(Clone, Copy, Debug)]
pub struct Probe {
    /// l0 [m].
    pub spacing: f64,
    /// Effective radius [m].
    pub radius: f64,
    /// In two dimensions, where y is that of the particles.
    pub flat: bool,
    /// Sides across which the water goes on.
    pub periodic: Periodic,
    /// Lower and upper inner corner of the tank [m], if there is one: there is no water beyond, which is no sign of its end.
    pub room: Option<[DVec3; 2]>,
    /// What the pressure of the particles lacks at the water's surface [Pa] ([`crate::kernels::body_force::missing_head`]).
    pub surface_head: f64,
}

impl Probe {
    /// For the water of `case`.
    pub fn of(case: &Case) -> Self {
        let (run, flat) = (&case.run, case.run.dimensions == 2);
        let (low, high) = case.tank.as_ref().map_or(([0.0; 3], [0.0; 3]), |t| (t.min, t.max));
        let along = case.tank.as_ref().map_or([false; 3], |t| t.periodic());
        let periodic = Periodic::new(along, low.into(), high.into());
        let mut gravity = periodic.across(run.gravity.into());
        if flat {
            gravity.y = 0.0;
        }
        let head =
            case.fluid.as_ref().map_or(0.0, |f| f.density * f.source().zero_pressure_depth(run.spacing));
        Self {
            spacing: run.spacing,
            radius: run.effective_radius * run.spacing,
            flat,
            periodic,
            room: Self::room(case),
            surface_head: head * gravity.length(),
        }
    }

    /// Corners of the tank of `case` [m].
    pub fn room(case: &Case) -> Option<[DVec3; 2]> {
        case.tank.as_ref().map(|t| [t.min.into(), t.max.into()])
    }

    /// How far the nearest particle of water may be from `x` [m]: half the diagonal of a cell of the lattice, and a tenth. On the tank's walls,
    /// where no water is on the other side, a particle that slides by is further away.
    fn reach(&self, x: DVec3) -> f64 {
        let on_wall = self.room.map_or([false; 3], |[low, high]| {
            let near = (x - low).abs().min((x - high).abs()).cmplt(DVec3::splat(ON_WALL * self.spacing));
            let [x, y, z] = self.periodic.length().to_array().map(|l| l == 0.0);
            [near.x && x, near.y && y && !self.flat, near.z && z]
        });
        let squares = (0..3)
            .filter(|&k| k != 1 || !self.flat)
            .map(|k| if on_wall[k] { 0.8 * 0.8 } else { 0.55 * 0.55 });
        self.spacing * squares.sum::<f64>().sqrt()
    }

    /// Velocity and pressure at `x` [m] of the water whose particles have `values`, position first: those of the linear function that comes
    /// nearest to the particles within the effective radius, by least squares with the weight (1 - r^2 / re^2)^2; where they do not span
    /// space, their mean. Exact for linear fields, on walls, in corners and at the surface, too, unless all water near is a single row. The pressure is that of gauges: with what it lacks at the
    /// surface, but for water without any, such as drops in the air. Nothing where no particle is near (`reach`).
    pub fn at(&self, values: impl Iterator<Item = (DVec3, Value)>, x: DVec3) -> Option<Value> {
        let mut near: Vec<(f64, DVec3, Value)> = Vec::new();
        let mut nearest = f64::INFINITY;
        for (p, value) in values {
            let mut way = self.periodic.nearest(p - x);
            if self.flat {
                way.y = 0.0;
            }
            let away = way.length_squared() / (self.radius * self.radius);
            if away < 1.0 {
                near.push(((1.0 - away).powi(2), way / self.spacing, value));
                nearest = nearest.min(away);
            }
        }
        if nearest.sqrt() * self.radius > self.reach(x) {
            return None;
        }
        let total: f64 = near.iter().map(|n| n.0).sum();
        let middle = near.iter().map(|n| n.0 * n.1).sum::<DVec3>() / total;
        let mut mean = Value::default();
        for (w, _, value) in &near {
            mean.velocity += w / total * value.velocity;
            mean.pressure += w / total * value.pressure;
        }
        let pressed = near.iter().any(|(_, _, value)| value.pressure != 0.0);
        let head = if pressed { self.surface_head } else { 0.0 };
        // Moments of the particles about their middle, over those of a full neighbourhood.
        let mut moment = DMat3::ZERO;
        // Of velocity and pressure with the place: rows x, y, z of the velocity, then the pressure.
        let mut with = [DVec3::ZERO; 4];
        for &(w, p, Value { velocity, pressure }) in &near {
            let d = p - middle;
            moment += DMat3::from_cols(w * d * d.x, w * d * d.y, w * d * d.z);
            for (sum, of) in with.iter_mut().zip([velocity.x, velocity.y, velocity.z, pressure]) {
                *sum += w * of * d;
            }
        }
        if self.flat {
            moment.y_axis = DVec3::Y * total;
        }
        // In a full neighbourhood the determinant is total^3 times 0.1 or so, in a corner in space 0.001.
        if moment.determinant() < 2e-4 * total.powi(3) {
            return Some(Value { pressure: mean.pressure + head, ..mean });
        }
        let inverse = moment.inverse();
        // Where the second row of particles is just within reach, a line through the scatter of the first would be drawn out.
        let spread = DVec3::new(moment.x_axis.x, moment.y_axis.y, moment.z_axis.z);
        let beyond = (total * middle * middle / spread).max_element() / BEYOND;
        let part = if beyond > 1.0 { 1.0 / (beyond * beyond) } else { 1.0 };
        let [vx, vy, vz, p] = with.map(|sum| part * (inverse * sum).dot(-middle));
        Some(Value { velocity: mean.velocity + DVec3::new(vx, vy, vz), pressure: mean.pressure + p + head })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn probe(flat: bool) -> Probe {
        Probe {
            spacing: 0.02,
            radius: 0.042,
            flat,
            periodic: Periodic::default(),
            room: Some([DVec3::ZERO, DVec3::splat(0.3)]),
            surface_head: 0.0,
        }
    }

    /// Water below z = 0.3 on a lattice that is shaken, with linear fields.
    fn water(flat: bool) -> Vec<(DVec3, Value)> {
        shaken_water(flat, 7)
    }

    fn shaken_water(flat: bool, seed: u32) -> Vec<(DVec3, Value)> {
        let mut out = Vec::new();
        let (l0, mut seed) = (0.02, seed);
        let mut shaken = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            0.2 * l0 * (f64::from(seed >> 8) / f64::from(1 << 24) - 0.5)
        };
        for (i, j, k) in (0..15).flat_map(|i| (0..15).flat_map(move |j| (0..15).map(move |k| (i, j, k)))) {
            if flat && j > 0 {
                continue;
            }
            let at = |n: i32| (f64::from(n) + 0.5) * l0;
            let y = if flat { 0.0 } else { at(j) + shaken() };
            let x = DVec3::new(at(i) + shaken(), y, at(k) + shaken());
            let velocity = DVec3::new(1.0 + 2.0 * x.x, 0.5, 3.0 * x.z);
            out.push((x, Value { velocity, pressure: 9810.0 * (0.3 - x.z) }));
        }
        out
    }

    #[test]
    fn linear_fields_are_read_as_they_are_also_at_walls_and_the_surface() {
        for flat in [false, true] {
            let (water, probe) = (water(flat), probe(flat));
            let y = if flat { 0.0 } else { 0.15 };
            // Inside, on a wall, in a corner, at the surface.
            for [x, z] in [[0.151, 0.147], [0.0, 0.15], [0.003, 0.004], [0.2, 0.299]] {
                let found = probe.at(water.iter().copied(), DVec3::new(x, y, z)).expect("water");
                let velocity = DVec3::new(1.0 + 2.0 * x, 0.5, 3.0 * z);
                assert!((found.velocity - velocity).abs().max_element() < 1e-5, "{x}, {z}: {found:?}");
                assert!((found.pressure - 9810.0 * (0.3 - z)).abs() < 0.02, "{x}, {z}: {found:?}");
            }
            // In the very corner.
            for seed in 1..9 {
                let found = probe.at(shaken_water(flat, seed).into_iter(), DVec3::ZERO).expect("water");
                assert!((found.pressure - 9810.0 * 0.3).abs() < 0.02, "{seed}: {found:?}");
            }
            for [x, z] in [[0.15, 0.33], [-0.03, 0.1], [5.0, 5.0]] {
                assert!(probe.at(water.iter().copied(), DVec3::new(x, y, z)).is_none(), "{x}, {z}");
            }
        }
    }

    #[test]
    fn a_lone_particle_is_its_own_mean_and_is_seen_across_a_periodic_side() {
        let (place, value) = water(false)[0];
        let found = probe(false).at([(place, value)].into_iter(), place + 0.005).expect("water");
        assert!((found.pressure - value.pressure).abs() < 1e-9);
        let periodic = Periodic::new([true, false, false], DVec3::ZERO, DVec3::ONE);
        let across = Probe { periodic, ..probe(false) };
        let beyond = place + DVec3::new(0.99, 0.0, 0.0);
        assert!(across.at([(place, value)].into_iter(), beyond).is_some());
        assert!(probe(false).at([(place, value)].into_iter(), beyond).is_none());
    }

    /// A row of particles half a spacing off a wall, the second one only just within reach of it: the scatter of the first makes no slope.
    #[test]
    fn a_single_row_at_a_wall_is_not_drawn_out() {
        let at = |k: i32| {
            let off = if k % 2 == 0 { 0.009 } else { 0.011 };
            DVec3::new(off, 0.0, 0.02 * f64::from(k))
        };
        let value =
            |k: i32| Value { pressure: if k % 2 == 0 { 1500.0 } else { 1400.0 }, velocity: DVec3::ZERO };
        let first = (0..9).map(|k| (at(k), value(k)));
        let second = (0..9).map(|k| (at(k) + DVec3::new(0.0315, 0.0, 0.0), value(k)));
        let water: Vec<_> = first.chain(second).collect();
        let found = probe(true).at(water.into_iter(), DVec3::new(0.0, 0.0, 0.08)).expect("water");
        assert!((1390.0..1510.0).contains(&found.pressure), "{found:?}");
    }

    #[test]
    fn deep_water_is_seen_from_the_corner_of_its_tank() {
        let probe = probe(true);
        // Its lowest particle has slid along the floor.
        let mut water = water(true);
        water[0].0 = DVec3::new(0.0145, 0.0, 0.0095);
        let corner = DVec3::new(0.0, 0.0, 0.0);
        assert!(probe.at(water.iter().copied(), corner).is_some());
        // Above its surface it ends as early as it did.
        assert!(probe.at(water.iter().copied(), DVec3::new(0.15, 0.0, 0.311)).is_none());
        assert!(Probe { room: None, ..probe }.at(water.iter().copied(), corner).is_none());
    }
}
