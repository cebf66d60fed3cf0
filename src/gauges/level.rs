//! Where the water's surface is on a vertical line.

use crate::fields::Fields;
use crate::periodic::Periodic;
use crate::scene::{Groups, Kind};
use glam::DVec3;

/// Part of what water at a face sums up to, down to which it goes on: particles are never quite even [-].
const FACE: f64 = 0.8;
/// Depth below the surface, over the effective radius, in which the sum of full water is looked for: one, and more where the surface is steep.
const BELOW: f64 = 1.5;
/// Part of the largest sum from which on that near the surface is the same but for its noise [-].
const SAME: f64 = 0.9;

/// Height [m] of the highest point of the vertical line through `line` that is in water; `None` if the line is
/// dry.
///
/// "In water" means that the particles within one effective radius `reach` [m], weighted by 1 - r / reach,
/// amount to half of the largest sum below the surface, so that a flat surface is found half a spacing above its
/// topmost particles, in the open as well as along a wall and in a corner; and beside a hull or a hanging gate, below
/// which the line is in the open. Spray is passed over: less than half of what a full corner would give.
pub fn level(
    fields: &Fields,
    groups: &Groups,
    line: [f64; 2],
    dimensions: u32,
    reach: f64,
    l0: f64,
    periodic: &Periodic,
) -> Option<f64> {
    let plane = dimensions == 2;
    let near: Vec<(f64, f64)> = (0..groups.fluid)
        .filter(|&i| fields.kind[i] == Kind::Fluid)
        .map(|i| fields.position[i])
        .map(|x| (periodic.nearest(DVec3::new(x.x - line[0], x.y - line[1], 0.0)), x.z))
        .map(|(way, z)| (way.x.powi(2) + if plane { 0.0 } else { way.y.powi(2) }, z))
        .filter(|&(d2, _)| d2 < reach * reach)
        .collect();
    let sum = |z: f64| -> f64 {
        near.iter().map(|&(d2, zi)| (1.0 - (d2 + (z - zi).powi(2)).sqrt() / reach).max(0.0)).sum()
    };
    let bottom = near.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
    let top = near.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max) + reach;
    if near.is_empty() {
        return None;
    }
    let step = 0.1 * l0;
    let samples: Vec<(f64, f64)> = (0..=((top - bottom) / step).ceil() as usize)
        .map(|k| top - k as f64 * step)
        .map(|z| (z, sum(z)))
        .collect();
    let full = full_sum(dimensions, reach / l0);
    let corner = if plane { 0.5 } else { 0.25 } * full;
    let most = |of: &[(f64, f64)]| of.iter().map(|s| s.1).fold(0.0, f64::max).min(full);
    let largest = most(&samples);
    let half = 0.5 * largest.max(corner);
    // At a face that ends below the surface the sum stays near half of that in the open: there the water goes on upwards.
    let goes_on = (FACE * half).max(0.5 * corner);
    let open = samples.iter().position(|s| s.1 >= half)?;
    let from = samples[..open].iter().rposition(|s| s.1 < goes_on)? + 1;
    let end = samples.len().min(from + (BELOW * reach / step) as usize);
    let near = most(&samples[from..end]);
    let threshold = if near < SAME * largest { 0.5 * near.max(corner) } else { half };
    let first = from + samples[from..].iter().position(|s| s.1 >= threshold)?;
    let below = samples[..first].iter().rposition(|s| s.1 < threshold)? + 1;
    let (z, s) = samples[below];
    // The topmost sample lies out of everybody's reach: its sum is zero.
    let (z_above, s_above) = samples[below.checked_sub(1)?];
    Some(z + (z_above - z) * (s - threshold) / (s - s_above))
}

/// Sum of 1 - r / re over the full lattice, with its centre; `radius` is re / l0.
fn full_sum(dimensions: u32, radius: f64) -> f64 {
    let m = radius.ceil() as i32;
    let mut total = 0.0;
    for x in -m..=m {
        for y in if dimensions == 2 { 0..=0 } else { -m..=m } {
            for z in -m..=m {
                total += (1.0 - f64::from(x * x + y * y + z * z).sqrt() / radius).max(0.0);
            }
        }
    }
    total
}

#[cfg(test)]
mod tests {
    use super::level;
    use crate::fields::Fields;
    use crate::scene::{Groups, Kind};
    use glam::DVec3;

    fn block(n: [i32; 3], l0: f64) -> Fields {
        let mut fields = Fields::default();
        for x in 0..n[0] {
            for y in 0..n[1] {
                for z in 0..n[2] {
                    let at = DVec3::new(f64::from(x), f64::from(y), f64::from(z)) + 0.5;
                    fields.position.push(at * l0);
                    fields.kind.push(Kind::Fluid);
                }
            }
        }
        fields
    }

    fn level_of(fields: &Fields, line: [f64; 2], l0: f64) -> Option<f64> {
        let groups = Groups { fluid: fields.kind.len(), ..Groups::default() };
        level(fields, &groups, line, 3, 2.1 * l0, l0, &Default::default())
    }

    #[test]
    fn a_flat_surface_is_found_in_the_open_and_at_a_wall() {
        let l0 = 0.01;
        let fields = block([12, 12, 8], l0);
        for line in [[0.06, 0.06], [0.063, 0.058], [0.0, 0.06], [0.0, 0.0]] {
            let z = level_of(&fields, line, l0).unwrap();
            assert!((z - 8.0 * l0).abs() < 0.15 * l0, "{line:?}: {z}");
        }
        assert!(level_of(&fields, [0.5, 0.06], l0).is_none());
    }

    #[test]
    fn beside_a_hull_or_a_gate_the_surface_is_found_as_far_from_it() {
        let l0 = 0.01;
        // Its foot 14 spacings below the surface, its face at x = 0.06 m; of a gate two spacings thick there is water behind it.
        for (behind, turned) in [(false, false), (true, false), (false, true), (true, true)] {
            let mut fields = block([12, 12, 24], l0);
            let is_free = |x: &DVec3| {
                let along = if turned { x.y } else { x.x };
                x.z < 0.1 || along < 0.06 || behind && along > 0.08
            };
            fields.position.retain(is_free);
            // Particles are never quite even.
            for (k, x) in fields.position.iter_mut().enumerate() {
                let shake = |a: f64| 0.2 * l0 * ((a * k as f64).fract() - 0.5);
                *x += DVec3::new(shake(0.618), shake(0.755), shake(0.57));
            }
            fields.kind.truncate(fields.position.len());
            for off in [0.0, 0.0002, 0.001, 0.0025, 0.005, 0.01, 0.03] {
                let line = if turned { [0.055, 0.06 - off] } else { [0.06 - off, 0.055] };
                let z = level_of(&fields, line, l0).unwrap();
                assert!((z - 0.24).abs() < 0.25 * l0, "{behind} {turned} {off}: {z}");
            }
        }
    }

    #[test]
    fn spray_above_the_surface_is_passed_over_and_ghosts_are_not_seen() {
        let l0 = 0.01;
        let mut fields = block([12, 12, 8], l0);
        for (z, kind) in [
            (0.3, Kind::Fluid),
            (0.31, Kind::Fluid),
            (0.125, Kind::Fluid),
            (0.115, Kind::Fluid),
            (0.101, Kind::Ghost),
            (0.111, Kind::Ghost),
        ] {
            fields.position.push(DVec3::new(0.06, 0.06, z));
            fields.kind.push(kind);
        }
        let z = level_of(&fields, [0.06, 0.06], l0).unwrap();
        assert!((z - 8.0 * l0).abs() < 0.15 * l0, "{z}");
    }
}
