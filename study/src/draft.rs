//! Draft of a floating box against Archimedes' law.

use super::row::Measured;
use super::time_mean::mean;
use glam::DVec3;
use seixo::checkpoint::Archive;
use seixo::error::{Error, Result};
use seixo::fields::Fields;
use seixo::gauges::level;
use seixo::scene::{Drive, Scene};
use seixo::simulation::Simulation;

/// How far a face may be from level, as the sine of the angle: rounding of an orientation, and no tilt.
const LEVEL: f64 = 1e-6;

/// The first body, a box that floats on one of its faces.
#[derive(Debug)]
pub struct Draft {
    /// Upright edge [m].
    height: f64,
    /// Density over that of the water [-].
    ratio: f64,
    /// From the body's position to the middle of the box, body's frame [m].
    middle: DVec3,
    /// What stands upright at the start, body's frame.
    upright: DVec3,
    /// Times [s], levels of the water and heights of the middle [m].
    seen: Vec<[f64; 3]>,
    tilt: f64,
    speed: f64,
}

impl Draft {
    /// Of the first body of `scene`.
    ///
    /// # Errors
    /// [`Error::Case`] if that is no free box on one of its faces: of any other shape the draft is not the part of its height that its
    /// density is of the water's.
    pub fn new(simulation: &Simulation, scene: &Scene) -> Result<Self> {
        let refused = |what: &str| {
            let text =
                format!("measure.of: `draft` is that of a free box that stands on one of its faces: {what}");
            let remedy =
                "leave `draft` out; `bodies` has heights of every body, and a gauge.level that of the water";
            Err(Error::key("measure.of", text, remedy))
        };
        let Some(body) = scene.solids.first().filter(|solid| solid.is_body) else {
            return refused("the case has no body");
        };
        let of_body = |what: &str| refused(&format!("the first body, `{}`, {what}", body.name));
        let Drive::Free(free) = &body.drive else { return of_body("follows a motion") };
        if !free.gives_way() {
            return of_body("is held");
        }
        let Some(cuboid) = body.shape.as_cuboid() else {
            return of_body(&format!("is a {}", body.shape.name()));
        };
        let upright = body.orientation.inverse() * DVec3::Z;
        let edge = upright.abs();
        if edge.max_element() < 1.0 - LEVEL * LEVEL {
            return of_body("is turned");
        }
        let gravity = simulation.params.gravity;
        if gravity.z >= 0.0 || gravity.truncate().length() > LEVEL * gravity.length() {
            return refused("gravity does not act along -z");
        }
        Ok(Self {
            height: 2.0 * cuboid.half[edge.max_position()],
            ratio: free.mass / body.shape.volume() / simulation.params.density,
            middle: body.shape_offset,
            upright,
            seen: Vec::new(),
            tilt: 0.0,
            speed: 0.0,
        })
    }

    /// Save what was measured so far, or take it over.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] if the state holds none of it.
    pub fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        // What it is of follows from the case.
        let Self { height: _, ratio: _, middle: _, upright: _, seen, tilt, speed } = self;
        archive.array("measure.draft", seen, false)?;
        archive.number("measure.tilt", tilt)?;
        archive.number("measure.speed_body", speed)
    }

    /// As the body and the water, with these `fields`, are now.
    pub fn sample(&mut self, simulation: &Simulation, fields: &Fields) {
        let pose = &simulation.solids.poses()[0];
        let params = &simulation.params;
        // The level where the body is not: a quarter of the way from the tank's corner to its middle.
        let at = simulation
            .case
            .tank
            .as_ref()
            .map_or([0.0, 0.0], |t| [0, 1].map(|k| t.min[k] + 0.125 * (t.max[k] - t.min[k])));
        let (reach, l0) = (params.effective_radius, params.spacing);
        let level = level(fields, &simulation.groups, at, params.dimensions, reach, l0, &params.periodic);
        self.seen.push([simulation.time, level.unwrap_or(f64::NAN), pose.point(self.middle).z]);
        let up = pose.orientation * self.upright;
        self.tilt = self.tilt.max(up.z.clamp(-1.0, 1.0).acos().to_degrees());
        self.speed = self.speed.max(pose.velocity.length());
    }

    /// Puts the results; `spacing` is that of the particles [m].
    pub fn finish(&self, spacing: f64, out: &mut Measured) {
        let over_time = |k: usize| self.seen.iter().map(|d| [d[0], d[k]]).collect::<Vec<_>>();
        let (level, centre) = (mean(&over_time(1)), mean(&over_time(2)));
        let swing = self.seen.iter().map(|d| (d[2] - centre).abs()).fold(0.0, f64::max);
        let Self { height, ratio, .. } = *self;
        let draft = level - (centre - 0.5 * height);
        // What sinks or lies under water has none.
        let of_archimedes = if ratio < 1.0 { ratio * height } else { f64::NAN };
        let draft = if draft < height && ratio < 1.0 { draft } else { f64::NAN };
        out.put("draft [m]", draft);
        out.put("draft of Archimedes [m]", of_archimedes);
        out.put("draft error [-]", (draft / height - ratio).abs());
        out.put("draft error from P = 0 [-]", ((draft - 0.5 * spacing) / height - ratio).abs());
        out.put("draft offset over l0 [-]", (draft - ratio * height) / spacing);
        out.put("swing over height [-]", swing / height);
        out.put("tilt [deg]", self.tilt);
        out.put("speed of the body [m/s]", self.speed);
    }
}
