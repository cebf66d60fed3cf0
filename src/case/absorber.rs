//! Boxes in which the water's velocity is damped.

use super::check::{Checker, face};
use super::{Case, Face, Tank, Vector};
use serde::{Deserialize, Serialize};

/// A box in which the water comes to rest, so that waves do not come back from a wall: dv/dt = -rate s^2 v, where s grows
/// from 0 at the face at which waves come in to 1 at the opposite one.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Absorber {
    /// Lower corner [m].
    pub min: Vector,
    /// Upper corner [m].
    pub max: Vector,
    /// Face at which the damping is full, where the wall is.
    pub towards: Face,
    /// Largest rate of damping [1/s]; 12 sqrt(g d) over its length if absent, d the water's depth: what goes through it and
    /// back has 2 % of its height left, or less.
    #[cfg_attr(test, schemars(extend("exclusiveMinimum" = 0)))]
    pub rate: Option<f64>,
}

impl Absorber {
    /// Axis along which the damping grows, and whether it does so towards larger coordinates.
    pub(crate) fn way(&self) -> (usize, bool) {
        match self.towards {
            Face::XMin => (0, false),
            Face::XMax => (0, true),
            Face::YMin => (1, false),
            Face::YMax => (1, true),
            Face::ZMin => (2, false),
            Face::ZMax => (2, true),
        }
    }

    /// Its length along that axis [m].
    pub(crate) fn length(&self) -> f64 {
        let axis = self.way().0;
        self.max[axis] - self.min[axis]
    }
}

impl Checker<'_> {
    pub(super) fn absorbers(&mut self) {
        let case: &Case = self.case;
        // What of gravity lies along periodic axes makes no depth, and no waves.
        let periodic = case.tank.as_ref().map_or([false; 3], Tank::periodic);
        let is_weightless = (0..3).all(|axis| periodic[axis] || case.run.gravity[axis] == 0.0);
        for (k, absorber) in case.absorber.iter().enumerate() {
            let path = format!("absorber.{k}");
            if case.fluid.is_none() {
                self.add(path.clone(), "there is no [fluid] to damp", "remove the absorber or add [fluid]");
            }
            if let Some(rate) = absorber.rate {
                self.positive(&format!("{path}.rate"), rate, "1/s");
            } else if is_weightless {
                let message = "without gravity across walls there are no waves to take the rate from";
                self.add(path.clone(), message, "add `rate` [1/s]");
            }
            if self.flat() && absorber.way().0 == 1 {
                let message = format!("there is no `{}` in two dimensions", face(absorber.towards));
                self.add(format!("{path}.towards"), message, "allowed: x_min, x_max, z_min, z_max");
            }
            if self.box_edges(&path, &format!("{path}.max"), &absorber.min, &absorber.max) {
                let axis = absorber.way().0;
                let around = case.tank.as_ref().filter(|_| periodic[axis]).map(|t| t.max[axis] - t.min[axis]);
                if let Some(around) = around.filter(|around| absorber.length() > around * (1.0 + 1e-9)) {
                    let message = format!(
                        "it is {} m long in a tank that is periodic after {around} m",
                        absorber.length()
                    );
                    self.add(path.clone(), message, "make it as long as the tank, or shorter");
                }
                self.fits(&path, "the absorber", &absorber.min, &absorber.max);
                let flat = |v: &Vector| [v[0], v[1]];
                self.in_tank(&path, [&absorber.min, &absorber.max].map(flat), "the absorber");
            }
        }
    }
}
