//! The ground below an open surface.

use super::Unfit;
use super::read::{Soup, directed};
use glam::DVec3;

/// Depth of the ground below the lowest place of its surface and below the floor, over the spacing: more than the layers of a wall.
pub(super) const BASE: f64 = 6.0;
/// Slope of a triangle that overhangs by more than round-off: the z part of its unit normal.
pub(super) const OVERHANG: f64 = -1e-6;

/// The closed surface of what lies between `vertices` and `triangles`, z upwards, and the level `base` [m] below the lowest
/// vertex and the `floor` [m].
///
/// # Errors
/// A surface without a border, one turned both ways, or one that overhangs.
pub(super) fn below(
    path: &str,
    mut vertices: Vec<DVec3>,
    mut triangles: Vec<[u32; 3]>,
    floor: f64,
    base: f64,
) -> Result<Soup, Unfit> {
    let edges = directed(path, &vertices, &triangles)?;
    let mut border: Vec<(u32, u32)> =
        edges.keys().filter(|(a, b)| !edges.contains_key(&(*b, *a))).copied().collect();
    if border.is_empty() {
        let message = format!("{path}: its surface is closed, that of a terrain is open");
        return Err(Unfit::new(
            message,
            "set shape = \"mesh\", or leave the sides and the bottom out of the file",
        ));
    }
    let normal = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|k| vertices[k as usize]);
        (b - a).cross(c - a)
    };
    let up: f64 = triangles.iter().map(|t| normal(t).z).sum();
    if up < 0.0 {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
        border.iter_mut().for_each(|e| *e = (e.1, e.0));
    }
    let down = |t: &[u32; 3]| normal(t).normalize_or_zero().z < OVERHANG;
    if let Some(k) = triangles.iter().position(down) {
        let message = format!(
            "{path}: triangle {} at {} m overhangs, or looks down where the others look up",
            k + 1,
            vertices[triangles[k][0] as usize]
        );
        return Err(Unfit::new(
            message,
            "a terrain has one height at a place, z upwards: turn the file's z axis up",
        ));
    }
    border.sort_unstable();
    let level = vertices.iter().map(|v| v.z).fold(floor, f64::min) - base;
    let under = vertices.len() as u32;
    let feet: Vec<DVec3> = vertices.iter().map(|v| DVec3 { z: level, ..*v }).collect();
    vertices.extend(feet);
    let bottom: Vec<[u32; 3]> = triangles.iter().map(|[a, b, c]| [a + under, c + under, b + under]).collect();
    triangles.extend(bottom);
    for (a, b) in border {
        triangles.push([b, a, a + under]);
        triangles.push([b, a + under, b + under]);
    }
    Ok((vertices, triangles))
}
