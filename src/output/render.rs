//! A small software renderer: balls and solids in a parallel projection, shaded by light and by depth.

use crate::shape::Shape;
use glam::{DQuat, DVec3, Vec3};

/// Samples along each edge of a pixel.
const SAMPLES: usize = 2;
/// Part of the picture's edge that is left free.
const MARGIN: f64 = 0.03;
/// Part of a wall's own colour where something lies behind it, and of the water's where a body does.
const GLASS: f32 = 0.5;
const CLEAR: f32 = 0.55;
const BACKGROUND: Vec3 = Vec3::new(0.965, 0.97, 0.975);
/// Direction to the light: from the upper left, before the picture (right, up, out of the picture).
const LIGHT: Vec3 = Vec3::new(-0.42, 0.6, 0.68);
/// Steps towards a solid's surface, and how near is there, over the solid's radius.
const STEPS: u32 = 48;
const NEAR: f64 = 1e-4;

/// From where a scene is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Width and height of the picture [pixels].
    pub size: [usize; 2],
    /// Turn to the right about the vertical, from a view along +y [rad].
    pub azimuth: f64,
    /// Height above the horizon [rad].
    pub elevation: f64,
    /// Magnification; at 1 the whole scene fills the picture.
    pub zoom: f64,
    /// Point in the middle of the picture [m]; that of the scene if absent.
    pub target: Option<DVec3>,
}

/// A parallel projection.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Samples across and down.
    samples: [usize; 2],
    /// Middle of the scene [m]: all of a picture is told from it, so that single precision holds the depths of a scene
    /// far from the origin, at the coordinates of a site.
    origin: DVec3,
    right: DVec3,
    up: DVec3,
    /// Into the picture.
    pub forward: DVec3,
    /// Middle of the picture, to the right and up of the origin [m].
    center: [f64; 2],
    /// Samples a metre.
    scale: f64,
}

impl Camera {
    /// Look with `view` at the box from `min` to `max` [m].
    pub fn new(view: &View, min: DVec3, max: DVec3) -> Self {
        let ((sa, ca), (se, ce)) = (view.azimuth.sin_cos(), view.elevation.sin_cos());
        let right = DVec3::new(ca, sa, 0.0);
        let forward = DVec3::new(-sa * ce, ca * ce, -se);
        let up = right.cross(forward);
        let origin = 0.5 * (min + max);
        let samples = view.size.map(|n| n * SAMPLES);
        let free = 1.0 - 2.0 * MARGIN;
        // The box as it is seen is as wide as its edges are together.
        let fit = |k: usize, along: DVec3| free * samples[k] as f64 / along.abs().dot(max - min).max(1e-9);
        Self {
            samples,
            origin,
            right,
            up,
            forward,
            center: view.target.map_or([0.0; 2], |t| [right, up].map(|along| along.dot(t - origin))),
            scale: view.zoom * fit(0, right).min(fit(1, up)),
        }
    }

    /// Column, row [samples] and depth behind the origin [m] of a point.
    fn project(&self, x: DVec3) -> (f64, f64, f64) {
        let x = x - self.origin;
        let column = (self.right.dot(x) - self.center[0]) * self.scale + self.samples[0] as f64 / 2.0;
        let row = self.samples[1] as f64 / 2.0 - (self.up.dot(x) - self.center[1]) * self.scale;
        (column, row, self.forward.dot(x))
    }

    /// The point of the plane through the origin across the view that lies behind a sample.
    fn behind(&self, column: f64, row: f64) -> DVec3 {
        let along = (column - self.samples[0] as f64 / 2.0) / self.scale + self.center[0];
        let up = (self.samples[1] as f64 / 2.0 - row) / self.scale + self.center[1];
        self.origin + along * self.right + up * self.up
    }

    /// A direction as the light sees it: right, up, out of the picture.
    fn seen(&self, n: DVec3) -> Vec3 {
        DVec3::new(n.dot(self.right), n.dot(self.up), -n.dot(self.forward)).as_vec3()
    }
}

/// A layer of a picture in the making.
#[derive(Clone, Debug)]
pub struct Canvas {
    width: usize,
    color: Vec<Vec3>,
    depth: Vec<f32>,
}

fn lit(color: Vec3, normal: Vec3) -> Vec3 {
    color * (0.62 + 0.38 * normal.dot(LIGHT).max(0.0))
}

impl Canvas {
    /// An empty one for `camera`.
    pub fn new(camera: &Camera) -> Self {
        let [width, height] = camera.samples;
        Self { width, color: vec![BACKGROUND; width * height], depth: vec![f32::INFINITY; width * height] }
    }

    fn put(&mut self, at: usize, depth: f64, color: Vec3) {
        if (depth as f32) < self.depth[at] {
            (self.depth[at], self.color[at]) = (depth as f32, color);
        }
    }

    /// Draw a ball at `x` of `radius` [m] in `color` (sRGB, 0 to 1). What is not finite is left out.
    pub fn ball(&mut self, camera: &Camera, x: DVec3, radius: f64, color: Vec3) {
        self.splat(camera, x, radius, |normal| (lit(color, normal), radius * f64::from(normal.z)));
    }

    /// Draw a disc that faces the viewer, in one tone: many of them make a smooth wall.
    pub fn disc(&mut self, camera: &Camera, x: DVec3, radius: f64, color: Vec3) {
        self.splat(camera, x, radius, |_| (color, 0.0));
    }

    /// Draw a ball's outline; `paint` tells colour and height [m] from the normal.
    fn splat(&mut self, camera: &Camera, x: DVec3, radius: f64, paint: impl Fn(Vec3) -> (Vec3, f64)) {
        let (column, row, depth) = camera.project(x);
        // Smaller than a sample, a ball would fall through the grid.
        let r = (radius * camera.scale).max(0.75);
        self.each_sample(camera, (column, row, depth), r, |canvas, at, i, j| {
            let (dx, dy) = ((i as f64 - column) / r, (row - j as f64) / r);
            let rest = 1.0 - dx * dx - dy * dy;
            if rest > 0.0 {
                let (color, height) = paint(Vec3::new(dx as f32, dy as f32, rest.sqrt() as f32));
                canvas.put(at, depth - height, color);
            }
        });
    }

    /// Draw `shape` in a pose; `paint` tells the colour from a point of its surface in its own frame. A shape of two
    /// dimensions has no ends: it is cut to a `slice` of this width along y [m].
    pub fn solid(
        &mut self,
        camera: &Camera,
        (shape, slice): (&Shape, Option<f64>),
        (position, orientation): (DVec3, DQuat),
        paint: impl Fn(DVec3) -> Vec3,
    ) {
        let half = slice.map(|width| 0.5 * width);
        let (center, radius) = (camera.project(position), shape.radius().hypot(half.unwrap_or(0.0)));
        // What is cut is the common part of the shape and of the slice: no nearer than the farther one of them.
        let distance = |q: DVec3| match (half, shape.distance(q)) {
            (Some(half), (distance, _)) if q.y.abs() - half > distance => {
                (q.y.abs() - half, q.y.signum() * DVec3::Y)
            }
            (_, own) => own,
        };
        let to_own = orientation.conjugate();
        let forward = to_own * camera.forward;
        let convex = shape.is_convex();
        self.each_sample(camera, center, radius * camera.scale + 1.0, |canvas, at, i, j| {
            // From before the solid on, each time as far as nothing can be in the way.
            let start = camera.behind(i as f64, j as f64) + (center.2 - radius) * camera.forward;
            let (mut q, mut way) = (to_own * (start - position), 0.0);
            for _ in 0..STEPS {
                let (distance, slope) = distance(q);
                if distance < NEAR * radius {
                    let normal = camera.seen(orientation * slope);
                    canvas.put(at, center.2 - radius + way, lit(paint(q), normal));
                    return;
                }
                // A convex one lies behind the plane across the way to its nearest point, which a ray along a face
                // meets at once; of any other one no more is known than that the ball about `q` is free.
                let towards = if convex { -slope.dot(forward) } else { 1.0 };
                let free = distance / towards;
                way += free;
                if towards <= 0.0 || way > 2.0 * radius {
                    return;
                }
                q += free * forward;
            }
        });
    }

    /// Draw a closed surface of `triangles`, which turn outwards, in a pose; `paint` as of a [`Canvas::solid`].
    pub fn faces(
        &mut self,
        camera: &Camera,
        triangles: impl Iterator<Item = [DVec3; 3]>,
        (position, orientation): (DVec3, DQuat),
        paint: impl Fn(DVec3) -> Vec3,
    ) {
        for own in triangles {
            let normal = orientation * (own[1] - own[0]).cross(own[2] - own[0]).normalize_or_zero();
            if normal.dot(camera.forward) >= 0.0 {
                continue;
            }
            let seen = camera.seen(normal);
            let [a, b, c] = own.map(|x| camera.project(position + orientation * x));
            let twice = |p: (f64, f64), q: (f64, f64), r: (f64, f64)| {
                (q.0 - p.0) * (r.1 - p.1) - (q.1 - p.1) * (r.0 - p.0)
            };
            let flat = |p: (f64, f64, f64)| (p.0, p.1);
            let area = twice(flat(a), flat(b), flat(c));
            if area == 0.0 {
                continue;
            }
            let low = (a.0.min(b.0).min(c.0), a.1.min(b.1).min(c.1));
            let high = (a.0.max(b.0).max(c.0), a.1.max(b.1).max(c.1));
            let middle = (0.5 * (low.0 + high.0), 0.5 * (low.1 + high.1), a.2);
            let half = (0.5 * (high.0 - low.0), 0.5 * (high.1 - low.1));
            self.each_sample_within(camera, middle, half, |canvas, at, i, j| {
                let x = (i as f64, j as f64);
                let share = [(b, c), (c, a), (a, b)].map(|(p, q)| twice(x, flat(p), flat(q)) / area);
                if share.iter().all(|&s| s >= 0.0) {
                    let [u, v, w] = share;
                    let q = u * own[0] + v * own[1] + w * own[2];
                    canvas.put(at, u * a.2 + v * b.2 + w * c.2, lit(paint(q), seen));
                }
            });
        }
    }

    /// Calls `visit` for every sample within `r` samples of a projected point.
    fn each_sample(
        &mut self,
        camera: &Camera,
        point: (f64, f64, f64),
        r: f64,
        visit: impl FnMut(&mut Self, usize, usize, usize),
    ) {
        self.each_sample_within(camera, point, (r, r), visit);
    }

    /// The same within so many samples across and down.
    fn each_sample_within(
        &mut self,
        camera: &Camera,
        (column, row, depth): (f64, f64, f64),
        (across, down): (f64, f64),
        mut visit: impl FnMut(&mut Self, usize, usize, usize),
    ) {
        if !(column.is_finite() && row.is_finite() && depth.is_finite()) {
            return;
        }
        let span = |center: f64, r: f64, end: usize| {
            let low = (center - r).ceil().clamp(0.0, end as f64) as usize;
            let high = (center + r).floor().clamp(-1.0, end as f64 - 1.0) + 1.0;
            low..high as usize
        };
        for j in span(row, down, camera.samples[1]) {
            for i in span(column, across, camera.samples[0]) {
                visit(self, j * self.width + i, i, j);
            }
        }
    }

    fn shade(&self, i: usize, j: usize, length: f32) -> f32 {
        const REACH: isize = 3;
        let depth = self.depth[j * self.width + i];
        if depth == f32::INFINITY {
            return 1.0;
        }
        let height = self.depth.len() / self.width;
        let mut behind = 0.0;
        for (di, dj) in [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (-1, 1), (1, -1), (1, 1)] {
            let (i, j) = (i as isize + REACH * di, j as isize + REACH * dj);
            if (0..self.width as isize).contains(&i) && (0..height as isize).contains(&j) {
                let beside = self.depth[j as usize * self.width + i as usize];
                if beside.is_finite() {
                    behind += ((depth - beside) / length).clamp(0.0, 4.0);
                }
            }
        }
        0.45 + 0.55 * (-0.09 * behind).exp()
    }
}

/// The layers of a picture: each is a canvas of the same camera.
#[derive(Clone, Copy, Debug)]
pub struct Layers<'a> {
    /// The water.
    pub water: &'a Canvas,
    /// Bodies; seen through the water.
    pub bodies: &'a Canvas,
    /// Walls; what is behind them is seen through them.
    pub walls: &'a Canvas,
}

impl Layers<'_> {
    /// One picture, three bytes a pixel in rows. Places that lie more than about `length` [m] behind what is beside
    /// them are darkened, which sets heaps of balls off from each other.
    pub fn pixels(&self, length: f64) -> Vec<u8> {
        let width = self.water.width / SAMPLES;
        let height = self.water.color.len() / self.water.width / SAMPLES;
        let mut bytes = Vec::with_capacity(width * height * 3);
        for row in 0..height {
            for column in 0..width {
                let mut sum = Vec3::ZERO;
                for s in 0..SAMPLES * SAMPLES {
                    let (i, j) = (column * SAMPLES + s % SAMPLES, row * SAMPLES + s / SAMPLES);
                    sum += self.sample(i, j, length as f32);
                }
                let mean = sum / (SAMPLES * SAMPLES) as f32;
                bytes.extend(mean.to_array().map(|c| (255.0 * c.clamp(0.0, 1.0)).round() as u8));
            }
        }
        bytes
    }

    fn sample(&self, i: usize, j: usize, length: f32) -> Vec3 {
        let at = j * self.water.width + i;
        let of = |canvas: &Canvas| (canvas.depth[at], canvas.color[at] * canvas.shade(i, j, length));
        let ((water, body, wall), nothing) =
            ((self.water.depth[at], self.bodies.depth[at], self.walls.depth[at]), f32::INFINITY);
        if water == nothing && body == nothing {
            return of(self.walls).1;
        }
        let own = if body <= water {
            of(self.bodies).1
        } else if body < nothing {
            of(self.bodies).1.lerp(of(self.water).1, CLEAR)
        } else {
            of(self.water).1
        };
        if wall < water.min(body) { own.lerp(of(self.walls).1, GLASS) } else { own }
    }
}

/// From little (0) to much (1): dark blue over teal to pale green, even to the eye (after seaborn's "mako", without its
/// darkest part).
pub fn water(value: f32) -> Vec3 {
    const COLORS: [[u8; 3]; 6] = [
        [0x41, 0x3d, 0x7b],
        [0x37, 0x65, 0x9e],
        [0x34, 0x8f, 0xa7],
        [0x40, 0xb7, 0xad],
        [0x8b, 0xda, 0xb2],
        [0xde, 0xf5, 0xe5],
    ];
    let place = if value.is_finite() { value.clamp(0.0, 1.0) * 5.0 } else { 5.0 };
    let k = (place as usize).min(4);
    let color = |k: usize| Vec3::from(COLORS[k].map(|c| f32::from(c) / 255.0));
    color(k).lerp(color(k + 1), place - k as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Depth and normal of the first point of a box with half edges `half` on the ray from `start` along `forward`.
    fn met(half: DVec3, start: DVec3, forward: DVec3) -> Option<(f64, DVec3)> {
        let (mut enter, mut leave, mut normal) = (f64::NEG_INFINITY, f64::INFINITY, DVec3::ZERO);
        for (k, axis) in DVec3::AXES.into_iter().enumerate() {
            let ends = [-half[k], half[k]].map(|side| (side - start[k]) / forward[k]);
            if ends[0].min(ends[1]) > enter {
                (enter, normal) = (ends[0].min(ends[1]), -axis * forward[k].signum());
            }
            leave = leave.min(ends[0].max(ends[1]));
        }
        (enter < leave).then_some((enter, normal))
    }

    #[test]
    fn faces_of_a_box_are_drawn_at_a_grazing_angle() {
        let half = DVec3::new(0.5, 2.0, 0.3);
        for elevation in [0.5, 0.05, 0.01] {
            let view = View { size: [160, 80], azimuth: 0.02, elevation, zoom: 1.0, target: None };
            let camera = Camera::new(&view, -half, half);
            let mut canvas = Canvas::new(&camera);
            let pose = (DVec3::ZERO, DQuat::IDENTITY);
            canvas.solid(&camera, (&Shape::cuboid(2.0 * half), None), pose, |_| Vec3::ONE);
            let (mut drawn, mut wrong) = (0, 0);
            for at in 0..canvas.depth.len() {
                let (column, row) = ((at % canvas.width) as f64, (at / canvas.width) as f64);
                let seen = met(half, camera.behind(column, row), camera.forward);
                let (depth, color) = seen.map_or((f32::INFINITY, BACKGROUND), |(depth, normal)| {
                    (depth as f32, lit(Vec3::ONE, camera.seen(normal)))
                });
                drawn += usize::from(seen.is_some());
                let same = canvas.depth[at] == depth || (canvas.depth[at] - depth).abs() < 0.05;
                wrong += usize::from(!same || canvas.color[at].distance(color) > 1e-3);
            }
            assert!(drawn > 5000 && wrong < 20, "{elevation}: {wrong} of {drawn} samples");
        }
    }
}
