//! Whether a body floats, and where: what its shape displaces, by points spread evenly in it.

use glam::{DMat3, DVec3};
use seixo::params::Params;
use seixo::scene::{Drive, Kind, Scene, Solid};
use serde::Serialize;

/// Points in the box around a body: shares of its volume are right to some thousandths.
const POINTS: u32 = 10_000;

/// Fractions of 1 whose multiples spread evenly in a cube (powers of the root of x^4 = x + 1).
const SPREAD: DVec3 = DVec3::new(0.819_172_513_396_164, 0.671_043_606_703_789, 0.549_700_477_901_97);

/// What a body and the water do to each other, by Archimedes.
#[derive(Serialize)]
pub struct Buoyancy {
    /// Mass of the water that its shape displaces when it is all under [kg].
    all_under_kg: f64,
    /// The same as it stands; nothing where there is no water around it.
    as_it_stands_kg: Option<f64>,
    /// Whether it floats; nothing for one that is held, or as heavy as its water.
    floats: Option<bool>,
    /// How much lower it floats than it stands, as it is turned [m].
    lower_m: Option<f64>,
}

impl Buoyancy {
    /// Of a free body in the water of `params`; none without gravity or water.
    pub fn new(scene: &Scene, solid: &Solid, params: &Params) -> Option<Self> {
        let Drive::Free(free) = &solid.drive else { return None };
        let up = -scene.gravity.normalize_or_zero();
        if up == DVec3::ZERO || scene.groups.fluid == 0 {
            return None;
        }
        let axes = DMat3::from_quat(solid.orientation);
        let (low, high) = solid.shape.bounds(axes);
        let center = solid.shape_center();
        let spread = (0..POINTS).map(|k| (DVec3::splat(0.5) + f64::from(k) * SPREAD).fract());
        let points = spread.map(|part| low + part * (high - low));
        // What a sealed cavity keeps out is displaced too.
        let inside = points.filter(|p| {
            let q = axes.transpose() * *p;
            solid.shape.outside(q) < 0.0 || solid.shape.in_cavity(q)
        });
        let mut heights: Vec<f64> = inside.map(|p| (center + p).dot(up)).collect();
        heights.sort_by(f64::total_cmp);
        if heights.is_empty() {
            return None;
        }
        let volume = if solid.shape.has_cavities() {
            (high - low).element_product() * heights.len() as f64 / f64::from(POINTS)
        } else {
            solid.shape.volume()
        };
        let all = params.density * volume;
        // Ballast in a cavity goes with the body.
        let held = |x: DVec3| solid.shape.in_cavity(axes.transpose() * (x - center));
        let ballast = water(scene).filter(|x| held(*x)).count() as f64 * params.particle_mass();
        let mass = free.mass + ballast;
        let level = level(scene, (center + low, center + high), up, held);
        let under = |level: f64| heights.partition_point(|h| *h <= level) as f64 / heights.len() as f64;
        let moves = (0..3).all(|k| up[k].abs() < 1e-9 || !free.locked_translation[k]);
        // One as heavy as its water does neither.
        let apart = (mass - all).abs() > 1e-3 * all;
        let floats = (moves && mass > 0.0 && apart).then_some(mass < all);
        let line =
            floats.filter(|floats| *floats).map(|_| heights[(mass / all * heights.len() as f64) as usize]);
        Some(Self {
            all_under_kg: all,
            as_it_stands_kg: level.map(|level| all * under(level)),
            floats,
            lower_m: line.zip(level).map(|(line, level)| line - level),
        })
    }

    /// In words, with lengths in `places` decimals.
    pub fn words(&self, places: usize) -> String {
        let here = self.as_it_stands_kg.map_or(String::new(), |kg| format!(", {kg:.3e} kg as it stands"));
        let end = match (self.floats, self.lower_m) {
            (None, _) => String::new(),
            (Some(false), _) => ": its own volume does not carry it".into(),
            (Some(true), None) => ": it floats".into(),
            // No more than is told.
            (Some(true), Some(lower)) if 2.0 * lower.abs() < 0.1_f64.powi(places as i32) => {
                ": it floats as deep as it stands, turned as it is".into()
            }
            (Some(true), Some(lower)) => {
                let side = if lower < 0.0 { "higher" } else { "lower" };
                format!(": it floats {:.places$} m {side}, turned as it is", lower.abs())
            }
        };
        format!("    displaces {:.3e} kg of water when all under{here}{end}", self.all_under_kg)
    }
}

/// Places of the water's particles [m].
fn water(scene: &Scene) -> impl Iterator<Item = DVec3> {
    (0..scene.groups.fluid).filter(|&i| scene.kind[i] == Kind::Fluid).map(|i| scene.position[i])
}

/// Height along `up` [m] of the water within two spacings of a box, beside or below it, but for what the body has `held`; none where there is none.
fn level(scene: &Scene, (low, high): (DVec3, DVec3), up: DVec3, held: impl Fn(DVec3) -> bool) -> Option<f64> {
    let beside = |x: DVec3| {
        let out = (low - x).max(x - high).max(DVec3::ZERO);
        (out - out.dot(up.abs()) * up.abs()).length() < 2.0 * scene.spacing
    };
    let top = water(scene).filter(|x| beside(*x) && !held(*x)).map(|x| x.dot(up)).reduce(f64::max)?;
    // Of a surface that leans the lattice has steps, whose highest particles lie in it.
    let level = up.abs().max_element() > 1.0 - 1e-6;
    Some(if level { top + 0.5 * scene.spacing } else { top })
}
