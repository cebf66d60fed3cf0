//! Points of a mesh that contact presses, and the part of the surface that each stands for.

use super::super::areas::AS_NEAR;
use super::super::cells::PointCells;
use super::super::nearest::Nearest;
use super::super::{ALL_FACES, Faces, Geometry, Surface, WallLayer};
use super::particles::pieces;
use super::{Mesh, face};
use glam::DVec3;

/// Distance of points along a sharp edge, over the spacing, and how near another one of an edge may be.
const ALONG: f64 = 0.5;
const SAME: f64 = 0.05;
/// A vertex this near to others, over the spacing, has no point of its own.
const APART: f64 = 0.4;
/// Pieces that are looked up together.
const TOGETHER: usize = 1 << 16;

/// Points above the wall layer of `mesh`, along its sharp edges and at its vertices, all of one weight, which sum to 1 over
/// the side of the body that has most of them. With one weight edges, whose points lie closest, carry most of a face, and
/// are as stiff as they should be; what a face's pressure does to a spin goes by the part of the surface to which each
/// point is the nearest. Of an edge's point that is shared by the faces that meet there, since one of them alone is
/// pressed.
pub(super) fn surface(mesh: &Mesh, particles: &WallLayer, spacing: f64) -> Surface {
    let (mut points, mut faces): (Vec<DVec3>, Vec<Faces>) = (vec![], vec![]);
    let mut meeting: Vec<f64> = vec![];
    for &at in particles.offset {
        let (distance, outward) = mesh.distance(at);
        points.push(at - distance * outward);
        faces.push(face(outward));
        meeting.push(1.0);
    }
    let mut thinned = PointCells::new(APART * spacing);
    for &(a, b, on) in &mesh.sharp {
        let pieces = (a.distance(b) / (ALONG * spacing)).ceil().max(1.0);
        for k in 0..=pieces as i32 {
            let at = a.lerp(b, f64::from(k) / pieces);
            if thinned.nearest(at, SAME * spacing).is_none() {
                thinned.add(at);
                points.push(at);
                faces.push(on);
                meeting.push(2.0);
            }
        }
    }
    for &at in mesh.triangles.vertices() {
        if thinned.nearest(at, APART * spacing).is_none() {
            thinned.add(at);
            points.push(at);
            faces.push(face(at));
            meeting.push(1.0);
        }
    }
    let parts = parts(mesh, &points, spacing);
    let of_each = parts.iter().zip(meeting).map(|(part, faces)| part / (faces * spacing * spacing));
    Surface { parts: of_each.collect(), ..Surface::even(points, faces, ALL_FACES) }
}

/// Area [m2] of the surface to which each of `points` is the nearest, shared where several are.
fn parts(mesh: &Mesh, points: &[DVec3], spacing: f64) -> Vec<f64> {
    let tree = Nearest::new(points.iter().map(|at| at.to_array()).collect());
    let mut parts = vec![0.0; points.len()];
    let mut pieces = pieces(mesh, spacing);
    loop {
        let some: Vec<_> = pieces.by_ref().take(TOGETHER).collect();
        if some.is_empty() {
            return parts;
        }
        let found = tree.to_each(&some, |(at, _)| at.to_array(), AS_NEAR * spacing);
        for ((_, area), nearest) in some.iter().zip(found) {
            nearest.iter().for_each(|&k| parts[k] += area.length() / nearest.len() as f64);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_point_has_the_same_part_of_the_surface_at_every_scale() {
        // The sides of a cone are alike, and many a piece lies half-way between two points.
        let parts = |scale: f64| {
            let mesh = Mesh::cone(0.06 * scale, 0.1 * scale).expect("a cone");
            let all = mesh.particles(0.02 * scale, 3, 2);
            let layer = WallLayer { offset: &all.wall, to_surface: &all.to_surface };
            let areas: f64 = all.area.iter().map(|a| a.length() / (scale * scale)).sum();
            println!("{scale}: {} {areas}", all.wall.len());
            surface(mesh, &layer, 0.02 * scale).parts
        };
        let one = parts(1.0);
        for scale in [10.0, 0.1, 3.0, 0.001] {
            let other = parts(scale);
            let off = one.iter().zip(&other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!("{scale}: {off} of {}", one.len());
            assert!(one.len() == other.len() && off < 1e-6, "{scale}: {off}");
        }
    }
}
