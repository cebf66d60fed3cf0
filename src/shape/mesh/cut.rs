//! Faces of more than three corners, cut into triangles.

use earcut::Earcut;
use glam::{DVec2, DVec3};

/// Share of a face's area that its triangles may miss or cover twice: rounding.
const ROUNDING: f64 = 1e-6;

/// Numbers of the corners of the triangles of a face through `corners` [m], which turn as it does. What is not flat is cut as it shows
/// from the side that most of it looks to; `None` if it crosses itself there.
pub(super) fn face(corners: &[DVec3]) -> Option<Vec<[u32; 3]>> {
    let fan = || (2..corners.len() as u32).map(|k| [0, k - 1, k]).collect();
    let way = |k: usize| corners[k] - corners[0];
    let area: DVec3 = (2..corners.len()).map(|k| way(k - 1).cross(way(k))).sum();
    // What has no area bounds nothing, however it is cut.
    let Some(n) = area.try_normalize().filter(|_| corners.len() > 3) else { return Some(fan()) };
    let u = n.any_orthonormal_vector();
    let v = n.cross(u);
    let flat: Vec<DVec2> = (0..corners.len()).map(|k| DVec2::new(way(k).dot(u), way(k).dot(v))).collect();
    // Of most faces any corner sees all others.
    let least = ROUNDING * area.length();
    let seen = (2..flat.len()).all(|k| flat[k - 1].perp_dot(flat[k]) > least);
    if seen { Some(fan()) } else { section(&flat) }
}

/// The same of a closed line in the plane through `corners` [m].
pub(super) fn section(corners: &[DVec2]) -> Option<Vec<[u32; 3]>> {
    let n = corners.len() as u32;
    let twice = |[a, b, c]: [u32; 3]| {
        let [a, b, c] = [a, b, c].map(|k| corners[k as usize]);
        (b - a).perp_dot(c - a)
    };
    let whole: f64 = (2..n).map(|k| twice([0, k - 1, k])).sum();
    let mut found: Vec<u32> = vec![];
    Earcut::new().earcut(corners.iter().map(|c| c.to_array()), &[], &mut found);
    let along = |[a, b, c]: [u32; 3]| if twice([a, b, c]) * whole > 0.0 { [a, b, c] } else { [a, c, b] };
    let mut triangles: Vec<[u32; 3]> = found.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).map(along).collect();
    let mut used = vec![false; corners.len()];
    found.iter().for_each(|&k| used[k as usize] = true);
    // A corner on a straight side is left out, but the face beside may end there: the side's triangle is cut at it.
    for k in 0..n {
        if used[k as usize] {
            continue;
        }
        let mut round = (1..n).map(|step| (k + step) % n);
        let (after, before) =
            (round.clone().find(|&j| used[j as usize])?, round.rfind(|&j| used[j as usize])?);
        let side = |t: &[u32; 3]| (0..3).find(|&e| t[e] == before && t[(e + 1) % 3] == after);
        let (at, e) = triangles.iter().enumerate().find_map(|(at, t)| Some((at, side(t)?)))?;
        let tip = triangles[at][(e + 2) % 3];
        triangles[at] = [before, k, tip];
        triangles.push([k, after, tip]);
        used[k as usize] = true;
    }
    let covered: f64 = triangles.iter().map(|&t| twice(t).abs()).sum();
    let whole = whole.abs();
    (triangles.len() as u32 + 2 == n && (covered - whole).abs() <= ROUNDING * whole).then_some(triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Area vectors of its triangles as they turn, summed, over twice their sum without signs.
    fn evenness(corners: &[DVec3]) -> Option<(f64, DVec3)> {
        let area = |[a, b, c]: [u32; 3]| {
            let [a, b, c] = [a, b, c].map(|k| corners[k as usize]);
            0.5 * (b - a).cross(c - a)
        };
        let triangles = face(corners)?;
        Some((triangles.iter().map(|&t| area(t).length()).sum(), triangles.into_iter().map(area).sum()))
    }

    #[test]
    fn a_face_is_covered_once_from_whichever_corner_it_begins() {
        // An L with a corner on a straight side, far away and tilted.
        let section = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]];
        let turn = glam::DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 0.7);
        let at = |[x, z]: [f64; 2]| DVec3::new(4e5, 5e6, 10.0) + turn * DVec3::new(x, 0.0, z);
        for first in 0..section.len() {
            for reversed in [false, true] {
                let mut corners = section.map(at).to_vec();
                corners.rotate_left(first);
                if reversed {
                    corners.reverse();
                }
                let sides = corners.len() as u32;
                let triangles = face(&corners).expect("a sound face");
                let has = |a: u32, b: u32| {
                    let edges = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
                    triangles.iter().flat_map(edges).filter(|e| *e == [a, b]).count()
                };
                assert!((0..sides).all(|k| has(k, (k + 1) % sides) == 1), "{first} {triangles:?}");
                let (size, way) = evenness(&corners).expect("a sound face");
                assert!(
                    (size - 4.0).abs() < 1e-6 && (way.length() - 4.0).abs() < 1e-6,
                    "{first}: {size} {way}"
                );
            }
        }
    }

    #[test]
    fn a_bent_face_is_cut_and_a_crossed_one_is_not() {
        let bent = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.2], [1.0, 1.0, 0.0], [0.0, 1.0, 0.2]].map(DVec3::from);
        assert!(evenness(&bent).is_some_and(|(_, way)| (way.z - 1.0).abs() < 1e-12));
        let crossed = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, -1.0, 0.0]];
        assert_eq!(face(&crossed.map(DVec3::from)), None);
    }
}
