//! Levels of the multigrid preconditioner. Level 0 joins the unknowns of a background cell (one effective
//! radius wide), each further level 2 x 2 x 2 cells of the last; the operators are Galerkin products with
//! piecewise constant interpolation, so every one is a stencil of 27 entries.
//! GPU twin: shaders/multigrid_levels.wgsl

/// Cells of a level from which on it is the coarsest.
pub const COARSEST: u64 = 32;
/// Levels at most.
pub const LEVELS_MAX: usize = 16;

/// Cells along x, y, z of each level over a grid of `count` cells, finest first.
pub fn level_cells(count: [u32; 3]) -> Vec<[u32; 3]> {
    let mut levels = vec![count];
    let mut last = count;
    while last.iter().map(|&n| u64::from(n)).product::<u64>() > COARSEST && levels.len() < LEVELS_MAX {
        last = last.map(|n| n.div_ceil(2));
        levels.push(last);
    }
    levels
}

/// What tells two operators of a level apart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LevelSums {
    /// Rows.
    pub rows: usize,
    /// Sum of the diagonal.
    pub diagonal: f64,
    /// Sum of all entries, the same on every level.
    pub entries: f64,
    /// Sum of their squares.
    pub squares: f64,
}

impl LevelSums {
    /// Take in an entry of a row.
    pub fn add(&mut self, value: f64, is_diagonal: bool) {
        self.diagonal += if is_diagonal { value } else { 0.0 };
        self.entries += value;
        self.squares += value * value;
    }
}

/// 9 x + 3 y + z: the difference of two neighbouring cells' is an entry of the stencil, less 13.
#[inline(always)]
pub fn place_of([x, y, z]: [i32; 3]) -> i32 {
    9 * x + 3 * y + z
}

/// The step from the cell at `from` to its neighbour at `to`. Along a periodic axis of `around` cells, 0 where it is none,
/// the last is the neighbour of the first.
#[inline(always)]
pub fn step(from: [i32; 3], to: [i32; 3], around: [i32; 3]) -> [i32; 3] {
    std::array::from_fn(|k| {
        let step = to[k] - from[k];
        if around[k] > 0 && step.abs() > 1 { step - step.signum() * around[k] } else { step }
    })
}

/// Offset in x, y, z of the `k`-th entry of a stencil.
#[inline(always)]
pub fn offset_of(k: usize) -> [i32; 3] {
    [k as i32 / 9 - 1, k as i32 / 3 % 3 - 1, k as i32 % 3 - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_and_offsets_belong_together() {
        assert!((0..27).all(|k| place_of(offset_of(k)) + 13 == k as i32));
        assert_eq!(offset_of(13), [0; 3]);
    }

    #[test]
    fn the_last_cell_is_next_to_the_first_along_a_periodic_axis_alone() {
        assert_eq!(step([0, 0, 4], [4, 4, 0], [5, 0, 5]), [-1, 4, 1]);
        // Of two cells, one is the neighbour of the other at both sides.
        assert_eq!(step([0, 2, 1], [1, 0, 0], [2, 3, 2]), [1, 1, -1]);
    }

    #[test]
    fn levels_halve_until_few_cells_are_left() {
        assert_eq!(level_cells([9, 4, 3]), [[9, 4, 3], [5, 2, 2]]);
        assert_eq!(level_cells([1, 1, 1]), [[1; 3]]);
        assert_eq!(level_cells([u32::MAX, 1, 1]).len(), LEVELS_MAX);
    }
}
