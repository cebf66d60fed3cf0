//! Which cells of the lattice a shape off it displaces: as many as its volume, the deepest ones, and of those equally deep a choice that is spread
//! evenly and has the symmetries of the shape. A cube half a spacing off the lattice has its faces through the middles of cells: what is
//! taken on its left and not on its right turns it.

use super::lattice::Lattice;
use super::oriented::Placed;
use glam::{DVec3, IVec3};
use rayon::prelude::*;

/// What of a cell a shape displaces.
#[derive(Clone, Copy)]
pub(super) struct Cut {
    /// Signed distance of the cell's centre, in whole percents of l0.
    off: i64,
    /// Its place among those as deep, see [`even`]: the same for the cells to which exchanging and mirroring the shape's axes leads, for those of
    /// mirroring alone, and for those of these on the same side of its centre, upper or lower.
    place: [u64; 3],
    /// The part of it [-].
    share: f64,
}

impl Cut {
    /// What of the cell `c` the `shape` displaces, of water that lies `within` another if it is told. `None` if that is nothing.
    pub fn of(shape: &Placed, within: Option<&Placed>, c: IVec3, lattice: &Lattice) -> Option<Self> {
        let l0 = lattice.spacing;
        let x = lattice.center(c);
        let off = shape.distance(x) / l0;
        // In whole spacings from the shape's centre or from half-way between, whichever is there on the lattice.
        let apart = (2.0 * (shape.axes.transpose() * (x - shape.center) / l0).abs()).round() / 2.0;
        let mirrored = apart.floor().as_ivec3();
        let mut exchanged = mirrored.to_array();
        exchanged.sort_unstable();
        let side = IVec3::Z * i32::from(x.z > shape.center.z + 1e-6 * l0);
        let place = [even(exchanged.into()), even(mirrored), even(mirrored * IVec3::new(1, 1, 2) + side)];
        let share = share(shape, within, (x, off), lattice);
        (share > 1e-6).then(|| Self { off: (100.0 * off).round() as i64, place, share })
    }
}

/// The part of the cell about `x`, whose signed distance over l0 is `off`, that lies in the `shape` [-]. Each of its halves along each axis is cut as if by a plane:
/// one that a corner or an edge reaches into would count as cut in half by a plane through its middle. Of water `within` a shape only what lies in that shape,
/// too: a vessel of the very size of its water takes nothing.
fn share(shape: &Placed, within: Option<&Placed>, (x, off): (DVec3, f64), lattice: &Lattice) -> f64 {
    let half = 0.5 * lattice.spacing;
    let ends = if lattice.plane { [DVec3::X, DVec3::Z].as_slice() } else { DVec3::AXES.as_slice() };
    let reach = 0.5 * (ends.len() as f64).sqrt();
    let whole = within.is_none_or(|within| within.distance(x) / lattice.spacing <= -reach);
    if off >= reach || off <= -reach && whole {
        return f64::from(u8::from(off < 0.0));
    }
    let mut parts = vec![x];
    for e in ends {
        parts = parts.into_iter().flat_map(|x| [x - 0.5 * half * e, x + 0.5 * half * e]).collect();
    }
    let inside = |shape: &Placed, x: DVec3| (0.5 - shape.distance(x) / half).clamp(0.0, 1.0);
    // The surfaces of the two look at each other where one ends at the other.
    let of = |&x: &DVec3| (inside(shape, x) + within.map_or(1.0, |within| inside(within, x)) - 1.0).max(0.0);
    parts.iter().map(of).sum::<f64>() / parts.len() as f64
}

/// The deepest of what is cut, as many as its parts come to, but for what would be part of a set of mirrored cells.
fn deepest<T>(mut cut: Vec<(Cut, T)>) -> Vec<T> {
    let displaced: f64 = cut.iter().map(|(cut, _)| cut.share).sum();
    cut.sort_by_key(|(cut, _)| (cut.off, cut.place));
    let mut left = displaced.round() as usize;
    let mut taken = vec![];
    for level in cut.chunk_by(|a, b| a.0.off == b.0.off) {
        let places: Vec<[u64; 3]> = level.iter().map(|(cut, _)| cut.place).collect();
        choose(&places, 0, &mut left, &mut taken);
    }
    cut.into_iter().zip(taken).filter(|(_, taken)| *taken).map(|((_, of), _)| of).collect()
}

/// Says of the sorted `places` of cells equally deep which are `taken`, of which `left` are to be: sets of those whose place number `set` is the same as
/// wholes, and smaller sets where none fits.
fn choose(places: &[[u64; 3]], set: usize, left: &mut usize, taken: &mut Vec<bool>) {
    let first = taken.len();
    let mut open = vec![];
    for group in places.chunk_by(|a, b| a[set] == b[set]) {
        let fits = group.len() <= *left;
        if fits {
            *left -= group.len();
        } else {
            open.push((taken.len() - first, group));
        }
        taken.extend(std::iter::repeat_n(fits, group.len()));
    }
    if set + 1 == 3 {
        return;
    }
    for (at, group) in open {
        let mut own = vec![];
        choose(group, set + 1, left, &mut own);
        taken[first + at..][..own.len()].copy_from_slice(&own);
    }
}

/// [`deepest`] of what is [`Cut`] by `shape` at the places `at`, at its sealed cavities and elsewhere each on its own: what stands in a cavity may
/// be taken out of it, and may not count for what stands outside.
pub(super) fn deepest_on_each_side<T: Send>(
    shape: &Placed,
    cut: impl ParallelIterator<Item = (Cut, T)>,
    at: impl Fn(&T) -> DVec3 + Sync,
) -> Vec<T> {
    if !shape.has_cavities() {
        return deepest(cut.collect());
    }
    let (within, around): (Vec<_>, Vec<_>) = cut.partition(|(_, of)| shape.in_cavity(at(of)));
    [within, around].into_iter().flat_map(deepest).collect()
}

/// An order of cells, any part of which is spread evenly: the fractional part of a plane's multiples that no lattice repeats (Roberts 2018).
fn even(c: IVec3) -> u64 {
    const BY: [u64; 3] = [0xd1b5_4a32_d192_ed03, 0xabc9_8388_fb8f_ac03, 0x8cb9_2ba7_2f3d_8dd7];
    c.to_array()
        .into_iter()
        .zip(BY)
        .fold(0, |sum, (k, by)| sum.wrapping_add((i64::from(k) as u64).wrapping_mul(by)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_sets_are_taken_where_they_fit() {
        // Sets of 8, 4 and 4 of pairs: what is less than a pair is left.
        let places: Vec<[u64; 3]> =
            (0..16).map(|k| [[1, 1, 2, 3][k / 4] as u64, (k / 4) as u64, (k / 2) as u64]).collect();
        let cases = [
            (8, [8, 0, 0]),
            (12, [8, 4, 0]),
            (4, [0, 4, 0]),
            (9, [8, 0, 0]),
            (10, [8, 2, 0]),
            (6, [2, 4, 0]),
        ];
        for (many, expected) in cases {
            let (mut left, mut taken) = (many, vec![]);
            choose(&places, 0, &mut left, &mut taken);
            let of = |set: u64| places.iter().zip(&taken).filter(|(p, taken)| p[0] == set && **taken).count();
            assert_eq!([1, 2, 3].map(of), expected, "{many}: {taken:?}");
        }
    }
}
