//! The weight function and its sums over the initial lattice: Eqs. (3), (4) and (7).

/// Weight function, Eq. (3), for `0 < r < re` [-].
#[inline(always)]
pub fn weight(r: f64, re: f64) -> f64 {
    re / r - 1.0
}

/// r / re of a pair of weight `w`, Eq. (3) [-].
#[inline(always)]
pub(crate) fn reach(w: f64) -> f64 {
    1.0 / (1.0 + w)
}

/// Weight W of the smooth density sum, (1 - q)^3 (1 + 3 q - 3 q^2) at `q` = r / re [-]. Of (1 - q)^3 (1 + 3 q - 4 a q^2),
/// which is Wendland's C2 of one dimension for a = 0 and of two and three for a = 1, a = 3/4 keeps its sum best on
/// stretched and on other lattices of the same volume.
#[inline(always)]
pub(crate) fn smooth_weight(q: f64) -> f64 {
    let rest = (1.0 - q).max(0.0);
    rest * rest * rest * (1.0 + 3.0 * q - 3.0 * q * q)
}

/// Sums over the full cubic (or square) lattice around one particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Initial number density n0, Eq. (4) [-]; the largest n_i of a full lattice.
    pub number_density: f64,
    /// Laplacian correction lambda, Eq. (7), over l0^2 [-].
    pub laplacian: f64,
    /// Sum W0 of `smooth_weight`, the particle itself among them [-].
    pub smooth_density: f64,
    /// Neighbours closer than the effective radius.
    pub neighbours: u32,
    /// Part of the number density that a flat wall's layer has for the particles next to it [-].
    pub wall_share: f64,
    /// Weight of a pair of fluid and wall in the viscous sum [-], see [`Self::new`].
    pub wall_shear: f64,
    /// Sum of the weights of a particle of a flat wall's layer with the water above [-].
    pub wall_contact: f64,
}

impl Lattice {
    /// Sums for an effective radius of `radius` spacings in `dimensions` dimensions.
    ///
    /// `wall_shear` lets the water next to a flat wall feel no force in a linear shear flow that is at rest on the
    /// wall's surface. The wall layer stands half a spacing behind it with the wall's velocity, so that a pair with
    /// it has half the difference that a pair on the other side has, and there are no deeper layers to pair with:
    /// 2 sum_(z > 0) w z / sum_(z = l0) w z, about 2.1 in the plane and 2.05 in space.
    pub fn new(dimensions: u32, radius: f64) -> Self {
        let m = radius.ceil() as i32;
        let (mut n, mut s, mut smooth, mut count) = (0.0, 0.0, smooth_weight(0.0), 0);
        let (mut layer, mut above, mut contact) = (0.0, 0.0, 0.0);
        for x in -m..=m {
            for y in if dimensions == 3 { -m..=m } else { 0..=0 } {
                for z in -m..=m {
                    let r2 = f64::from(x * x + y * y + z * z);
                    if r2 > 0.0 && r2 < radius * radius {
                        let w = weight(r2.sqrt(), radius);
                        n += w;
                        layer += if z == 1 { w } else { 0.0 };
                        above += if z > 0 { w * f64::from(z) } else { 0.0 };
                        contact += if z > 0 { w } else { 0.0 };
                        s += r2 * w;
                        smooth += smooth_weight(r2.sqrt() / radius);
                        count += 1;
                    }
                }
            }
        }
        Self {
            number_density: n,
            laplacian: s / n,
            smooth_density: smooth,
            neighbours: count,
            wall_share: layer / n,
            wall_shear: 2.0 * above / layer,
            wall_contact: contact,
        }
    }
}

/// Largest eigenvalue of the Laplacian's matrix over its diagonal, as measured (1.30 to 1.33).
pub(crate) const LAPLACIAN_EIGENVALUE: f64 = 1.33;

impl Lattice {
    /// Largest nu dt / l0^2 at which explicit viscosity in `dimensions` dimensions damps instead of growing [-]:
    /// 2 over the largest eigenvalue of Eq. (6), with its diagonal 2 d / lambda. Pairs with walls weigh `wall_shear`,
    /// most in a corner of d walls.
    pub fn viscous_limit(&self, dimensions: u32, wall_shear: f64) -> f64 {
        let d = f64::from(dimensions);
        let walls = d * self.wall_share * (wall_shear - LAPLACIAN_EIGENVALUE).max(0.0);
        self.laplacian / ((LAPLACIAN_EIGENVALUE + walls) * d)
    }
}
