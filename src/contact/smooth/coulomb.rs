//! The Coulomb field of a patch: the impulse that slows or stops a slip of two velocities and a spin.
//!
//! D and its gradient are sums over nodes of the pressure (see [`super::friction`]).

use glam::{DMat2, DMat3, DVec2, DVec3};
use std::sync::LazyLock;

/// Rings of nodes of a pressure of unit second moments: radius, weight, nodes, first of them in nodes from the axis.
/// Mean square of the distance 2, mean 1.3254, mean reciprocal 1.0177, as an even square has.
const RINGS: [(f64, f64, usize, f64); 2] =
    [(0.436_250_78, 0.235_341_38, 8, 0.0), (1.599_053_63, 0.764_658_62, 12, 0.5)];

/// Nodes of [`RINGS`], and how many of them are summed side by side.
const COUNT: usize = 20;
const LANES: usize = 4;

/// Places and weights of the nodes.
static NODES: LazyLock<[(DVec2, f64); COUNT]> = LazyLock::new(|| {
    let of = |(radius, weight, count, first): (f64, f64, usize, f64)| {
        (0..count).map(move |k| {
            let turn = std::f64::consts::TAU * (k as f64 + first) / count as f64;
            (radius * DVec2::from_angle(turn), weight / count as f64)
        })
    };
    let mut nodes = RINGS.into_iter().flat_map(of);
    std::array::from_fn(|_| nodes.next().unwrap_or_default())
});

/// Arm of the spin over the root of the trace of the second moments: not above the mean distance of any pressure.
pub(super) const ARM: f64 = 0.82;

/// The least dissipation of the nodes over that of an ellipsoid through an impulse of `cap` along each of a patch's three
/// slips, of any second moments (0.884, of a line): what lies within sticks.
const STICKS: f64 = 0.88;

/// Slip over the largest that a patch can stop below which a node counts as at rest.
const AT_REST: f64 = 1e-6;

/// Whether a patch, an area or a point, of at most `cap` [N s] takes the impulse that `stops` it [N s] without slipping.
pub(super) fn sticks(stops: DVec3, cap: f64, area: bool) -> bool {
    match area {
        true => {
            let ellipsoid = stops.length_squared() <= (STICKS * cap).powi(2);
            ellipsoid || DVec2::new(stops.x, stops.y).length() + stops.z.abs() <= cap
        }
        false => stops.length_squared() <= cap * cap,
    }
}

/// Root of the symmetric matrix (xx, xy; xy, yy) of second moments [m2]; `None` if it is nothing.
pub(super) fn root_of(xx: f64, xy: f64, yy: f64) -> Option<DMat2> {
    let root = (xx * yy - xy * xy).max(0.0).sqrt();
    let scale = (xx + yy + 2.0 * root).sqrt();
    let of = DMat2::from_cols(DVec2::new(xx + root, xy), DVec2::new(xy, yy + root));
    (scale > 1e-150).then(|| of * (1.0 / scale))
}

/// The nodes of a patch.
struct Nodes {
    x: [f64; COUNT],
    y: [f64; COUNT],
    weight: [f64; COUNT],
}

impl Nodes {
    fn new(spread: DMat2) -> Self {
        let places = NODES.map(|(node, _)| spread * node);
        Self { x: places.map(|p| p.x), y: places.map(|p| p.y), weight: NODES.map(|n| n.1) }
    }

    /// Gradient [N s] and second derivative of the dissipation at the slip `u` [m/s], of nodes that count as at rest
    /// below `rest` [m/s].
    #[allow(clippy::needless_range_loop)] // one lane of nine sums, not one sum
    fn dissipation(&self, u: DVec3, cap: f64, rest: f64) -> (DVec3, DMat3) {
        // lanes of their own: one sum after the other could not be taken side by side
        let mut sums = [[0.0; LANES]; 9];
        for first in (0..COUNT).step_by(LANES) {
            for lane in 0..LANES {
                let (x, y, weight) = (self.x[first + lane], self.y[first + lane], self.weight[first + lane]);
                // the slip there; of the spin (-y, x) goes into it
                let (sx, sy) = (u.x - u.z * y, u.y + u.z * x);
                let each = 1.0 / (sx * sx + sy * sy + rest * rest).sqrt();
                let (ax, ay) = (sx * each, sy * each);
                let turned = ay * x - ax * y;
                let each = weight * each;
                sums[0][lane] += weight * ax;
                sums[1][lane] += weight * ay;
                sums[2][lane] += weight * turned;
                sums[3][lane] += each * (1.0 - ax * ax);
                sums[4][lane] -= each * ax * ay;
                sums[5][lane] += each * (1.0 - ay * ay);
                sums[6][lane] -= each * (y + ax * turned);
                sums[7][lane] += each * (x - ay * turned);
                sums[8][lane] += each * (x * x + y * y - turned * turned);
            }
        }
        let [gx, gy, gz, xx, xy, yy, xz, yz, zz] = sums.map(|lanes| lanes.iter().sum::<f64>());
        let second = DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz));
        (cap * DVec3::new(gx, gy, gz), cap * second)
    }
}

/// A patch that is to slip with u = A j - `wanted`, A the `response`, by an impulse j of at most `cap`.
pub(super) struct System {
    pub response: DMat3,
    pub inverse: DMat3,
    pub wanted: DVec3,
    pub cap: f64,
}

impl System {
    /// The impulse j = -grad D(u) [N s] of the Coulomb field on the nodes; `guess` is a slip near u [m/s], or 0.
    pub fn field(&self, spread: DMat2, guess: DVec3) -> DVec3 {
        let Self { response, inverse, wanted, cap } = *self;
        let stops = inverse * wanted;
        if sticks(stops, cap, true) {
            return stops;
        }
        let trace = response.x_axis.x + response.y_axis.y + response.z_axis.z;
        let (nodes, rest) = (Nodes::new(spread), AT_REST * cap * trace);
        let at = |u: DVec3| {
            let (gradient, second) = nodes.dissipation(u, cap, rest);
            (inverse * (u + wanted) + gradient, second, gradient)
        };
        let mut u = if guess.length() > rest { guess } else { response * self.within(&mut 0.0) - wanted };
        let (mut residual, mut second, mut gradient) = at(u);
        for _ in 0..NEWTON_STEPS {
            if residual.length() < 1e-8 * cap {
                break;
            }
            let full = (inverse + second).inverse() * residual;
            let downhill = residual.dot(full);
            let mut share = 1.0;
            loop {
                let next = u - share * full;
                let there = at(next);
                // the slope along the step may have turned, but not to as much as it was; what is no number ends it
                let slope = there.0.dot(full);
                let too_far = slope <= -0.5 * downhill && share >= 1e-3;
                if !too_far {
                    (u, residual, second, gradient) = (next, there.0, there.1, there.2);
                    break;
                }
                share *= (downhill / (downhill - slope)).clamp(0.1, 0.5);
            }
        }
        -gradient
    }

    /// The j with (A + s 1) j = `wanted` and either s = 0, |j| <= cap or s > 0, |j| = cap: the same
    /// system as a trust-region step, solved by its Newton iteration from the last `s`.
    pub fn within(&self, s: &mut f64) -> DVec3 {
        let mut j = DVec3::ZERO;
        for _ in 0..NEWTON_STEPS {
            let inverse = if *s == 0.0 {
                self.inverse
            } else {
                (self.response + DMat3::from_diagonal(DVec3::splat(*s))).inverse()
            };
            j = inverse * self.wanted;
            let length = j.length();
            let excess = length / self.cap - 1.0;
            if excess.abs() < 1e-12 || excess < 0.0 && *s == 0.0 {
                return j;
            }
            *s = (*s + length * length / j.dot(inverse * j) * excess).max(0.0);
        }
        j * (self.cap / j.length()).min(1.0)
    }
}

/// Most steps of a patch's Newton iterations.
const NEWTON_STEPS: usize = 30;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_impulse_inside_the_limit_stops_the_slip_and_one_outside_opposes_what_remains() {
        let response =
            DMat3::from_cols(DVec3::new(2.0, 0.3, 0.1), DVec3::new(0.3, 1.0, 0.2), DVec3::new(0.1, 0.2, 4.0));
        let wanted = DVec3::new(-1.0, 0.5, 0.25);
        let of = |cap: f64| System { response, inverse: response.inverse(), wanted, cap };
        let free = of(10.0).within(&mut 0.0);
        assert!((response * free - wanted).length() < 1e-12);
        let capped = of(0.2).within(&mut 0.0);
        assert!((capped.length() - 0.2).abs() < 1e-10);
        assert!((of(0.2).within(&mut 50.0) - capped).length() < 1e-10);
        let remains = response * capped - wanted;
        assert!(remains.length() > 0.1);
        assert!((remains.normalize() + capped.normalize()).length() < 1e-9);
    }

    /// Mean over an even rectangle of half edges `half` [m] of |v + w n x y|, and its gradient.
    fn even(half: DVec2, v: DVec2, w: f64) -> (f64, DVec3) {
        let n = 300;
        let (mut sum, mut gradient) = (0.0, DVec3::ZERO);
        for i in 0..n {
            for j in 0..n {
                let at = |k: i32| (2.0 * f64::from(k) + 1.0) / f64::from(n) - 1.0;
                let place = half * DVec2::new(at(i), at(j));
                let turned = DVec2::new(-place.y, place.x);
                let slip = v + w * turned;
                sum += slip.length();
                let along = slip.normalize_or_zero();
                gradient += along.extend(along.dot(turned));
            }
        }
        let each = f64::from(n).powi(-2);
        (each * sum, each * gradient)
    }

    #[test]
    fn the_nodes_dissipate_like_an_even_pressure() {
        for half in [DVec2::new(0.1, 0.1), DVec2::new(0.3, 0.1), DVec2::new(0.3, 0.03)] {
            let root = root_of(half.x * half.x / 3.0, 0.0, half.y * half.y / 3.0).unwrap();
            for k in 0..=8 {
                let turn = f64::from(k) / 8.0 * std::f64::consts::FRAC_PI_2;
                let (v, w) = (DVec2::from_angle(0.4) * turn.sin(), turn.cos() / half.x);
                let (exact, force) = even(half, v, w);
                let (gradient, _) = Nodes::new(root).dissipation(v.extend(w), 1.0, 1e-9);
                let ours = gradient.dot(v.extend(w));
                assert!((ours / exact - 1.0).abs() < 0.02, "{half} {k}: {ours} {exact}");
                let off = (gradient - force).truncate().length();
                assert!(off < 0.09, "{half} {k}: {gradient} {force}");
            }
        }
    }

    #[test]
    fn an_area_sticks_below_its_limit_and_slips_against_its_impulse_beyond() {
        let response =
            DMat3::from_cols(DVec3::new(2.0, 0.3, 0.1), DVec3::new(0.3, 1.0, 0.2), DVec3::new(0.1, 0.2, 4.0));
        let spread = root_of(0.5, 0.1, 0.4).unwrap();
        let wanted = DVec3::new(-1.0, 0.5, 0.25);
        let of = |cap: f64| System { response, inverse: response.inverse(), wanted, cap };
        let stops = of(10.0).field(spread, DVec3::ZERO);
        assert!((response * stops - wanted).length() < 1e-12);
        let impulse = of(0.2).field(spread, DVec3::ZERO);
        let left = response * impulse - wanted;
        let (gradient, _) = Nodes::new(spread).dissipation(left, 0.2, 1e-9);
        assert!(left.length() > 0.1 && (gradient + impulse).length() < 1e-5 * 0.2, "{gradient} {impulse}");
        // from where the last visit ended, the same
        let again = of(0.2).field(spread, left);
        assert!((again - impulse).length() < 1e-7 * 0.2);
    }

    #[test]
    fn the_second_derivative_is_the_slope_of_the_gradient_and_the_ellipsoid_lies_within() {
        for (yy, xy) in [(1.0, 0.0), (0.3, 0.2), (0.0, 0.0)] {
            let arm = ARM * (1.0_f64 + yy).sqrt();
            let nodes = Nodes::new(root_of(1.0, xy, yy).unwrap() * (1.0 / arm));
            for k in 0..500 {
                let part = |n: f64| (f64::from(k) * n).fract() - 0.5;
                let u = DVec3::new(part(0.618_034), part(0.754_877), part(0.569_84)).normalize();
                let (gradient, second) = nodes.dissipation(u, 1.0, 1e-6);
                assert!(gradient.dot(u) > STICKS, "{yy} {u}: {}", gradient.dot(u));
                for axis in 0..3 {
                    let step = 1e-6 * DVec3::AXES[axis];
                    let slope =
                        nodes.dissipation(u + step, 1.0, 1e-6).0 - nodes.dissipation(u - step, 1.0, 1e-6).0;
                    let off = slope / 2e-6 - second.col(axis);
                    assert!(off.length() < 1e-3 * (1.0 + second.col(axis).length()), "{yy} {u}: {off}");
                }
            }
        }
    }
}
