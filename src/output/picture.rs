//! A picture of a scene: the water coloured by its speed, bodies in orange, walls that face the viewer in
//! grey. Three dimensions are seen from the right and above, two from the side.

use super::particles::Particles;
use super::render::{Camera, Canvas, water};
use crate::body::Pose;
use crate::fields::Fields;
use crate::scene::{Kind, Scene};
use glam::{DVec3, Vec3};

const WALL: Vec3 = Vec3::new(0.86, 0.87, 0.885);
const MOVING_WALL: Vec3 = Vec3::new(0.55, 0.57, 0.62);
const BODY: Vec3 = Vec3::new(0.93, 0.45, 0.13);
/// Radius of a ball over l0: a little more than half a spacing closes the surface.
const RADIUS: f64 = 0.62;

/// How the pictures of a run are made; the same for all its frames.
#[derive(Clone, Debug)]
pub struct Picture {
    camera: Camera,
    /// Speed of the brightest colour [m/s].
    speed: f64,
    flat: bool,
    /// Fixed walls, drawn once.
    walls: Canvas,
}

impl Picture {
    /// The view of `scene`.
    pub fn new(scene: &Scene) -> Self {
        let flat = scene.dimensions == 2;
        let groups = &scene.groups;
        let drawn = (0..groups.pressure()).chain(groups.moving_dummy_range());
        let (min, max) = drawn
            .map(|slot| scene.position[slot])
            .filter(|x| x.is_finite())
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), x| (min.min(x), max.max(x)));
        let (min, max) = if min.x <= max.x { (min, max) } else { (DVec3::ZERO, DVec3::ONE) };
        let (azimuth, elevation) = if flat { (0.0, 0.0) } else { (0.38, 0.42) };
        let camera = Camera::new(azimuth, elevation, min - scene.spacing, max + scene.spacing);
        let mut walls = Canvas::default();
        for (k, slot) in groups.static_wall_range().enumerate() {
            // Walls between the viewer and the water are left out.
            let normal = scene.static_wall_normal.get(k).copied().unwrap_or(DVec3::ZERO);
            if flat || normal.dot(camera.forward) < -0.05 {
                // Set back a little, so that the wall does not cut into the balls that lie on it.
                let x = scene.position[slot] + 0.5 * scene.spacing * camera.forward;
                let tone = 0.94 + 0.06 * normal.z - 0.07 * normal.x.abs();
                walls.disc(&camera, x, 0.8 * scene.spacing, WALL * tone as f32);
            }
        }
        // The speed of a fall from the surface to the floor; in a dry scene nothing is coloured by it.
        let speed = (2.0 * scene.gravity.length() * scene.depth).sqrt().max(1e-9);
        Self { camera, speed, flat, walls }
    }

    /// The picture as PNG, with solids in `poses` and the water of `fields`.
    pub fn draw(&self, scene: &Scene, poses: &[Pose], fields: Option<&Fields>) -> Vec<u8> {
        let mut canvas = Canvas::default();
        let radius = RADIUS * scene.spacing;
        let solids = Particles::solids(scene, poses, None, self.flat);
        for (x, &kind) in solids.position.iter().zip(&solids.kind) {
            let body = kind == Kind::BodyWall as u8 || kind == Kind::BodyDummy as u8;
            let color = if body { BODY } else { MOVING_WALL };
            canvas.ball(&self.camera, Vec3::from(*x).as_dvec3(), radius, color);
        }
        if let Some(fields) = fields {
            for i in 0..scene.groups.fluid {
                if fields.kind[i] == Kind::Fluid {
                    let color = water((fields.velocity[i].length() / self.speed) as f32);
                    canvas.ball(&self.camera, fields.position[i], radius, color);
                }
            }
        }
        canvas.png(&self.walls, 2.0 * scene.spacing)
    }
}
