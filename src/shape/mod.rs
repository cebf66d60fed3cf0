//! Shapes of solids: a shape is one file here and one arm of [`Shape`].
//!
//! Everything else asks a shape: the scene for its particles and its volume, a body for its inertia, contact
//! for its depth below a point and for what of its surface presses into others ([`Surface`]).

mod areas;
mod bends;
pub(crate) mod blocks;
mod cells;
mod convex;
mod cuboid;
mod cylinder;
mod disc;
#[cfg(feature = "mesh")]
mod mesh;
mod nearest;
mod nodes;
mod open;
mod polygon;
mod rings;
mod row;
mod sphere;
mod surface;
mod thickness;
mod thin;

pub(crate) use bends::{ADJACENT, Bending, bending, bends};
pub(crate) use cells::PointCells;
pub(crate) use convex::{along, around, root};
pub use cuboid::Cuboid;
pub(crate) use cuboid::{ALL_FACES, face_normal};
pub use cylinder::Cylinder;
pub use disc::Disc;
#[cfg(feature = "mesh")]
pub use mesh::{Mesh, Thickness, Unfit};
pub(crate) use nearest::Nearest;
pub use nodes::Node;
use nodes::nodes_between;
pub use polygon::Polygon;
pub(crate) use polygon::signed_area;
pub(crate) use row::MOST_FACES;
pub use row::{Edges, Face};
pub use sphere::Sphere;
pub use surface::{Line, Ring, Side, Surface};

use glam::{DMat3, DQuat, DVec3};
use std::ops::Deref;

/// Faces of a shape: bit 2 k for the lower face of axis k, bit 2 k + 1 for the upper one.
pub type Faces = u8;

/// The faces of a slice of two dimensions: those that look along x and z.
pub(crate) const PLANE_FACES: Faces = 0b11_0011;

/// Particles of sections and meshes stand at least so far apart, over the spacing.
const APART: f64 = 0.6;

/// The face of a box that looks like a surface with this normal.
fn face(normal: DVec3) -> Faces {
    let axis = normal.abs().max_position();
    1 << (2 * axis + usize::from(normal[axis] > 0.0))
}

/// Where a point lies inside a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inside {
    /// Depth [m].
    pub depth: f64,
    /// Minus the gradient of the depth: the outward normal of the nearest face, blended near edges.
    pub outward: DVec3,
    /// The nearest face.
    pub face: u8,
}

/// A solid's shape in its own frame, centred on its centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A box.
    Box(Cuboid),
    /// A sphere.
    Sphere(Sphere),
    /// A cylinder with flat ends.
    Cylinder(Cylinder),
    /// A round slice, of two dimensions.
    Disc(Disc),
    /// A slice of any section, of two dimensions.
    Polygon(&'static Polygon),
    /// A closed surface of triangles.
    #[cfg(feature = "mesh")]
    Mesh(&'static Mesh),
}

impl Deref for Shape {
    type Target = dyn Geometry;

    fn deref(&self) -> &Self::Target {
        match self {
            Self::Box(shape) => shape,
            Self::Sphere(shape) => shape,
            Self::Cylinder(shape) => shape,
            Self::Disc(shape) => shape,
            Self::Polygon(shape) => *shape,
            #[cfg(feature = "mesh")]
            Self::Mesh(shape) => *shape,
        }
    }
}

impl Shape {
    /// A box of edge lengths `size` [m].
    pub fn cuboid(size: DVec3) -> Self {
        Self::Box(Cuboid { half: 0.5 * size })
    }

    /// Lower and upper corner of the box around it, from its centre of mass [m], where `axes` takes its frame to that of the box.
    pub fn bounds(&self, axes: DMat3) -> (DVec3, DVec3) {
        let to_shape = axes.transpose();
        let end = |way: f64| DVec3::AXES.map(|axis| way * self.reach(to_shape * (way * axis)));
        (end(-1.0).into(), end(1.0).into())
    }

    /// [`Geometry::depth`], for boxes without asking which shape it is at every point.
    #[inline]
    pub fn depth(&self, q: DVec3, faces: Faces) -> Option<Inside> {
        match self {
            Self::Box(shape) => shape.depth(q, faces),
            other => (**other).depth(q, faces),
        }
    }

    /// [`Geometry::nodes`], for boxes with `visit` in line.
    #[inline]
    pub(crate) fn each_node(
        &self,
        line: (DVec3, DVec3, f64),
        faces: Faces,
        least: f64,
        mut visit: impl FnMut(Node, Inside),
    ) {
        match self {
            Self::Box(shape) => shape.each_node(line, faces, least, visit),
            other => other.nodes(line, faces, least, &mut visit),
        }
    }

    /// The box, if it is one: what has no particles of its own lattice, and every wall, is a box.
    pub fn as_cuboid(&self) -> Option<&Cuboid> {
        match self {
            Self::Box(shape) => Some(shape),
            _ => None,
        }
    }
}

/// What is asked of a shape. Points and directions are in its frame.
pub trait Geometry: std::fmt::Debug + Sync {
    /// Its name in a case.
    fn name(&self) -> &'static str;

    /// Volume [m3].
    fn volume(&self) -> f64;

    /// Principal moments of inertia [kg m2] when filled evenly with `mass` [kg].
    fn inertia(&self, mass: f64) -> DVec3;

    /// Radius of the sphere about the centre that holds it [m].
    fn radius(&self) -> f64;

    /// Whether planes tell it apart from what does not touch it.
    fn is_convex(&self) -> bool;

    /// Whether its faces look any way: their numbers say only along which axis they look most.
    fn is_faceted(&self) -> bool {
        !self.is_convex()
    }

    /// Turn from its frame to the one it was given in: of a mesh, from its principal axes to the file's.
    fn frame(&self) -> DQuat {
        DQuat::IDENTITY
    }

    /// Its centre in the coordinates of its file or section [m], before [`Geometry::frame`] is left.
    fn origin(&self) -> DVec3 {
        DVec3::ZERO
    }

    /// Largest coordinate of its points along the unit vector `n` [m].
    fn reach(&self, n: DVec3) -> f64;

    /// Half extents of its bounding box along the axes to which `rotation` turns it [m].
    fn extent(&self, rotation: DMat3) -> DVec3 {
        let to_shape = rotation.transpose();
        let reach = |axis: DVec3| self.reach(to_shape * axis).max(self.reach(to_shape * -axis));
        DVec3::from_array(DVec3::AXES.map(reach))
    }

    /// A lower bound of the distance of `q` from it [m]; negative inside.
    fn outside(&self, q: DVec3) -> f64 {
        self.distance(q).0
    }

    /// Signed distance of `q` from its surface [m] and the gradient: exact outside, minus the depth inside.
    fn distance(&self, q: DVec3) -> (f64, DVec3);

    /// Depth of `q` below those of its `faces` that can be reached; `None` outside.
    fn depth(&self, q: DVec3, faces: Faces) -> Option<Inside>;

    /// Directions among which those are along which it may be told apart from another shape at once.
    fn axes(&self) -> Vec<DVec3>;

    /// Whether the stretch `start` + s `along`, s in 0..`length`, may come within `margin` [m] of it.
    fn line_is_near(&self, start: DVec3, along: DVec3, length: f64, margin: f64) -> bool;

    /// Calls `visit` with every node of the rule that integrates depth^8, and its depth, over the stretch `start` + s `along`, s in 0..`length`. One of which length times
    /// depth^8 stays below `least` may be left out. As it is here that of a convex shape.
    fn nodes(&self, line: (DVec3, DVec3, f64), faces: Faces, _: f64, visit: &mut dyn FnMut(Node, Inside)) {
        let (start, way, length) = line;
        let distance = |s: f64| {
            let (d, gradient) = self.distance(start + s * way);
            (d, gradient.dot(way))
        };
        along(length, distance, |s, width| {
            if let Some(inside) = self.depth(start + s * way, faces) {
                visit(Node::point(s, width), inside);
            }
        });
    }

    /// Corners [m] of one that has some: what of its surface may reach further than the places above its wall layer.
    fn corners(&self) -> Vec<DVec3> {
        Vec::new()
    }

    /// Whether it encloses room that nothing gets into.
    fn has_cavities(&self) -> bool {
        false
    }

    /// Whether `q` lies in such room, or in the solid and nearest to it.
    fn in_cavity(&self, _: DVec3) -> bool {
        false
    }

    /// The same with the sides alone that are not `covered`: asked for places in its frame [m] and the normals there. `None` if
    /// it has all of them, none, or no sides.
    fn uncovered(&self, _spacing: f64, _covered: &dyn Fn(DVec3, DVec3) -> bool) -> Option<Shape> {
        None
    }

    /// Particles about `spacing` [m] apart: the wall layer and what lies below it, hollow beyond `layers`.
    fn particles(&self, spacing: f64, dimensions: u32, layers: i32) -> Particles;

    /// Its surface in pieces shorter than `spacing` [m]: their middles in its frame [m] and outward areas [m2]. `None` of shapes of which each
    /// particle has a face of its own.
    fn pieces(&self, _spacing: f64) -> Option<Box<dyn Iterator<Item = (DVec3, DVec3)> + '_>> {
        None
    }

    /// The particles `wall` of its wall layer with the areas of those pieces of its surface alone that are `free`: asked for places in its frame [m]
    /// and the normals there. `None` of shapes of which each particle has a face of its own.
    fn freed(
        &self,
        _wall: &[DVec3],
        _spacing: f64,
        _free: &dyn Fn(DVec3, DVec3) -> bool,
    ) -> Option<Particles> {
        None
    }

    /// What of its surface presses into other solids; `particles` are its own.
    fn surface(&self, particles: &WallLayer, spacing: f64, dimensions: u32) -> Surface;
}

/// Particles of a shape, in its frame.
#[derive(Clone, Debug, Default)]
pub struct Particles {
    /// Those of the wall layer [m].
    pub wall: Vec<DVec3>,
    /// Those below it [m].
    pub dummy: Vec<DVec3>,
    /// Outward area of each particle of the wall layer [m2]; they sum to zero.
    pub area: Vec<DVec3>,
    /// From each particle of the wall layer to where its pressure acts on the true surface [m]; of one with several faces these tell.
    pub to_surface: Vec<DVec3>,
    /// Those of the wall layer that have several faces.
    pub edges: Edges,
}

impl Particles {
    /// Adds a particle `depth` layers below the wall layer, which is 0.
    fn add(&mut self, depth: i32, at: DVec3, area: DVec3, to_surface: DVec3) {
        if depth > 0 {
            self.dummy.push(at);
            return;
        }
        self.wall.push(at);
        self.area.push(area);
        self.to_surface.push(to_surface);
    }

    /// The faces of particle `k` of the wall layer.
    pub fn faces(&self, k: usize) -> impl Iterator<Item = Face> + use<> {
        self.edges.faces(k, self.area[k], self.to_surface[k])
    }
}

/// The wall layer of a solid: places and what leads from them to the true surface [m].
#[derive(Clone, Copy, Debug)]
pub struct WallLayer<'a> {
    /// Places.
    pub offset: &'a [DVec3],
    /// From each to the surface.
    pub to_surface: &'a [DVec3],
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shapes() -> [Shape; 4] {
        [
            Shape::cuboid(DVec3::new(0.4, 0.2, 0.6)),
            Shape::Sphere(Sphere { radius: 0.3 }),
            Shape::Cylinder(Cylinder { radius: 0.2, half_height: 0.25 }),
            Shape::Disc(Disc { radius: 0.3, width: 0.02 }),
        ]
    }

    fn pseudo(k: u32, n: f64) -> f64 {
        (f64::from(k) * n).fract() - 0.5
    }

    #[test]
    fn the_gradient_of_the_distance_is_its_slope_and_the_depth_its_inside() {
        for shape in shapes() {
            for k in 1..400 {
                let mut q = DVec3::new(pseudo(k, 0.618_034), pseudo(k, 0.754_877), pseudo(k, 0.569_84));
                if matches!(shape, Shape::Disc(_)) {
                    q.y = 0.0;
                }
                let (d, gradient) = shape.distance(q);
                assert_eq!(d < 0.0, shape.depth(q, ALL_FACES).is_some(), "{shape:?} {q}");
                if let Some(inside) = shape.depth(q, ALL_FACES) {
                    assert_eq!((inside.depth, inside.outward), (-d, gradient));
                }
                let h = 1e-7;
                let axes = if matches!(shape, Shape::Disc(_)) {
                    vec![DVec3::X, DVec3::Z]
                } else {
                    DVec3::AXES.to_vec()
                };
                for e in axes {
                    let slope = (shape.distance(q + h * e).0 - shape.distance(q - h * e).0) / (2.0 * h);
                    // three faces of a box within a factor of two of each other keep a kink
                    let kinked = d < 0.0 && gradient.abs().max_element() < 0.99;
                    assert!(
                        kinked || (slope - gradient.dot(e)).abs() < 1e-5,
                        "{shape:?} {q}: {slope} {gradient}"
                    );
                }
            }
        }
    }

    #[test]
    fn areas_close_and_span_the_volume_and_particles_fill_the_shape() {
        for shape in &shapes()[..3] {
            let l0 = 0.02;
            let all = shape.particles(l0, 3, 100);
            let sum: DVec3 = all.area.iter().sum();
            let area: f64 = all.area.iter().map(|a| a.length()).sum();
            assert!(sum.length() < 1e-12 * area, "{shape:?}: {sum}");
            let at = all.wall.iter().zip(&all.to_surface).map(|(x, s)| *x + *s);
            for (k, e) in DVec3::AXES.into_iter().enumerate() {
                let parts = at.clone().zip(&all.area).map(|(x, a)| x[k] * *a);
                let moment: DVec3 = parts.sum();
                let exact = shape.volume() * e;
                // corners of the box's lattice: an area of two faces stands for both at their common edge
                let bound = if shape.as_cuboid().is_some() { 0.2 } else { 1e-9 };
                assert!((moment - exact).length() < bound * shape.volume(), "{shape:?}: {moment} {exact}");
            }
            let count = (all.wall.len() + all.dummy.len()) as f64 * l0.powi(3);
            assert!((count / shape.volume() - 1.0).abs() < 0.05, "{shape:?}: {count}");
            for x in all.wall.iter().chain(&all.dummy) {
                assert!(shape.distance(*x).0 < -0.3 * l0, "{shape:?}: {x}");
            }
        }
    }

    #[test]
    fn reach_is_the_largest_coordinate_of_the_surface() {
        for shape in &shapes()[..3] {
            let all = shape.particles(0.004, 3, 2);
            for k in 1..40 {
                let n =
                    DVec3::new(pseudo(k, 0.618_034), pseudo(k, 0.754_877), pseudo(k, 0.569_84)).normalize();
                let at = all.wall.iter().zip(&all.to_surface).map(|(x, s)| (*x + *s).dot(n));
                let largest = at.fold(f64::NEG_INFINITY, f64::max);
                let reach = shape.reach(n);
                assert!(
                    largest <= reach + 1e-12 && largest > reach - 2e-3,
                    "{shape:?} {n}: {largest} {reach}"
                );
                assert!(reach <= shape.radius() + 1e-12);
            }
        }
    }
}
