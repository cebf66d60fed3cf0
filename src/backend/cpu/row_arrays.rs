//! Rows of neighbours laid out by component, so that sums over them take several neighbours at a time.
//!
//! Arrays are filled up with zeros to whole [`LANES`]; sums run over that many partial sums side by side, on every
//! machine, so that results do not depend on its vectors.

use crate::neighbourhood::Particles;
use crate::neighbours::CAPACITY;
use crate::periodic::Periodic;
use bytemuck::Zeroable;
use glam::DVec3;
use std::cell::RefCell;

/// Partial sums of a sum.
pub(crate) const LANES: usize = 8;

/// Longest row: as many neighbours that carry pressure as fit, as many dummies, and the filling.
pub(crate) const LONGEST: usize = 2 * CAPACITY + LANES;

/// A number for each neighbour.
pub type Column = [f64; LONGEST];

/// A vector for each neighbour.
#[derive(Clone, Copy, Debug, Zeroable)]
pub struct Columns {
    /// Components along x.
    pub x: Column,
    /// Components along y.
    pub y: Column,
    /// Components along z.
    pub z: Column,
}

impl Columns {
    /// Vector of neighbour `k`.
    #[inline(always)]
    pub fn at(&self, k: usize) -> DVec3 {
        DVec3::new(self.x[k], self.y[k], self.z[k])
    }

    /// f_j - f_i of `field` for each neighbour j; returns the length with the filling.
    #[inline(always)]
    pub fn differences(&mut self, i: usize, neighbour: &[u32], field: &[DVec3]) -> usize {
        let (n, own) = (neighbour.len(), field[i]);
        let filled = n.next_multiple_of(LANES);
        let (x, y, z) = (&mut self.x[..filled], &mut self.y[..filled], &mut self.z[..filled]);
        for (k, &j) in neighbour.iter().enumerate() {
            let d = field[j as usize] - own;
            (x[k], y[k], z[k]) = (d.x, d.y, d.z);
        }
        for v in [x, y, z] {
            v[n..].fill(0.0);
        }
        filled
    }

    /// r_j - r_i of each neighbour j, to its nearest image where sides are periodic; returns the length with the filling.
    #[inline(always)]
    pub fn offsets(&mut self, i: usize, neighbour: &[u32], on: Particles) -> usize {
        let filled = self.differences(i, neighbour, on.position);
        if on.params.periodic.is_any() {
            self.bring_near(neighbour.len(), &on.params.periodic);
        }
        filled
    }

    /// The first `n` ways become those to the nearest images. Out of line: rows of other scenes do without its code.
    #[inline(never)]
    fn bring_near(&mut self, n: usize, periodic: &Periodic) {
        for k in 0..n {
            let r = periodic.nearest(self.at(k));
            (self.x[k], self.y[k], self.z[k]) = (r.x, r.y, r.z);
        }
    }

    /// out_k <- f(|v_k|^2).
    #[inline(always)]
    pub(crate) fn map_squares(&self, out: &mut [f64], f: impl Fn(f64) -> f64) {
        let n = out.len();
        let (x, y, z) = (&self.x[..n], &self.y[..n], &self.z[..n]);
        for k in 0..n {
            out[k] = f(x[k] * x[k] + y[k] * y[k] + z[k] * z[k]);
        }
    }

    /// sum w_k v_k.
    #[inline(always)]
    pub(crate) fn weighted_sum(&self, w: &[f64]) -> DVec3 {
        DVec3::new(dot(w, &self.x), dot(w, &self.y), dot(w, &self.z))
    }
}

/// Room for the rows of one thread: 97 KiB, too much for the stack of a thread of the pool, which holds as many pieces
/// of work begun as it waits for.
#[derive(Clone, Debug, Zeroable)]
pub struct RowArrays {
    /// r_j - r_i.
    pub r: Columns,
    /// Another vector of each neighbour.
    pub v: Columns,
    /// A third one.
    pub e: Columns,
    /// A number for each neighbour, mostly the weight.
    pub w: Column,
    /// Another number.
    pub s: Column,
    /// A third one.
    pub h: Column,
}

thread_local! {
    static ARRAYS: RefCell<Box<RowArrays>> = RefCell::new(bytemuck::zeroed_box());
}

impl RowArrays {
    /// What `f` makes with the arrays of this thread. They hold what the last row has left in them; `f` hands no work to
    /// other threads.
    pub fn with<R>(f: impl FnOnce(&mut Self) -> R) -> R {
        ARRAYS.with_borrow_mut(|arrays| f(arrays))
    }
}

/// sum a_k.
#[inline(always)]
pub fn sum(a: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let blocks = a.chunks_exact(LANES);
    let rest: f64 = blocks.remainder().iter().sum();
    for a in blocks {
        for k in 0..LANES {
            lanes[k] += a[k];
        }
    }
    total(lanes) + rest
}

/// The smallest a_k; the length is a multiple of [`LANES`].
#[inline(always)]
pub fn least(a: &[f64]) -> f64 {
    let mut lanes = [f64::INFINITY; LANES];
    for a in a.chunks_exact(LANES) {
        for k in 0..LANES {
            // A comparison is one instruction; `f64::min` minds what is not a number.
            lanes[k] = if a[k] < lanes[k] { a[k] } else { lanes[k] };
        }
    }
    lanes.into_iter().fold(f64::INFINITY, f64::min)
}

/// sum a_k b_k over the length of `a`, a multiple of [`LANES`].
#[inline(always)]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for k in 0..LANES {
            lanes[k] += a[k] * b[k];
        }
    }
    total(lanes)
}

#[inline(always)]
fn total(l: [f64; LANES]) -> f64 {
    ((l[0] + l[4]) + (l[1] + l[5])) + ((l[2] + l[6]) + (l[3] + l[7]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_over_rows_of_any_length_are_the_plain_ones() {
        let field: Vec<DVec3> = (0..60)
            .map(|k| DVec3::new(0.1 * f64::from(k), f64::from(k % 7), -1.0 / f64::from(k + 1)))
            .collect();
        let mut arrays: Box<RowArrays> = bytemuck::zeroed_box();
        for n in (0..50).rev() {
            let row: Vec<u32> = (0..n).map(|k| (3 * k + 1) % 60).collect();
            let filled = arrays.r.differences(5, &row, &field);
            assert!(filled >= row.len() && filled.is_multiple_of(LANES));
            let plain: DVec3 = row.iter().map(|&j| field[j as usize] - field[5]).sum();
            let got = arrays.r.weighted_sum(&[1.0; LONGEST][..filled]);
            assert!((got - plain).length() < 1e-12, "{n}: {got} for {plain}");
            arrays.r.map_squares(&mut arrays.s[..row.len()], |r2| r2);
            let squares: f64 = row.iter().map(|&j| field[j as usize].distance_squared(field[5])).sum();
            assert!((sum(&arrays.s[..row.len()]) - squares).abs() < 1e-10 * (1.0 + squares));
        }
    }
}
