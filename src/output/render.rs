//! A small software renderer: balls in a parallel projection, shaded by light and by depth.

use glam::{DVec3, Vec3};

/// Width of a picture [pixels].
pub const WIDTH: usize = 960;
/// Height of a picture [pixels].
pub const HEIGHT: usize = 480;
/// Samples along each edge of a pixel.
const SAMPLES: usize = 2;
/// Part of the picture's edge that is left free.
const MARGIN: f64 = 0.03;
/// Part of a wall's own colour where something lies behind it.
const GLASS: f32 = 0.5;
const BACKGROUND: Vec3 = Vec3::new(0.965, 0.97, 0.975);
/// Direction to the light: from the upper left, before the picture (right, up, out of the picture).
const LIGHT: Vec3 = Vec3::new(-0.42, 0.6, 0.68);

/// A parallel projection.
#[derive(Clone, Debug)]
pub struct Camera {
    right: DVec3,
    up: DVec3,
    /// Into the picture.
    pub forward: DVec3,
    center: [f64; 2],
    /// Samples a metre.
    scale: f64,
}

impl Camera {
    /// Look along +y, from `azimuth` to the right and `elevation` above (both in radians), at the box from
    /// `min` to `max` [m].
    pub fn new(azimuth: f64, elevation: f64, min: DVec3, max: DVec3) -> Self {
        let ((sa, ca), (se, ce)) = (azimuth.sin_cos(), elevation.sin_cos());
        let right = DVec3::new(ca, sa, 0.0);
        let forward = DVec3::new(-sa * ce, ca * ce, -se);
        let up = right.cross(forward);
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for corner in 0..8 {
            let pick = |axis: usize| if corner >> axis & 1 == 0 { min[axis] } else { max[axis] };
            let x = DVec3::new(pick(0), pick(1), pick(2));
            for (k, along) in [right, up].into_iter().enumerate() {
                low[k] = low[k].min(along.dot(x));
                high[k] = high[k].max(along.dot(x));
            }
        }
        let free = 1.0 - 2.0 * MARGIN;
        let fit = |pixels: usize, k: usize| free * (pixels * SAMPLES) as f64 / (high[k] - low[k]).max(1e-9);
        Self {
            right,
            up,
            forward,
            center: [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])],
            scale: fit(WIDTH, 0).min(fit(HEIGHT, 1)),
        }
    }

    /// Column, row [samples] and depth [m] of a point.
    fn project(&self, x: DVec3) -> (f64, f64, f64) {
        let column = (self.right.dot(x) - self.center[0]) * self.scale + (WIDTH * SAMPLES) as f64 / 2.0;
        let row = (HEIGHT * SAMPLES) as f64 / 2.0 - (self.up.dot(x) - self.center[1]) * self.scale;
        (column, row, self.forward.dot(x))
    }
}

/// A picture in the making.
#[derive(Clone, Debug)]
pub struct Canvas {
    color: Vec<Vec3>,
    depth: Vec<f32>,
}

impl Default for Canvas {
    fn default() -> Self {
        let samples = WIDTH * HEIGHT * SAMPLES * SAMPLES;
        Self { color: vec![BACKGROUND; samples], depth: vec![f32::INFINITY; samples] }
    }
}

impl Canvas {
    /// Draw a ball at `x` of `radius` [m] in `color` (sRGB, 0 to 1). What is not finite is left out.
    pub fn ball(&mut self, camera: &Camera, x: DVec3, radius: f64, color: Vec3) {
        self.splat(camera, x, radius, |normal| {
            (color * (0.62 + 0.38 * normal.dot(LIGHT).max(0.0)), radius * f64::from(normal.z))
        });
    }

    /// Draw a disc that faces the viewer, in one tone: many of them make a smooth wall.
    pub fn disc(&mut self, camera: &Camera, x: DVec3, radius: f64, color: Vec3) {
        self.splat(camera, x, radius, |_| (color, 0.0));
    }

    /// Draw a ball's outline; `paint` tells colour and height [m] from the normal.
    fn splat(&mut self, camera: &Camera, x: DVec3, radius: f64, paint: impl Fn(Vec3) -> (Vec3, f64)) {
        let (column, row, depth) = camera.project(x);
        if !(column.is_finite() && row.is_finite() && depth.is_finite()) {
            return;
        }
        // Smaller than a sample, a ball would fall through the grid.
        let r = (radius * camera.scale).max(0.75);
        let span = |center: f64, end: usize| {
            let low = (center - r).ceil().clamp(0.0, end as f64) as usize;
            let high = (center + r).floor().clamp(-1.0, end as f64 - 1.0) + 1.0;
            low..high as usize
        };
        for j in span(row, HEIGHT * SAMPLES) {
            for i in span(column, WIDTH * SAMPLES) {
                let (dx, dy) = ((i as f64 - column) / r, (row - j as f64) / r);
                let rest = 1.0 - dx * dx - dy * dy;
                if rest <= 0.0 {
                    continue;
                }
                let normal = Vec3::new(dx as f32, dy as f32, rest.sqrt() as f32);
                let (color, height) = paint(normal);
                let z = (depth - height) as f32;
                let at = j * WIDTH * SAMPLES + i;
                if z < self.depth[at] {
                    self.depth[at] = z;
                    self.color[at] = color;
                }
            }
        }
    }

    /// The picture as PNG, before and behind the `walls`, which are seen through where they stand in front.
    /// Places that lie more than about `length` [m] behind what is beside them are darkened, which sets heaps
    /// of balls off from each other.
    pub fn png(&self, walls: &Self, length: f64) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(WIDTH * HEIGHT * 3);
        for row in 0..HEIGHT {
            for column in 0..WIDTH {
                let mut sum = Vec3::ZERO;
                for s in 0..SAMPLES * SAMPLES {
                    let (i, j) = (column * SAMPLES + s % SAMPLES, row * SAMPLES + s / SAMPLES);
                    let at = j * WIDTH * SAMPLES + i;
                    let wall = || walls.color[at] * walls.shade(i, j, length as f32);
                    let glass = match (self.depth[at], walls.depth[at]) {
                        (f32::INFINITY, _) => 1.0,
                        (own, wall) if wall < own => GLASS,
                        _ => 0.0,
                    };
                    sum += if glass == 1.0 {
                        wall()
                    } else {
                        let own = self.color[at] * self.shade(i, j, length as f32);
                        if glass > 0.0 { own.lerp(wall(), glass) } else { own }
                    };
                }
                let mean = sum / (SAMPLES * SAMPLES) as f32;
                bytes.extend(mean.to_array().map(|c| (255.0 * c.clamp(0.0, 1.0)).round() as u8));
            }
        }
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, WIDTH as u32, HEIGHT as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder
            .write_header()
            .and_then(|mut writer| writer.write_image_data(&bytes).and_then(|()| writer.finish()))
            .expect("a Vec takes everything");
        file
    }

    fn shade(&self, i: usize, j: usize, length: f32) -> f32 {
        const REACH: isize = 3;
        let depth = self.depth[j * WIDTH * SAMPLES + i];
        if depth == f32::INFINITY {
            return 1.0;
        }
        let mut behind = 0.0;
        for (di, dj) in [(-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (-1, 1), (1, -1), (1, 1)] {
            let (i, j) = (i as isize + REACH * di, j as isize + REACH * dj);
            if (0..(WIDTH * SAMPLES) as isize).contains(&i) && (0..(HEIGHT * SAMPLES) as isize).contains(&j) {
                let beside = self.depth[j as usize * WIDTH * SAMPLES + i as usize];
                if beside.is_finite() {
                    behind += ((depth - beside) / length).clamp(0.0, 4.0);
                }
            }
        }
        0.45 + 0.55 * (-0.09 * behind).exp()
    }
}

/// Water from still (0) to fast (1): dark blue over teal to pale green, even to the eye (after seaborn's
/// "mako", without its darkest part).
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
