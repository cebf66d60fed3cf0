//! The weight function and its sums over the initial lattice: Eqs. (3), (4) and (7).

/// Weight function, Eq. (3), for `0 < r < re` [-].
#[inline(always)]
pub fn weight(r: f64, re: f64) -> f64 {
    re / r - 1.0
}

/// Sums over the full cubic (or square) lattice around one particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Initial number density n0, Eq. (4) [-]; the largest n_i of a full lattice.
    pub number_density: f64,
    /// Laplacian correction lambda, Eq. (7), over l0^2 [-].
    pub laplacian: f64,
    /// Neighbours closer than the effective radius.
    pub neighbours: u32,
}

impl Lattice {
    /// Sums for an effective radius of `radius` spacings in `dimensions` dimensions.
    pub fn new(dimensions: u32, radius: f64) -> Self {
        let m = radius.ceil() as i32;
        let (mut n, mut s, mut count) = (0.0, 0.0, 0);
        for x in -m..=m {
            for y in if dimensions == 3 { -m..=m } else { 0..=0 } {
                for z in -m..=m {
                    let r2 = f64::from(x * x + y * y + z * z);
                    if r2 > 0.0 && r2 < radius * radius {
                        let w = weight(r2.sqrt(), radius);
                        n += w;
                        s += r2 * w;
                        count += 1;
                    }
                }
            }
        }
        Self { number_density: n, laplacian: s / n, neighbours: count }
    }
}

/// Largest eigenvalue of the Laplacian's matrix over its diagonal, as measured (1.30 to 1.33).
pub const LAPLACIAN_EIGENVALUE: f64 = 1.33;

impl Lattice {
    /// Largest nu dt / l0^2 at which explicit viscosity in `dimensions` dimensions damps instead of growing [-]:
    /// 2 over the largest eigenvalue of Eq. (6), with its diagonal 2 d / lambda.
    pub fn viscous_limit(&self, dimensions: u32) -> f64 {
        self.laplacian / (LAPLACIAN_EIGENVALUE * f64::from(dimensions))
    }
}
