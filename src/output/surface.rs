//! The surface of the water as a mesh of triangles.
//!
//! The part of space that water fills is c(x) = sum W(|x - r_i|) / rho_i, where rho_i = sum W(|r_j - r_i|) is the density at the
//! particle, its own part included: 1 in the water, 0 far away, and never less than 1 at a lone drop. Its surface is found by
//! surface nets (Gibson 1998): a vertex in each cell of a grid that the surface passes, a quadrilateral across each edge that it cuts.
//! No edge is open: the mesh encloses a volume.

use crate::extents::in_double;
use glam::{DVec3, IVec3, Vec3};
use rayon::prelude::*;

/// Radius of the kernel over the spacing, W = (1 - (r / R)^2)^3.
const RADIUS: f32 = 2.0;
/// c at the surface: it lies half a spacing outside the outermost particles of still water, within a tenth of a spacing.
const LEVEL: f32 = 0.62;
/// Nodes of a grid at most.
const MOST_NODES: f64 = 1e9;

/// Triangles, and the velocity of the water at their corners.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// What vertices are counted from [m]: zero, unless single precision does not tell them apart there.
    pub origin: DVec3,
    /// Vertices [m].
    pub vertex: Vec<[f32; 3]>,
    /// Velocity at each vertex [m/s]; none if the particles have none.
    pub velocity: Vec<[f32; 3]>,
    /// Vertices of each triangle, anticlockwise seen from outside of the water.
    pub triangle: Vec<[u32; 3]>,
}

/// Particles by cells as wide as the kernel reaches.
struct Bins {
    low: Vec3,
    width: f32,
    count: IVec3,
    start: Vec<u32>,
    /// Positions in the order of the cells, and the number of each.
    position: Vec<Vec3>,
    number: Vec<u32>,
}

impl Bins {
    fn new(position: &[[f32; 3]], (low, high): (Vec3, Vec3), width: f32) -> Self {
        let count = ((high - low) / width).floor().as_ivec3() + 1;
        let mut bins =
            Self { low, width, count, start: Vec::new(), position: Vec::new(), number: Vec::new() };
        let cell: Vec<u32> = position.par_iter().map(|&x| bins.index(bins.cell(x.into())) as u32).collect();
        let total = (count.x * count.y * count.z) as usize;
        bins.start = vec![0; total + 1];
        cell.iter().for_each(|&c| bins.start[c as usize + 1] += 1);
        (0..total).for_each(|c| bins.start[c + 1] += bins.start[c]);
        let mut next = bins.start.clone();
        bins.number = vec![0; position.len()];
        for (i, &c) in cell.iter().enumerate() {
            bins.number[next[c as usize] as usize] = i as u32;
            next[c as usize] += 1;
        }
        bins.position = bins.number.iter().map(|&i| position[i as usize].into()).collect();
        bins
    }

    fn cell(&self, x: Vec3) -> IVec3 {
        ((x - self.low) / self.width).floor().as_ivec3().clamp(IVec3::ZERO, self.count - 1)
    }

    fn index(&self, c: IVec3) -> usize {
        ((c.x * self.count.y + c.y) * self.count.z + c.z) as usize
    }

    /// Calls `each` with the place and the squared distance of every particle closer than the width to `x`.
    fn near(&self, x: Vec3, mut each: impl FnMut(usize, f32)) {
        let c = self.cell(x);
        let (lo, hi) = ((c - 1).max(IVec3::ZERO), (c + 1).min(self.count - 1));
        for i in lo.x..=hi.x {
            for j in lo.y..=hi.y {
                let first = self.start[self.index(IVec3::new(i, j, lo.z))] as usize;
                let end = self.start[self.index(IVec3::new(i, j, hi.z)) + 1] as usize;
                for k in first..end {
                    let square = self.position[k].distance_squared(x);
                    if square < self.width * self.width {
                        each(k, square);
                    }
                }
            }
        }
    }
}

/// W for a squared distance, of a kernel that reaches to the square root of `reach`.
fn weight(square: f32, reach: f32) -> f32 {
    let q = (1.0 - square / reach).max(0.0);
    q * q * q
}

/// A grid whose nodes lie `cell` apart.
struct Nodes {
    low: Vec3,
    cell: f32,
    count: IVec3,
}

impl Nodes {
    fn place(&self, n: IVec3) -> Vec3 {
        self.low + self.cell * n.as_vec3()
    }
    fn index(&self, n: IVec3) -> usize {
        (n.x as usize * self.count.y as usize + n.y as usize) * self.count.z as usize + n.z as usize
    }
    /// Nodes of a plane of constant x.
    fn plane(&self) -> usize {
        self.count.y as usize * self.count.z as usize
    }
}

/// The surface of the water at `position` [m] with a `velocity` each, or none; `spacing` is the particles' [m], `cell` the edge of a
/// grid cell [m].
///
/// # Errors
/// In words, if the grid would have more nodes than memory holds or a place is not a number.
pub fn surface(
    position: &[[f64; 3]],
    velocity: &[[f32; 3]],
    spacing: f64,
    cell: f64,
) -> Result<Surface, String> {
    if position.iter().flatten().any(|x| !x.is_finite()) {
        return Err("a place of a particle is not a number".into());
    }
    let (low, high) =
        position.iter().fold((DVec3::MAX, DVec3::MIN), |(a, b), &x| (a.min(x.into()), b.max(x.into())));
    let far = !position.is_empty() && in_double((low, high), spacing);
    let origin = if far { low.floor() } else { DVec3::ZERO };
    let near = |&x: &[f64; 3]| (DVec3::from(x) - origin).as_vec3().to_array();
    let position: &[[f32; 3]] = &position.iter().map(near).collect::<Vec<_>>();
    let corners =
        position.iter().fold((Vec3::MAX, Vec3::MIN), |(a, b), &x| (a.min(x.into()), b.max(x.into())));
    if corners.0.x > corners.1.x {
        return Ok(Surface::default());
    }
    let (reach, cell) = (RADIUS * spacing as f32, cell as f32);
    let room = reach + 2.0 * cell;
    let low = corners.0 - room;
    let size = (corners.1 + room - low) / cell;
    let many = size.as_dvec3().element_product();
    if many > MOST_NODES {
        return Err(format!("a grid of {many:.1e} nodes, more than {MOST_NODES:.0e}"));
    }
    let bins = Bins::new(position, (low, corners.1 + room), reach);
    let nodes = Nodes { low, cell, count: size.ceil().as_ivec3() + 1 };
    let filled = filled(&bins, &nodes, reach * reach);
    let mut out = Surface { origin, ..net(&nodes, &filled) };
    if velocity.len() == position.len() {
        out.velocity =
            out.vertex.par_iter().map(|&x| mean(&bins, velocity, x.into(), reach * reach)).collect();
    }
    Ok(out)
}

/// c - [`LEVEL`] at each node.
fn filled(bins: &Bins, nodes: &Nodes, reach: f32) -> Vec<f32> {
    let share: Vec<f32> = (bins.position.par_iter())
        .map(|&x| {
            let mut density = 0.0;
            bins.near(x, |_, square| density += weight(square, reach));
            density.recip()
        })
        .collect();
    let mut filled = vec![-LEVEL; nodes.plane() * nodes.count.x as usize];
    let row = nodes.count.z as usize;
    filled.par_chunks_mut(nodes.plane()).enumerate().for_each(|(i, plane)| {
        let x = nodes.low.x + nodes.cell * i as f32;
        let middle = bins.cell(Vec3::new(x, bins.low.y, bins.low.z)).x;
        let (first, last) = ((middle - 1).max(0), (middle + 1).min(bins.count.x - 1));
        let from = bins.start[bins.index(IVec3::new(first, 0, 0))] as usize;
        let to = bins.start[bins.index(IVec3::new(last, bins.count.y - 1, bins.count.z - 1)) + 1] as usize;
        // The nodes of this plane that each particle reaches.
        for (p, part) in bins.position[from..to].iter().zip(&share[from..to]) {
            let left = reach - (p.x - x).powi(2);
            if left <= 0.0 {
                continue;
            }
            let span = |at: f32, low: f32, left: f32| {
                let (at, half) = ((at - low) / nodes.cell, left.sqrt() / nodes.cell);
                (at - half).ceil() as usize..=(at + half).floor() as usize
            };
            for j in span(p.y, nodes.low.y, left) {
                let y = nodes.low.y + nodes.cell * j as f32 - p.y;
                let left = left - y * y;
                if left <= 0.0 {
                    continue;
                }
                for k in span(p.z, nodes.low.z, left) {
                    let z = nodes.low.z + nodes.cell * k as f32 - p.z;
                    plane[j * row + k] += part * weight(reach - left + z * z, reach);
                }
            }
        }
    });
    filled
}

/// Mean velocity around `x`.
fn mean(bins: &Bins, velocity: &[[f32; 3]], x: Vec3, reach: f32) -> [f32; 3] {
    let (mut sum, mut total) = (Vec3::ZERO, 0.0);
    bins.near(x, |k, square| {
        let w = weight(square, reach);
        (sum, total) = (sum + w * Vec3::from(velocity[bins.number[k] as usize]), total + w);
    });
    if total > 0.0 { (sum / total).to_array() } else { [0.0; 3] }
}

/// Corners of a cell.
const CORNERS: [IVec3; 8] = {
    let mut corners = [IVec3::ZERO; 8];
    let mut k = 0;
    while k < 8 {
        corners[k] = IVec3::new(k as i32 & 1, k as i32 >> 1 & 1, k as i32 >> 2 & 1);
        k += 1;
    }
    corners
};

/// The net of the surface where `filled` is 0.
fn net(nodes: &Nodes, filled: &[f32]) -> Surface {
    let inside = |n: IVec3| filled[nodes.index(n)] > 0.0;
    let plane = nodes.plane();
    // Cells that the surface passes, by planes: their first corner and the vertex.
    let found: Vec<Vec<(usize, [f32; 3])>> = (0..nodes.count.x - 1)
        .into_par_iter()
        .map(|i| {
            let mut found = Vec::new();
            for j in 0..nodes.count.y - 1 {
                for k in 0..nodes.count.z - 1 {
                    let at = IVec3::new(i, j, k);
                    let value = CORNERS.map(|c| filled[nodes.index(at + c)]);
                    if let Some(middle) = crossing(&value) {
                        found.push((nodes.index(at), (nodes.place(at) + nodes.cell * middle).to_array()));
                    }
                }
            }
            found
        })
        .collect();
    let mut out = Surface::default();
    let mut number = vec![u32::MAX; filled.len()];
    for (cell, vertex) in found.into_iter().flatten() {
        number[cell] = out.vertex.len() as u32;
        out.vertex.push(vertex);
    }
    let axes = [IVec3::X, IVec3::Y, IVec3::Z];
    let triangles: Vec<Vec<[u32; 3]>> = (1..nodes.count.x - 1)
        .into_par_iter()
        .map(|i| {
            let mut triangles = Vec::new();
            for n in i as usize * plane..(i as usize + 1) * plane {
                let rest = n - i as usize * plane;
                let at = IVec3::new(
                    i,
                    (rest / nodes.count.z as usize) as i32,
                    (rest % nodes.count.z as usize) as i32,
                );
                if at.y < 1 || at.z < 1 || at.y >= nodes.count.y - 1 || at.z >= nodes.count.z - 1 {
                    continue;
                }
                for axis in 0..3 {
                    let (here, there) = (inside(at), inside(at + axes[axis]));
                    if here == there {
                        continue;
                    }
                    let (u, v) = (axes[(axis + 1) % 3], axes[(axis + 2) % 3]);
                    let of = |c: IVec3| number[nodes.index(c)];
                    // Anticlockwise about the edge.
                    let [a, b, c, d] = [of(at - u - v), of(at - v), of(at), of(at - u)];
                    let quad = if here { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
                    triangles.extend(quad);
                }
            }
            triangles
        })
        .collect();
    out.triangle = triangles.concat();
    out
}

/// Mean of the places where the edges of a cell of edge 1 are cut, if any is.
fn crossing(value: &[f32; 8]) -> Option<Vec3> {
    let inside = value.iter().filter(|&&v| v > 0.0).count();
    if inside == 0 || inside == 8 {
        return None;
    }
    let (mut sum, mut count) = (Vec3::ZERO, 0.0);
    for a in 0..8_usize {
        for axis in 0..3 {
            let b = a | 1 << axis;
            if a != b && (value[a] > 0.0) != (value[b] > 0.0) {
                let part = value[a] / (value[a] - value[b]);
                sum += CORNERS[a].as_vec3().lerp(CORNERS[b].as_vec3(), part);
                count += 1.0;
            }
        }
    }
    Some(sum / count)
}

impl Surface {
    /// Where a `vertex` is [m].
    fn place(&self, &vertex: &[f32; 3]) -> [f64; 3] {
        (self.origin + Vec3::from(vertex).as_dvec3()).to_array()
    }

    /// The bytes of a PLY file (binary, little endian): x, y, z and, if there are any, velocities as vx, vy, vz.
    pub fn ply(&self) -> Vec<u8> {
        let moves = self.velocity.len() == self.vertex.len() && !self.vertex.is_empty();
        let names: &[&str] = if moves { &["x", "y", "z", "vx", "vy", "vz"] } else { &["x", "y", "z"] };
        let mut out = Vec::with_capacity(400 + self.vertex.len() * 24 + self.triangle.len() * 13);
        let mut head = format!(
            "ply\nformat binary_little_endian 1.0\ncomment water surface by seixo, [m] and [m/s]\nelement vertex {}\n",
            self.vertex.len()
        );
        let far = self.origin != DVec3::ZERO;
        for (k, name) in names.iter().enumerate() {
            head += &format!("property {} {name}\n", if far && k < 3 { "double" } else { "float" });
        }
        head += &format!(
            "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.triangle.len()
        );
        out.extend(head.into_bytes());
        for (i, x) in self.vertex.iter().enumerate() {
            if far {
                out.extend(self.place(x).iter().flat_map(|x| x.to_le_bytes()));
            } else {
                out.extend(x.iter().flat_map(|x| x.to_le_bytes()));
            }
            if moves {
                out.extend(self.velocity[i].iter().flat_map(|v| v.to_le_bytes()));
            }
        }
        for t in &self.triangle {
            out.push(3);
            out.extend(t.iter().flat_map(|k| k.to_le_bytes()));
        }
        out
    }

    /// The text of a Wavefront OBJ file.
    pub fn obj(&self) -> String {
        use std::fmt::Write;
        let mut out = String::from("# water surface by seixo [m]\n");
        let far = self.origin != DVec3::ZERO;
        for vertex in &self.vertex {
            let ([x, y, z], [a, b, c]) = (vertex, self.place(vertex));
            let _ = if far { writeln!(out, "v {a} {b} {c}") } else { writeln!(out, "v {x} {y} {z}") };
        }
        for t in &self.triangle {
            let _ = writeln!(out, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1);
        }
        out
    }

    /// Volume that it encloses [m3].
    pub fn volume(&self) -> f64 {
        let at = |k: u32| Vec3::from(self.vertex[k as usize]).as_dvec3();
        self.triangle.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c))) / 6.0).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    fn closed(surface: &Surface) {
        let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
        for &[a, b, c] in &surface.triangle {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
            }
        }
        assert!(!edges.is_empty() && edges.values().all(|&n| n == 0), "an edge is open");
    }

    #[test]
    fn a_block_of_water_has_its_volume_and_lies_half_a_spacing_outside_of_its_particles() {
        let (l0, n) = (0.02, [30, 20, 12]);
        let mut position = Vec::new();
        for i in 0..n[0] {
            for j in 0..n[1] {
                for k in 0..n[2] {
                    position.push([i, j, k].map(|k| 5.0 + l0 * (f64::from(k) + 0.5)));
                }
            }
        }
        let velocity: Vec<[f32; 3]> = position.iter().map(|x| [1.0, 0.0, x[2] as f32]).collect();
        let surface = surface(&position, &velocity, l0, 0.5 * l0).expect("it is small");
        closed(&surface);
        let volume = (n[0] * n[1] * n[2]) as f64 * l0.powi(3);
        println!("{} triangles, {} of {volume} m3", surface.triangle.len(), surface.volume());
        // Edges and corners are round.
        assert!((surface.volume() / volume - 1.0).abs() < 0.02, "{} of {volume} m3", surface.volume());
        let top = 5.0 + 12.0 * l0 as f32;
        let above: Vec<f32> = surface
            .vertex
            .iter()
            .filter(|x| (5.2..5.4).contains(&x[0]) && (5.1..5.3).contains(&x[1]))
            .map(|x| x[2])
            .filter(|z| *z > 5.1)
            .collect();
        let mean = above.iter().sum::<f32>() / above.len() as f32;
        assert!(!above.is_empty() && (mean - top).abs() < 0.1 * l0 as f32, "{mean} m for {top} m");
        for (x, v) in surface.vertex.iter().zip(&surface.velocity) {
            assert!((v[0] - 1.0).abs() < 1e-4 && (v[2] - x[2]).abs() < 1.5 * l0 as f32, "{x:?} {v:?}");
        }
    }

    #[test]
    fn drops_stay_apart_and_are_closed() {
        let position = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.05, 0.02]];
        let surface = surface(&position, &[], 0.01, 0.004).expect("it is small");
        closed(&surface);
        // Three balls of about 0.76 spacings each.
        let each = surface.volume() / 3.0;
        assert!((1.2e-6..2.4e-6).contains(&each) && surface.velocity.is_empty(), "{each}");
        assert_eq!(super::surface(&[], &[], 0.01, 0.01), Ok(Surface::default()));
        assert!(super::surface(&[[0.0; 3], [1e4; 3]], &[], 0.01, 0.01).is_err());
    }

    #[test]
    fn a_surface_at_coordinates_of_a_site_is_the_one_near_zero() {
        let drop = |at: f64| surface(&[[at, 0.0, 0.0], [at, 0.0, 0.5]], &[], 0.5, 0.25).expect("it is small");
        let (near, far) = (drop(0.0), drop(4.5e6));
        closed(&far);
        assert!((far.volume() / near.volume() - 1.0).abs() < 1e-4 && near.origin == DVec3::ZERO);
        let head = String::from_utf8_lossy(&far.ply()[..200]).into_owned();
        assert!(head.contains("property double x\n"), "{head}");
        let first = far.obj().lines().nth(1).expect("a vertex").to_owned();
        let x: f64 = first.split(' ').nth(1).expect("x").parse().expect("a number");
        assert!((x - 4.5e6).abs() < 1.0 && x.fract() != 0.0, "{first}");
    }

    #[test]
    fn files_hold_what_they_say() {
        let surface = surface(&[[0.0; 3]], &[[1.0, 2.0, 3.0]], 0.01, 0.005).expect("it is small");
        let ply = surface.ply();
        let end = ply.windows(11).position(|w| w == b"end_header\n").expect("a header") + 11;
        assert_eq!(ply.len(), end + surface.vertex.len() * 24 + surface.triangle.len() * 13);
        let obj = surface.obj();
        assert_eq!(obj.lines().filter(|l| l.starts_with("f ")).count(), surface.triangle.len());
    }
}
