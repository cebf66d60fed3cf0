//! A closed surface of triangles: a solid from an STL or OBJ file, ground below an open one, a cone or a wedge.
//!
//! Volume, moments and distances (parry) are those of the triangles. Particles stand in layers half a
//! spacing, one and a half and so on below the surface. Points of the surface press into others: those above the
//! wall layer, the vertices and the sharp edges.

mod cavities;
mod cut;
mod flush;
mod ground;
mod mass;
mod particles;
mod planes;
mod points;
mod primitives;
mod read;
mod shells;
mod skin;
mod thickness;

use super::areas::middle;
use super::surface::Surface;
use super::{Faces, Geometry, Inside, Node, Particles, Shape, WallLayer, face, nodes_between};
use glam::{DQuat, DVec3};
use mass::Mass;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::query::{PointQuery, Ray, RayCast};
use parry3d_f64::shape::{TriMesh, TriMeshFlags};
use planes::Planes;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};

/// What is wrong with a file, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unfit {
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub remedy: String,
}

impl Unfit {
    fn new(message: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { message: message.into(), remedy: remedy.into() }
    }
}

/// A body's surface, in the frame of its principal axes.
#[derive(Clone)]
pub struct Mesh {
    triangles: Arc<TriMesh>,
    /// The triangles that depths count to, if others cover some.
    open: Option<Arc<TriMesh>>,
    /// Those of a convex mesh with few faces.
    planes: Option<Arc<Planes>>,
    volume: f64,
    /// Principal moments per mass [m2].
    moments: DVec3,
    /// Turn from this frame to the file's.
    frame: DQuat,
    is_file: bool,
    /// Whether its file holds numbers in single precision.
    is_single: bool,
    /// Centre of mass in the file's coordinates [m].
    center: DVec3,
    /// Corners of its convex hull [m].
    hull: Vec<DVec3>,
    radius: f64,
    /// Lower and upper corner of the box around it [m].
    bounds: (DVec3, DVec3),
    /// The same along the axes of the file, about the centre of mass [m].
    along_file: (DVec3, DVec3),
    /// Convex edges that are sharper than [`SHARP`]: their ends, and the faces that their triangles belong to.
    sharp: Vec<(DVec3, DVec3, Faces)>,
    thickness: Thickness,
    /// Its sealed cavities, when somebody has asked for them.
    cavities: OnceLock<Arc<[TriMesh]>>,
}

/// Where a mesh is thinnest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thickness {
    /// Thickness [m].
    pub least: f64,
    /// The middle of a triangle there, in the file's coordinates [m].
    pub place: DVec3,
}

/// Angle between the normals of two triangles from which their edge presses by itself [rad].
const SHARP: f64 = 0.5;

/// A mesh is made once for all solids, scenes and runs of a program that have it, and kept: by what it is made from, and
/// its lengths.
static MADE: Mutex<Vec<(Key, &'static Mesh)>> = Mutex::new(Vec::new());

/// What a mesh is made from: a name, the file's checksum, and the lengths that it is made with.
type Key = (String, u32, [u64; 4]);

impl std::fmt::Debug for Mesh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Mesh({} triangles)", self.triangles.num_triangles())
    }
}

impl PartialEq for Mesh {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

impl Mesh {
    /// The mesh in the STL or OBJ file `path`, whose lengths times `scale` are metres.
    ///
    /// # Errors
    /// A file that cannot be read, or a surface that encloses nothing: open, turned both ways, flat.
    pub fn open(path: &str, scale: f64) -> Result<&'static Self, Unfit> {
        Self::from_file(path, scale, [0.0; 2], Ok)
    }

    /// The ground below the open surface in the file `path`, down to a few of `spacing` [m] below its lowest place and the level `floor` [m].
    ///
    /// # Errors
    /// A file that cannot be read, or a surface that is closed, overhangs or is turned both ways.
    pub fn terrain(path: &str, scale: f64, spacing: f64, floor: f64) -> Result<&'static Self, Unfit> {
        Self::from_file(path, scale, [spacing, floor], |(vertices, triangles)| {
            ground::below(path, vertices, triangles, floor, ground::BASE * spacing)
        })
    }

    /// Its triangles, which turn outwards.
    pub fn faces(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        self.triangles.triangles().map(|triangle| [triangle.a, triangle.b, triangle.c])
    }

    fn from_file(
        path: &str,
        scale: f64,
        [base, floor]: [f64; 2],
        close: impl FnOnce(read::Soup) -> Result<read::Soup, Unfit>,
    ) -> Result<&'static Self, Unfit> {
        let bytes = read::bytes(path).map_err(|e| {
            Unfit::new(format!("{path}: {e}"), "give an STL or OBJ file, by its path from the case")
        })?;
        let single = f64::from(u8::from(read::is_single(path, &bytes)));
        Self::made(
            (path.to_owned(), crc32fast::hash(&bytes), [scale, base, single, floor].map(f64::to_bits)),
            || {
                let (vertices, triangles) = read::soup(path, &bytes)?;
                let vertices = vertices.into_iter().map(|v| scale * v).collect();
                close((vertices, triangles))
            },
        )
    }

    /// The mesh that `key` stands for, of what `make` gives if there is none yet.
    fn made(key: Key, make: impl FnOnce() -> Result<read::Soup, Unfit>) -> Result<&'static Self, Unfit> {
        let mut made = MADE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(known) = made.iter().find(|known| known.0 == key) {
            return Ok(known.1);
        }
        let (vertices, triangles) = make()?;
        let mut mesh = Self::new(&key.0, vertices, triangles)?;
        mesh.is_file = key.1 != 0;
        mesh.is_single = mesh.is_file && f64::from_bits(key.2[2]) > 0.0;
        // A base makes it ground.
        mesh.thickness = mesh.thinnest(mesh.is_file && f64::from_bits(key.2[1]) > 0.0);
        let mesh: &'static Self = Box::leak(Box::new(mesh));
        made.push((key, mesh));
        Ok(mesh)
    }

    /// A mesh of `vertices` [m]; `path` stands for it in messages.
    fn new(path: &str, mut vertices: Vec<DVec3>, mut triangles: Vec<[u32; 3]>) -> Result<Self, Unfit> {
        read::check(path, &vertices, &triangles)?;
        let Mass { volume: signed, center, moments, frame } = Mass::of(&vertices, &triangles);
        let volume = signed.abs();
        let size = vertices.iter().map(|v| v.distance(vertices[0])).fold(0.0, f64::max);
        if volume.is_nan() || volume <= 1e-9 * size.powi(3) {
            let message = format!("{path}: its surface encloses no volume");
            return Err(Unfit::new(message, "give a closed solid with a volume"));
        }
        if signed < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        shells::check(path, &vertices, &triangles)?;
        let to_own = frame.inverse();
        let around =
            |all: &[DVec3]| all.iter().fold((DVec3::MAX, DVec3::MIN), |(a, b), &v| (a.min(v), b.max(v)));
        vertices.iter_mut().for_each(|v| *v -= center);
        let along_file = around(&vertices);
        vertices.iter_mut().for_each(|v| *v = to_own * *v);
        let bounds = around(&vertices);
        let sharp = sharp(&vertices, &triangles);
        let hull = parry3d_f64::transformation::try_convex_hull(&vertices);
        let hull = hull.map_or_else(|_| vertices.clone(), |(hull, _)| hull);
        let radius = hull.iter().map(|v| v.length()).fold(0.0, f64::max);
        let triangles = TriMesh::with_flags(vertices, triangles, TriMeshFlags::ORIENTED)
            .map_err(|e| Unfit::new(format!("{path}: {e}"), "repair the surface"))?;
        Ok(Self {
            planes: Planes::of(&triangles, radius).map(Arc::new),
            triangles: Arc::new(triangles),
            open: None,
            volume,
            moments,
            frame,
            is_file: false,
            is_single: false,
            center,
            hull,
            radius,
            bounds,
            along_file,
            sharp,
            thickness: Thickness { least: f64::INFINITY, place: center },
            cavities: OnceLock::new(),
        })
    }

    /// Where it is thinnest. Of ground, between two places of the surface that was given: its sides and its bottom end nowhere that water
    /// reaches.
    fn thinnest(&self, is_ground: bool) -> Thickness {
        let thickness = if is_ground {
            let up = |t: &[u32; 3]| {
                let [a, b, c] = t.map(|k| self.vertices()[k as usize]);
                (self.frame * (b - a).cross(c - a).normalize_or_zero()).z > -ground::OVERHANG
            };
            let above = self.triangles.indices().iter().filter(|t| up(t)).copied().collect();
            // Triangles that a mesh was made of already, one of which looks up at least.
            let above = TriMesh::new(self.vertices().to_vec(), above);
            above.map_or(self.thickness, |above| thickness::of_mesh(&above))
        } else {
            thickness::of_mesh(&self.triangles)
        };
        Thickness { place: self.frame * thickness.place + self.center, ..thickness }
    }

    /// Whether it comes from a file.
    pub(crate) fn is_file(&self) -> bool {
        self.is_file
    }

    /// Steps in which a file in single precision tells its coordinates where they are largest, and these [m].
    pub(crate) fn steps(&self) -> Option<(f64, f64)> {
        let (low, high) = (self.center + self.along_file.0, self.center + self.along_file.1);
        self.is_single.then(|| read::steps(&[low, high]))
    }

    /// The same of the file `path`, whose lengths times `scale` are metres, whether or not it is a solid; `None` if it cannot be read.
    pub(crate) fn steps_of_file(path: &str, scale: f64) -> Option<(f64, f64)> {
        let bytes = read::bytes(path).ok().filter(|bytes| read::is_single(path, bytes))?;
        let (step, largest) = read::steps(&read::soup(path, &bytes).ok()?.0);
        Some((scale * step, scale * largest))
    }

    /// Where it is thinnest.
    pub fn thickness(&self) -> Thickness {
        self.thickness
    }

    /// Edge lengths of the box around it, along the axes of the file [m].
    pub fn size(&self) -> DVec3 {
        self.along_file.1 - self.along_file.0
    }

    /// Corners of its triangles [m].
    pub(crate) fn vertices(&self) -> &[DVec3] {
        self.triangles.vertices()
    }

    /// The nearest point of the surface, and whether `q` is inside.
    fn nearest(&self, q: DVec3) -> (DVec3, bool) {
        let found = self.triangles.project_local_point(q, false);
        (found.point, found.is_inside)
    }

    /// The middle of the points of the surface that are nearest to `q`, of which a place before the bisector of an edge or a corner has several;
    /// those that are farther by less than `slack` [m] count.
    fn nearest_evenly(&self, q: DVec3, slack: f64) -> DVec3 {
        let nearest = self.nearest(q).0;
        let most = nearest.distance(q) + slack;
        let around = Aabb::from_half_extents(q, DVec3::splat(most));
        let of = |k: u32| self.triangles.triangle(k).project_local_point(q, false).point;
        let found = self.triangles.bvh().intersect_aabb(&around).map(of).filter(|at| at.distance(q) <= most);
        middle(found, slack).unwrap_or(nearest)
    }

    /// Places along the line where it goes through the surface, in order.
    fn crossings(&self, start: DVec3, along: DVec3, length: f64) -> Vec<f64> {
        if let Some(planes) = &self.planes {
            let inside = planes.inside(start, along, length);
            let ends = inside.into_iter().flat_map(|(from, to)| [from, to]);
            return ends.filter(|&s| s > 0.0 && s < length).collect();
        }
        let step = 1e-9 * self.radius;
        let (mut out, mut from) = (vec![], 0.0);
        while let Some(way) =
            self.triangles.cast_local_ray(&Ray::new(start + from * along, along), length - from, false)
        {
            from += way;
            out.push(from);
            from += step;
            if from >= length {
                break;
            }
        }
        out
    }
}

/// The triangle of each edge, which runs the way that the triangle turns.
fn edges(triangles: &[[u32; 3]]) -> HashMap<(u32, u32), usize> {
    let around = |t: &[u32; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
    triangles.iter().enumerate().flat_map(|(k, t)| around(t).map(|edge| (edge, k))).collect()
}

/// Sharp convex edges.
fn sharp(vertices: &[DVec3], triangles: &[[u32; 3]]) -> Vec<(DVec3, DVec3, Faces)> {
    let at = |k: u32| vertices[k as usize];
    let normal = |t: &[u32; 3]| (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).normalize_or_zero();
    let of = edges(triangles);
    let mut out = vec![];
    for t in triangles {
        for e in 0..3 {
            let (a, b, apex) = (t[e], t[(e + 1) % 3], t[(e + 2) % 3]);
            let Some(&k) = of.get(&(b, a)).filter(|_| a < b) else { continue };
            let (n, m) = (normal(t), normal(&triangles[k]));
            let convex = m.dot(at(apex) - at(a)) < 0.0;
            if convex && n.angle_between(m) > SHARP {
                out.push((at(a), at(b), face(n) | face(m)));
            }
        }
    }
    out
}

impl Geometry for Mesh {
    fn name(&self) -> &'static str {
        "mesh"
    }

    fn volume(&self) -> f64 {
        self.volume
    }

    fn inertia(&self, mass: f64) -> DVec3 {
        mass * self.moments
    }

    fn radius(&self) -> f64 {
        self.radius
    }

    fn is_convex(&self) -> bool {
        false
    }

    fn frame(&self) -> DQuat {
        self.frame
    }

    fn origin(&self) -> DVec3 {
        self.center
    }

    fn reach(&self, n: DVec3) -> f64 {
        self.hull.iter().map(|v| v.dot(n)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Of the box around it, and of its surface only near that.
    fn outside(&self, q: DVec3) -> f64 {
        let (low, high) = self.bounds;
        let off = (low - q).max(q - high).max(DVec3::ZERO).length();
        if off > 0.1 * self.radius { off } else { self.distance(q).0 }
    }

    fn distance(&self, q: DVec3) -> (f64, DVec3) {
        if let Some(known) = self.planes.as_ref().and_then(|planes| planes.distance(q)) {
            return known;
        }
        let (mut nearest, inside) = self.nearest(q);
        if let Some(open) = self.open.as_ref().filter(|_| inside) {
            nearest = open.project_local_point(q, false).point;
        }
        let (way, sign) = (q - nearest, if inside { -1.0 } else { 1.0 });
        let d = way.length();
        // on the surface itself
        if d < 1e-12 * self.radius {
            let away = q.try_normalize().unwrap_or(DVec3::Z);
            let ahead = q + 1e-6 * self.radius * away;
            let (n, inside) = self.nearest(ahead);
            let outward = (ahead - n).normalize_or(away);
            return (0.0, if inside { -outward } else { outward });
        }
        (sign * d, sign * way / d)
    }

    fn depth(&self, q: DVec3, _: Faces) -> Option<Inside> {
        let (low, high) = self.bounds;
        if q.cmplt(low).any() || q.cmpgt(high).any() {
            return None;
        }
        let (distance, outward) = self.distance(q);
        (distance < 0.0).then(|| Inside {
            depth: -distance,
            outward,
            face: face(outward).trailing_zeros() as u8,
        })
    }

    fn axes(&self) -> Vec<DVec3> {
        DVec3::AXES.to_vec()
    }

    fn line_is_near(&self, start: DVec3, along: DVec3, length: f64, margin: f64) -> bool {
        let end = start + length * along;
        let (low, high) = (self.bounds.0 - margin, self.bounds.1 + margin);
        start.min(end).cmple(high).all() && start.max(end).cmpge(low).all()
    }

    fn nodes(&self, line: (DVec3, DVec3, f64), faces: Faces, _: f64, visit: &mut dyn FnMut(Node, Inside)) {
        let crossings = self.crossings(line.0, line.1, line.2);
        nodes_between(self, line, crossings, faces, visit);
    }

    fn corners(&self) -> Vec<DVec3> {
        self.vertices().to_vec()
    }

    fn has_cavities(&self) -> bool {
        !self.cavities().is_empty()
    }

    fn in_cavity(&self, q: DVec3) -> bool {
        self.lies_in_cavity(q)
    }

    fn uncovered(&self, spacing: f64, covered: &dyn Fn(DVec3, DVec3) -> bool) -> Option<Shape> {
        self.with_open(spacing, covered).map(Shape::Mesh)
    }

    fn particles(&self, spacing: f64, _: u32, layers: i32) -> Particles {
        particles::fill(self, spacing, layers)
    }

    fn pieces(&self, spacing: f64) -> Option<Box<dyn Iterator<Item = (DVec3, DVec3)> + '_>> {
        Some(Box::new(particles::pieces(self, spacing)))
    }

    fn freed(&self, wall: &[DVec3], spacing: f64, free: &dyn Fn(DVec3, DVec3) -> bool) -> Option<Particles> {
        Some(particles::freed(self, wall, spacing, free))
    }

    fn surface(&self, particles: &WallLayer, spacing: f64, _: u32) -> Surface {
        points::surface(self, particles, spacing)
    }
}
