//! Volume, centre of mass and principal moments of what a surface of triangles encloses.

use glam::{DMat3, DQuat, DVec3};

/// Off-diagonal part of the moments, over the largest of them, that is none: the axes of the file are principal ones.
const ROUND_OFF: f64 = 1e-6;

/// Of a uniform solid, over its mass.
pub(super) struct Mass {
    /// Volume, negative if the triangles turn inwards [m3].
    pub volume: f64,
    /// Centre of mass [m].
    pub center: DVec3,
    /// Principal moments over the mass [m2].
    pub moments: DVec3,
    /// Turn from the principal axes to those of the vertices.
    pub frame: DQuat,
}

impl Mass {
    /// Of the solid within `triangles` of `vertices` [m]: tetrahedra with one of these vertices as their tip.
    ///
    /// A tetrahedron with the edges a, b, c from its tip has the volume V = a . b x c / 6, the first moment V (a + b + c) / 4 and the second
    /// one V / 20 (a a^T + b b^T + c c^T + s s^T), s = a + b + c, about the tip.
    pub fn of(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let tip = vertices.first().copied().unwrap_or_default();
        let outer = |v: DVec3| DMat3::from_cols(v * v.x, v * v.y, v * v.z);
        let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
        for t in triangles {
            let [a, b, c] = t.map(|k| vertices[k as usize] - tip);
            let (v, s) = (a.dot(b.cross(c)) / 6.0, a + b + c);
            volume += v;
            first += v / 4.0 * s;
            second += v / 20.0 * (outer(a) + outer(b) + outer(c) + outer(s));
        }
        let center = first / volume;
        let spread = second * (1.0 / volume) - outer(center);
        let trace = spread.x_axis.x + spread.y_axis.y + spread.z_axis.z;
        let (moments, axes) = principal(DMat3::from_diagonal(DVec3::splat(trace)) - spread);
        Self { volume, center: tip + center, moments, frame: DQuat::from_mat3(&axes).normalize() }
    }
}

/// Eigenvalues of a symmetric `matrix` and its eigenvectors as the columns of a turn, by Jacobi's rotations: each in the plane of two axes, by
/// the lesser angle that makes their product of inertia 0. Scales, equal moments and the order of axes make no difference to it. Each stands
/// in the place of the axis that it lies nearest to, as far as one place is for one.
fn principal(matrix: DMat3) -> (DVec3, DMat3) {
    let (mut left, mut axes) = (matrix, DMat3::IDENTITY);
    let beside = |m: &DMat3| [(0, 1), (0, 2), (1, 2)].map(|(p, q)| m.col(q)[p].abs());
    let largest = (0..3).map(|k| matrix.col(k)[k].abs()).fold(0.0, f64::max);
    let off = |m: &DMat3| beside(m).into_iter().fold(0.0, f64::max);
    if off(&left) >= ROUND_OFF * largest {
        for _ in 0..SWEEPS {
            for (p, q) in [(0, 1), (0, 2), (1, 2)] {
                let mixed = left.col(q)[p];
                if mixed == 0.0 {
                    continue;
                }
                let slope = (left.col(q)[q] - left.col(p)[p]) / (2.0 * mixed);
                let tan = if slope == 0.0 { 1.0 } else { slope.signum() / (slope.abs() + slope.hypot(1.0)) };
                let cos = 1.0 / tan.hypot(1.0);
                let sin = tan * cos;
                let mut turn = DMat3::IDENTITY;
                turn.col_mut(p)[p] = cos;
                turn.col_mut(q)[q] = cos;
                turn.col_mut(q)[p] = sin;
                turn.col_mut(p)[q] = -sin;
                left = turn.transpose() * left * turn;
                axes *= turn;
            }
        }
    }
    // The rotations may lead far from the axes where they began.
    let near = |order: &[usize; 3]| (0..3).map(|k| axes.col(order[k])[k].abs()).sum::<f64>();
    let nearer = |best, order| if near(&order) > near(&best) { order } else { best };
    let order = ORDERS.into_iter().fold(ORDERS[0], nearer);
    let moments = DVec3::from_array(order.map(|k| left.col(k)[k]));
    let [x, y, z] = order.map(|k| axes.col(k));
    let turn = DMat3::from_cols(x, y, z);
    (moments, if turn.determinant() < 0.0 { DMat3::from_cols(x, y, -z) } else { turn })
}

/// The orders of three axes.
const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 0, 2], [0, 2, 1], [2, 1, 0], [1, 2, 0], [2, 0, 1]];

/// Rounds over the three planes; the rest falls with its square, and five leave none.
const SWEEPS: usize = 8;

#[cfg(test)]
mod tests {
    use super::*;

    /// A box of `size` about `center`, turned by `turn`.
    fn brick(size: DVec3, center: DVec3, turn: DQuat) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let corner = |k: u32| {
            let side = |axis: u32| if k >> axis & 1 == 1 { 0.5 } else { -0.5 };
            center + turn * (size * DVec3::new(side(0), side(1), side(2)))
        };
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).collect();
        ((0..8).map(corner).collect(), triangles)
    }

    #[test]
    fn boxes_of_every_size_have_their_moments_in_every_turn() {
        let turns = [
            DQuat::IDENTITY,
            DQuat::from_rotation_z(0.5),
            DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 1.1),
            DQuat::from_axis_angle(DVec3::new(-1.0, 0.2, 0.3).normalize(), 2.9),
        ];
        for scale in [1e-4, 1e-2, 1.0, 1e3] {
            for edges in
                [[2.0, 4.0, 6.0], [1.0, 1.0, 5.0], [5.0, 5.0, 1.0], [3.0, 3.0, 3.0], [1.0, 1.0001, 2.0]]
            {
                for turn in turns {
                    let size = scale * DVec3::from(edges);
                    let center = scale * DVec3::new(30.0, -20.0, 10.0);
                    let (vertices, triangles) = brick(size, center, turn);
                    let mass = Mass::of(&vertices, &triangles);
                    assert!((mass.volume / size.element_product() - 1.0).abs() < 1e-12);
                    assert!((mass.center - center).length() < 1e-11 * scale);
                    let squares = size * size;
                    let exact = (DVec3::splat(squares.element_sum()) - squares) / 12.0;
                    let tensor = |moments: DVec3, turn: DQuat| {
                        let turn = DMat3::from_quat(turn);
                        turn * DMat3::from_diagonal(moments) * turn.transpose()
                    };
                    let (have, want) = (tensor(mass.moments, mass.frame), tensor(exact, turn));
                    let off = (0..3).map(|k| (have.col(k) - want.col(k)).length()).fold(0.0, f64::max);
                    assert!(off < 2e-6 * exact.max_element(), "{size} {turn}: {have} for {want}");
                }
            }
        }
    }

    /// `inertia` of a case is in the order of the file's axes.
    #[test]
    fn moments_keep_the_order_of_the_axes_that_they_lie_nearest_to() {
        for k in 0..5000 {
            let part = |n: f64| 2.0 * (f64::from(k) * n).fract() - 1.0;
            let size = 1.75 + 1.25 * DVec3::new(part(0.414_214), part(0.732_051), part(0.236_068));
            let exact = (DVec3::splat((size * size).element_sum()) - size * size) / 12.0;
            let axis = DVec3::new(part(0.618_034), part(0.754_877), part(0.569_84)).normalize_or(DVec3::X);
            let turn = DQuat::from_axis_angle(axis, 0.6);
            let (vertices, triangles) = brick(size, DVec3::ZERO, turn);
            let mass = Mass::of(&vertices, &triangles);
            assert!((mass.moments - exact).length() < 1e-9, "{axis}: {} for {exact}", mass.moments);
            let matrix = DMat3::from_quat(mass.frame);
            assert!((0..3).all(|k| matrix.col(k)[k].abs() > 0.8), "{axis}: {matrix}");
        }
    }
}
