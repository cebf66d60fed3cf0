//! Water particles off their lattice at t = 0: starts that differ in nothing but chance, for means and spreads of
//! flows that are chaotic.

use crate::chance::mixed;
use glam::{DVec3, IVec3};

/// Displacement of the particle of cell `c`: each coordinate uniform in -`most`..`most`. It depends on the cell and
/// the seed alone, not on how many particles there are.
pub(super) fn jitter(c: IVec3, seed: u32, most: f64) -> DVec3 {
    let mut state = mixed(u64::from(seed));
    for k in c.to_array() {
        state = mixed(state ^ u64::from(k as u32));
    }
    DVec3::from_array(std::array::from_fn(|axis| {
        let bits = mixed(state.wrapping_add(axis as u64)) >> 11;
        most * (2.0 * bits as f64 / (1_u64 << 53) as f64 - 1.0)
    }))
}

#[cfg(test)]
mod tests {
    use super::jitter;
    use glam::{DVec3, IVec3};

    #[test]
    fn it_is_even_bounded_and_another_one_for_another_seed() {
        let cells = || (0..1000).map(|k| IVec3::new(k % 10, k / 10 % 10, k / 100));
        let of = |seed| cells().map(|c| jitter(c, seed, 0.1)).collect::<Vec<_>>();
        let one = of(1);
        assert_eq!(one, of(1));
        assert!(one.iter().zip(of(2)).all(|(a, b)| *a != b));
        assert!(one.iter().all(|d| d.abs().max_element() <= 0.1));
        // Uniform: mean 0 +- 0.1 / sqrt(3 * 1000), mean square 0.1^2 / 3.
        let mean = one.iter().sum::<DVec3>() / 1000.0;
        assert!(mean.abs().max_element() < 4.0 * 0.1 / 3000_f64.sqrt(), "{mean}");
        let square = one.iter().map(|d| d.length_squared()).sum::<f64>() / 3000.0;
        assert!((square / (0.01 / 3.0) - 1.0).abs() < 0.1, "{square}");
    }
}
