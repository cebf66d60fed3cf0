//! The faces of a particle of a wall layer, of which one at an edge of a box has two or three.

use glam::DVec3;

/// The faces that the `area` [m2] of a particle sums up, and the ways from it to their middles [m], which `to_surface` sums up; all in the frame
/// of its solid. At an edge of a box (`is_box`) each face has a middle of its own, in another depth; any other particle has one face.
pub(crate) fn row_faces(
    is_box: bool,
    area: DVec3,
    to_surface: DVec3,
) -> impl Iterator<Item = (DVec3, DVec3)> {
    let is_one = move |(of, _): &(DVec3, DVec3)| of.length_squared() > 1e-12 * area.length_squared();
    let of_box = DVec3::AXES.map(|e| (area * e, to_surface * e)).into_iter().filter(is_one);
    of_box.filter(move |_| is_box).chain((!is_box).then_some((area, to_surface)))
}

/// The direction of that face of a box's row, of those that its `normals` sum up, into which `area` looks most, both in its frame.
pub(crate) fn face_before(normals: DVec3, area: DVec3) -> DVec3 {
    let own = (0..3).filter(|&k| normals[k].abs() > 1e-6);
    let most =
        own.max_by(|&a, &b| (-area[a] * normals[a].signum()).total_cmp(&(-area[b] * normals[b].signum())));
    most.map_or(DVec3::ZERO, |k| normals[k].signum() * DVec3::AXES[k])
}
