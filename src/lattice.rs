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

/// Weight W of the smooth density sum, (1 - q)^3 (1 + 3 q - 2.6 q^2) at `q` = r / re [-]. Of (1 - q)^3 (1 + 3 q - 4 a q^2),
/// which is Wendland's C2 of one dimension for a = 0 and of two and three for a = 1, a = 0.65 keeps its sum well on
/// stretched, on melted and on other lattices of the same volume: what it rises there swells the water.
#[inline(always)]
pub(crate) fn smooth_weight(q: f64) -> f64 {
    let rest = (1.0 - q).max(0.0);
    rest * rest * rest * (1.0 + 3.0 * q - 2.6 * q * q)
}

/// Weight of neighbours in the direction of a boundary and in the velocity past it, (1 - q)^4 (1 + q) at `q` = r / re
/// [-]. What slides along a flat wall sees its direction turn from particle to particle of the wall: with this weight by
/// 0.003 at most between 0.4 and 0.7 spacings from its surface, with that of Eq. (3) over r^2 by 0.03 to 0.04.
#[inline(always)]
pub(crate) fn boundary_weight(q: f64) -> f64 {
    let square = (1.0 - q) * (1.0 - q);
    square * square * (1.0 + q)
}

/// Weight of a pair in explicit viscosity of the accurate scheme, 1 / q - 1 + 32 (1 - q)^4 at `q` = r / re [-]: that of Eq. (3) and
/// a part that makes sum w r r^T keep to the lattice's on other arrangements. On water that has melted its trace is within
/// 0.5 % (1.2 to 6 % too much with Eq. (3) alone), in rows that slide past each other the part across them is 1.0 to 1.4 % too little
/// (1.3 to 2.2 %).
#[inline(always)]
pub(crate) fn viscous_weight(q: f64) -> f64 {
    let rest = 1.0 - q;
    let square = rest * rest;
    rest / q + 32.0 * square * square
}

/// Sums over the lattice of a weight of explicit viscosity.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Shear {
    /// Sum w [-].
    pub sum: f64,
    /// Sum w r^2 over l0^2 [-]; lambda n0 of Eq. (6) with the weight of Eq. (3).
    pub moment: f64,
    /// Weight of a pair of fluid and wall over that of others [-], see [`Self::smooth`].
    pub wall: f64,
    /// Largest nu dt / l0^2 at which explicit viscosity damps instead of growing, pairs with walls included, most in a corner of d walls [-].
    pub limit: f64,
}

impl Shear {
    /// Of Eq. (3)'s weight, with walls as one more layer of water: the paper's scheme. `radius` is re / l0.
    pub fn paper(dimensions: u32, radius: f64) -> Self {
        Self::of(dimensions, radius, |r2| weight(r2.sqrt(), radius), false, LAPLACIAN_EIGENVALUE)
    }

    /// Of `viscous_weight`, the accurate scheme's.
    ///
    /// `wall` lets the water next to a flat wall feel no force in a linear shear flow that is at rest on the
    /// wall's surface. The wall layer stands half a spacing behind it with the wall's velocity, so that a pair with
    /// it has half the difference that a pair on the other side has, and there are no deeper layers to pair with:
    /// 2 sum_(z > 0) w z / sum_(z = l0) w z, about 2.04 in the plane and 2.03 in space.
    pub fn smooth(dimensions: u32, radius: f64) -> Self {
        let weight = |r2: f64| viscous_weight(r2.sqrt() / radius);
        let eigenvalue = if dimensions == 2 { SMOOTH_EIGENVALUE[0] } else { SMOOTH_EIGENVALUE[1] };
        Self::of(dimensions, radius, weight, true, eigenvalue)
    }

    /// `eigenvalue` is the largest of the operator over its diagonal on the lattice.
    fn of(dimensions: u32, radius: f64, w: impl Fn(f64) -> f64, surface: bool, eigenvalue: f64) -> Self {
        let (mut sum, mut moment, mut layer, mut above) = (0.0, 0.0, 0.0, 0.0);
        for (r2, z) in around(dimensions, radius) {
            let w = w(r2);
            sum += w;
            moment += r2 * w;
            layer += if z == 1 { w } else { 0.0 };
            above += if z > 0 { w * f64::from(z) } else { 0.0 };
        }
        let wall = if surface { 2.0 * above / layer } else { 1.0 };
        // The diagonal is 2 d sum w / moment.
        let d = f64::from(dimensions);
        let walls = d * layer / sum * (wall - eigenvalue).max(0.0);
        Self { sum, moment, wall, limit: moment / sum / ((eigenvalue + walls) * d) }
    }
}

/// Largest eigenvalue of the Laplacian's matrix over its diagonal, as measured (1.30 to 1.33).
const LAPLACIAN_EIGENVALUE: f64 = 1.33;
/// The same of `viscous_weight` in the plane and in space, over the diagonal of the lattice: 1.6 and 1.4 there, 1.67 to 1.80 and 1.38
/// to 1.42 as measured once it has melted.
const SMOOTH_EIGENVALUE: [f64; 2] = [1.8, 1.42];

/// Neighbours of a lattice particle within `radius` spacings: their distance squared and their height, over l0.
fn around(dimensions: u32, radius: f64) -> impl Iterator<Item = (f64, i32)> {
    let m = radius.ceil() as i32;
    let depth = if dimensions == 3 { m } else { 0 };
    let all =
        (-m..=m).flat_map(move |x| (-depth..=depth).flat_map(move |y| (-m..=m).map(move |z| (x, y, z))));
    all.map(|(x, y, z)| (f64::from(x * x + y * y + z * z), z))
        .filter(move |&(r2, _)| r2 > 0.0 && r2 < radius * radius)
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
    /// Sum of the weights of a particle of a flat wall's layer with the water above [-].
    pub wall_contact: f64,
    /// Sum of `smooth_weight` of a particle of a flat wall's layer with the water above [-].
    pub wall_room: f64,
    /// How deep the middle of the wall, with `boundary_weight`, lies below a particle of a flat wall's layer, over l0 [-].
    pub wall_depth: f64,
}

impl Lattice {
    /// Sums for an effective radius of `radius` spacings in `dimensions` dimensions.
    pub fn new(dimensions: u32, radius: f64) -> Self {
        let (mut n, mut s, mut smooth, mut count) = (0.0, 0.0, smooth_weight(0.0), 0);
        let (mut contact, mut room, mut depth, mut wall) = (0.0, 0.0, 0.0, 0.0);
        for (r2, z) in around(dimensions, radius) {
            let (w, even) = (weight(r2.sqrt(), radius), smooth_weight(r2.sqrt() / radius));
            n += w;
            s += r2 * w;
            smooth += even;
            if z > 0 {
                contact += w;
                room += even;
            } else {
                let weight = boundary_weight(r2.sqrt() / radius);
                wall += weight;
                depth -= weight * f64::from(z);
            }
            count += 1;
        }
        Self {
            number_density: n,
            laplacian: s / n,
            smooth_density: smooth,
            neighbours: count,
            wall_contact: contact,
            wall_room: room,
            wall_depth: depth / wall,
        }
    }
}
