//! A picture of a scene: the water coloured by one of its fields, bodies in orange with a pattern that turns with them,
//! walls as glass.

use super::label::Picture;
use super::particles::Particles;
use super::render::{Camera, Canvas, Layers, View, water};
use crate::body::Pose;
use crate::case::OutputField;
use crate::fields::Fields;
use crate::params::Params;
use crate::scene::{Kind, Scene, Shape, Solid};
use glam::{DMat3, DQuat, DVec3, Vec3};

const WALL: Vec3 = Vec3::new(0.86, 0.87, 0.885);
const MOVING_WALL: Vec3 = Vec3::new(0.55, 0.57, 0.62);
const BODY: [Vec3; 2] = [Vec3::new(0.93, 0.45, 0.13), Vec3::new(1.0, 0.72, 0.42)];
/// Radius of a ball over l0: a little more than half a spacing closes the surface.
const RADIUS: f64 = 0.62;
/// Half of the thickness of a slice over l0: a row that it goes through is alone, and of the two rows that it goes between, as in the middle
/// of a tank, it has both.
const SLICE: f64 = 0.75;

/// What the water is coloured by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Field {
    /// Speed [m/s].
    #[default]
    Speed,
    /// Velocity along an axis [m/s].
    Velocity(usize),
    /// Pressure [Pa].
    Pressure,
    /// Particle number density over that of a full neighbourhood [-].
    Density,
}

impl Field {
    /// Its name for a colour bar.
    pub fn name(self) -> &'static str {
        match self {
            Self::Speed => "speed [m/s]",
            Self::Velocity(0) => "vx [m/s]",
            Self::Velocity(1) => "vy [m/s]",
            Self::Velocity(_) => "vz [m/s]",
            Self::Pressure => "pressure [Pa]",
            Self::Density => "n / n0 [-]",
        }
    }

    /// The field of a file that it is made of.
    pub fn source(self) -> OutputField {
        match self {
            Self::Speed | Self::Velocity(_) => OutputField::Velocity,
            Self::Pressure => OutputField::Pressure,
            Self::Density => OutputField::NumberDensity,
        }
    }

    /// Its value at `drop`; `number_density` is that of a full neighbourhood.
    pub fn of(self, drop: &Drop, number_density: f64) -> f64 {
        match self {
            Self::Speed => drop.velocity.length(),
            Self::Velocity(axis) => drop.velocity[axis],
            Self::Pressure => drop.pressure,
            Self::Density => drop.number_density / number_density,
        }
    }

    /// A range for `values`, which it sorts: all but the most extreme ones have a colour. None for nothing, and for what
    /// has a range of its own.
    pub fn range(self, values: &mut [f64]) -> Option<[f64; 2]> {
        if self == Self::Density {
            return None;
        }
        let pulls = self == Self::Pressure && values.iter().any(|v| *v < 0.0);
        values.iter_mut().for_each(|v| *v = v.abs());
        values.sort_by(f64::total_cmp);
        let most = *values.get((0.995 * values.len() as f64) as usize)?;
        if !(most > 0.0 && most.is_finite()) {
            return None;
        }
        // Two digits, upwards: a bar with round ends.
        let unit = 10_f64.powf(most.log10().floor() - 1.0);
        let most = (most / unit).ceil() * unit;
        Some([if pulls || matches!(self, Self::Velocity(_)) { -most } else { 0.0 }, most])
    }
}

/// How pictures are made.
#[derive(Clone, Debug, PartialEq)]
pub struct Style {
    /// From where.
    pub view: View,
    /// Colour of the water.
    pub field: Field,
    /// Values of its first and last colour; from gravity and depth of the scene if absent.
    pub range: Option<[f64; 2]>,
    /// Leave out all water but that within three quarters of a spacing of a plane: its axis and place [m].
    pub slice: Option<(usize, f64)>,
    /// Write time and colour bar.
    pub labels: bool,
    /// With the bar: where no picture has water there is nothing to read on it.
    pub bar: bool,
    /// Decimals of the time, see [`super::digits`].
    pub decimals: usize,
}

impl Style {
    /// Three dimensions are seen from the right and above, two from the side.
    pub fn of(dimensions: u32) -> Self {
        let (azimuth, elevation) = if dimensions == 2 { (0.0, 0.0) } else { (0.38, 0.42) };
        let view = View { size: [960, 480], azimuth, elevation, zoom: 1.0, target: None };
        Self { view, field: Field::Speed, range: None, slice: None, labels: true, bar: true, decimals: 3 }
    }

    /// Whether water at `x` [m] is drawn, at the spacing `l0` [m].
    fn shows(&self, x: DVec3, l0: f64) -> bool {
        self.slice.is_none_or(|(axis, at)| (x[axis] - at).abs() <= SLICE * l0)
    }
}

/// Makes the pictures of a run; the same view for all its frames.
#[derive(Clone, Debug)]
pub struct Painter {
    camera: Camera,
    style: Style,
    range: [f64; 2],
    number_density: f64,
    /// Width of the slice that a scene of two dimensions is [m].
    slice: Option<f64>,
    /// Fixed walls, drawn once.
    walls: Canvas,
}

/// A water particle of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Drop {
    /// Position [m].
    pub position: DVec3,
    /// Velocity [m/s].
    pub velocity: DVec3,
    /// Pressure [Pa].
    pub pressure: f64,
    /// Particle number density [-].
    pub number_density: f64,
}

impl Painter {
    /// Pictures of `scene` in `style`.
    pub fn new(scene: &Scene, style: &Style, params: &Params) -> Self {
        let flat = scene.dimensions == 2;
        let groups = &scene.groups;
        let drawn = (0..groups.pressure()).chain(groups.moving_dummy_range());
        // Slots that wait for water that comes in stand somewhere.
        let (min, max) = drawn
            .filter(|&slot| scene.kind[slot] != Kind::Ghost)
            .map(|slot| scene.position[slot])
            .filter(|x| x.is_finite())
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), x| (min.min(x), max.max(x)));
        let (min, max) = if min.x <= max.x { (min, max) } else { (DVec3::ZERO, DVec3::ONE) };
        let camera = Camera::new(&style.view, min - scene.spacing, max + scene.spacing);
        let mut walls = Canvas::new(&camera);
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
        // The speed of a fall from the surface to the floor, or of the fastest that starts or is driven; in a dry scene nothing is coloured by it.
        let fall = (2.0 * scene.gravity.length() * scene.depth).sqrt();
        let driven = scene.driven(f64::NEG_INFINITY, f64::INFINITY);
        let speed = fall.max(scene.fastest()).max(driven).max(scene.solids_start()).max(1e-9);
        // Without a weight to compare with, that at a stop.
        let pressure = params.density * if fall > 0.0 { 0.5 * fall * fall } else { 0.5 * speed * speed };
        let range = style.range.unwrap_or(match style.field {
            Field::Speed => [0.0, speed],
            Field::Velocity(_) => [-speed, speed],
            Field::Pressure => [0.0, pressure],
            Field::Density => [0.9, 1.1],
        });
        let slice = flat.then_some(scene.spacing);
        Self { camera, style: style.clone(), range, number_density: params.number_density, slice, walls }
    }

    /// The picture at `time` [s] with the solids of `scene` in `poses` (positions and orientations; none for one that is
    /// left out) and this water.
    pub fn paint(
        &self,
        scene: &Scene,
        time: f64,
        poses: &[Option<(DVec3, DQuat)>],
        drops: impl Iterator<Item = Drop>,
    ) -> Picture {
        let (mut fluid, mut bodies, mut walls) =
            (Canvas::new(&self.camera), Canvas::new(&self.camera), self.walls.clone());
        let l0 = scene.spacing;
        for (solid, pose) in scene.solids.iter().zip(poses) {
            let Some(pose) = *pose else { continue };
            if solid.is_body {
                // A pattern that is fixed to it, so that one sees it turn.
                let octant = |q: DVec3| (q.x > 0.0) ^ (q.y > 0.0) ^ (q.z > 0.0);
                self.solid(&mut bodies, solid, pose, |q| BODY[usize::from(octant(q))]);
            } else {
                self.solid(&mut walls, solid, pose, |_| MOVING_WALL);
            }
        }
        for drop in drops {
            if self.style.shows(drop.position, l0) {
                let place = (self.style.field.of(&drop, self.number_density) - self.range[0])
                    / (self.range[1] - self.range[0]);
                fluid.ball(&self.camera, drop.position, RADIUS * l0, water(place as f32));
            }
        }
        let layers = Layers { water: &fluid, bodies: &bodies, walls: &walls };
        let bytes = layers.pixels(2.0 * l0);
        let mut picture = Picture { width: self.style.view.size[0], bytes };
        if self.style.labels {
            let told = format!("t = {time:.0$} s", self.style.decimals);
            picture.time(&told);
            if self.style.bar && scene.groups.fluid > 0 {
                picture.bar(self.style.field.name(), self.range, &told);
            }
        }
        picture
    }

    fn solid(&self, canvas: &mut Canvas, solid: &Solid, pose: (DVec3, DQuat), paint: impl Fn(DVec3) -> Vec3) {
        let pose = (pose.0 + pose.1 * solid.shape_offset, pose.1);
        match &solid.shape {
            // Its distances are dear to ask for.
            #[cfg(feature = "mesh")]
            Shape::Mesh(mesh) => canvas.faces(&self.camera, mesh.faces(), pose, paint),
            shape => canvas.solid(&self.camera, (shape, self.slice), pose, paint),
        }
    }
}

/// The water of a run in progress.
pub fn drops(scene: &Scene, fields: Option<&Fields>) -> impl Iterator<Item = Drop> {
    fields.into_iter().flat_map(move |f| {
        (0..scene.groups.fluid).filter(move |&i| f.kind[i] == Kind::Fluid).map(move |i| Drop {
            position: f.position[i],
            velocity: f.velocity[i],
            pressure: f.pressure[i],
            number_density: f.number_density[i],
        })
    })
}

/// The water of a frame; what the file does not hold is not a number.
pub fn drops_of(particles: &Particles) -> impl Iterator<Item = Drop> {
    let vector = |v: [f32; 3]| Vec3::from(v).as_dvec3();
    let number = |values: &[f32], i: usize| values.get(i).map_or(f64::NAN, |&x| f64::from(x));
    (0..particles.len()).map(move |i| Drop {
        position: particles.position[i].into(),
        velocity: particles.velocity.get(i).map_or(DVec3::NAN, |&v| vector(v)),
        pressure: number(&particles.pressure, i),
        number_density: number(&particles.number_density, i),
    })
}

/// Positions and orientations of solids in motion.
pub fn placed(poses: &[Pose]) -> Vec<Option<(DVec3, DQuat)>> {
    poses.iter().map(|p| Some((p.position, p.orientation))).collect()
}

/// Positions and orientations of the solids of `scene` from their `particles` in a frame. Of what does not move, and of the
/// walls in openings, a frame needs none; where another solid is, nobody knows if the frame holds nothing of it.
pub fn placed_by(scene: &Scene, particles: &Particles) -> Vec<Option<(DVec3, DQuat)>> {
    let mut pairs: Vec<Vec<(DVec3, DVec3)>> = vec![Vec::new(); scene.solids.len()];
    for ((&body, &id), &x) in particles.body.iter().zip(&particles.id).zip(&particles.position) {
        let Some(k) = (body as usize).checked_sub(1).filter(|&k| k < pairs.len()) else { continue };
        let (solid, slot) = (&scene.solids[k], id as usize);
        let of = |slots: &std::ops::Range<usize>, offsets: &[DVec3]| {
            slot.checked_sub(slots.start).and_then(|n| offsets.get(n).copied())
        };
        let inside = |slots: &std::ops::Range<usize>| slots.contains(&slot);
        let offset = if inside(&solid.wall_slots) {
            of(&solid.wall_slots, &solid.wall_offset)
        } else if inside(&solid.dummy_slots) {
            of(&solid.dummy_slots, &solid.dummy_offset)
        } else {
            None
        };
        pairs[k].extend(offset.map(|o| (o, DVec3::from(x))));
    }
    let fitted = scene.solids.iter().zip(&pairs).enumerate().map(|(k, (solid, pairs))| {
        let moves = k < scene.followed() && (solid.gives_way() || !(solid.is_free() || solid.is_still()));
        let start = (solid.position, solid.orientation);
        fit(pairs).or_else(|| shifted(pairs, start)).or((!moves).then_some(start))
    });
    fitted.collect()
}

/// The pose `start` moved to where the points of `pairs` are, for points that tell no orientation.
fn shifted(pairs: &[(DVec3, DVec3)], start: (DVec3, DQuat)) -> Option<(DVec3, DQuat)> {
    let sum: DVec3 = pairs.iter().map(|&(o, x)| x - start.1 * o).sum();
    (!pairs.is_empty()).then(|| (sum / pairs.len() as f64, start.1))
}

/// Position and orientation that bring the first points of `pairs` nearest to the second ones: the rotation is the
/// orthogonal factor of their covariance (polar decomposition by Newton's iteration).
fn fit(pairs: &[(DVec3, DVec3)]) -> Option<(DVec3, DQuat)> {
    let count = pairs.len() as f64;
    let sum = pairs.iter().fold((DVec3::ZERO, DVec3::ZERO), |(a, b), (o, x)| (a + *o, b + *x));
    let (from, to) = (sum.0 / count, sum.1 / count);
    let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
    let mut covariance = DMat3::ZERO;
    for &(o, x) in pairs {
        covariance += outer(x - to, o - from);
    }
    // Points in a plane say nothing of the third direction: it follows from the other two.
    let [a, b] = farthest(pairs, from)?;
    let normal = |a: DVec3, b: DVec3| a.cross(b).try_normalize();
    let (own, seen) = (normal(a.0, b.0)?, normal(a.1 - to, b.1 - to)?);
    let size = covariance.to_cols_array().iter().fold(0.0_f64, |m, c| m.max(c.abs()));
    let mut rotation = covariance + 0.1 * size * outer(seen, own);
    for _ in 0..40 {
        if rotation.determinant().abs() <= f64::MIN_POSITIVE {
            return None;
        }
        rotation = 0.5 * (rotation + rotation.inverse().transpose());
    }
    let turn = DQuat::from_mat3(&rotation).normalize();
    (turn.is_finite() && rotation.determinant() > 0.5).then(|| (to - turn * from, turn))
}

/// Two pairs that span the widest triangle with the middle of the first points, first points relative to it.
fn farthest(pairs: &[(DVec3, DVec3)], middle: DVec3) -> Option<[(DVec3, DVec3); 2]> {
    let relative = || pairs.iter().map(|&(o, x)| (o - middle, x));
    let a = relative().max_by(|p, q| p.0.length_squared().total_cmp(&q.0.length_squared()))?;
    let area = |p: &(DVec3, DVec3)| a.0.cross(p.0).length_squared();
    let b = relative().max_by(|p, q| area(p).total_cmp(&area(q)))?;
    Some([a, b])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_leaves_out_the_extremes_and_ends_round() {
        let mut speeds: Vec<f64> = (0..1000).map(|k| 1.234 * f64::from(k) / 999.0).collect();
        speeds[0] = 50.0;
        assert_eq!(Field::Speed.range(&mut speeds.clone()), Some([0.0, 1.3]));
        assert_eq!(Field::Velocity(2).range(&mut speeds), Some([-1.3, 1.3]));
        assert_eq!(Field::Speed.range(&mut [0.0, 0.0]), None);
        assert_eq!(Field::Speed.range(&mut []), None);
    }

    #[test]
    fn a_slice_between_two_rows_has_both_and_one_through_a_row_that_alone() {
        let l0 = 0.02;
        let shown = |at: f64| {
            let style = Style { slice: Some((1, at)), ..Style::of(3) };
            // What moves stands a little beside its row.
            let rows = (0..20).map(|k| (f64::from(k) + 0.5) * l0);
            let of_row =
                |y: f64| [-1e-4, -1e-15, 0.0, 1e-4].map(|off| style.shows(DVec3::Y * (y + off * l0), l0));
            rows.flat_map(of_row).filter(|shows| *shows).count()
        };
        assert_eq!([0.2, 0.19, 0.21, 0.1].map(shown), [8, 4, 4, 8]);
        assert!(Style::of(3).shows(DVec3::ONE, l0));
    }

    #[test]
    fn a_pose_is_found_from_the_particles() {
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -2.0, 1.1);
        let at = DVec3::new(1.0, -2.0, 0.5);
        let solid = |flat: bool| -> Vec<(DVec3, DVec3)> {
            let mut pairs = Vec::new();
            for k in 0..60 {
                let part = |n: f64| (f64::from(k) * n).fract() - 0.3;
                let y = if flat { 0.0 } else { part(0.7549) };
                let o = DVec3::new(part(0.618), y, part(0.5698));
                // As a file has it.
                pairs.push((o, (at + turn * o).as_vec3().as_dvec3()));
            }
            pairs
        };
        for flat in [false, true] {
            let (position, orientation) = fit(&solid(flat)).unwrap();
            assert!(position.distance(at) < 1e-5 && orientation.angle_between(turn) < 1e-5, "{flat}");
        }
        assert!(fit(&[]).is_none() && fit(&solid(false)[..1]).is_none());
    }
}
