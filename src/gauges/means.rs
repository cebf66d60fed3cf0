//! Means over time of what gauges read: what a sensor that is slower than the steps would tell, and with forces the impulse.

use super::Readings;
use crate::body::Wrench;
use crate::checkpoint::Archive;
use crate::error::Result;
use glam::DVec3;

/// Sums over the steps since the last row, each with its length.
#[derive(Clone, Debug, Default)]
pub(super) struct Means {
    /// Of the steps in the sums [s].
    seconds: f64,
    /// One a pressure gauge [Pa s].
    pressure: Vec<f64>,
    /// Impulse and its moment, one a force gauge [N s, N m s].
    impulse: Vec<[f64; 6]>,
    /// The same of other solids.
    contact: Vec<[f64; 6]>,
}

impl Means {
    /// Count `readings` of a step `dt` [s] long.
    pub fn add(&mut self, readings: &Readings, dt: f64) {
        self.seconds += dt;
        self.pressure.resize(readings.pressure.len(), 0.0);
        self.pressure.iter_mut().zip(&readings.pressure).for_each(|(sum, p)| *sum += dt * p);
        for (sums, wrenches) in
            [(&mut self.impulse, &readings.wrench), (&mut self.contact, &readings.contact)]
        {
            sums.resize(wrenches.len(), [0.0; 6]);
            for (sum, Wrench { force, torque }) in sums.iter_mut().zip(wrenches) {
                let parts = force.to_array().into_iter().chain(torque.to_array());
                sum.iter_mut().zip(parts).for_each(|(sum, part)| *sum += dt * part);
            }
        }
    }

    /// The means; none before a step.
    pub fn value(&self) -> Option<Readings> {
        let over = |sum: &f64| sum / self.seconds;
        let wrench = |i: &[f64; 6]| Wrench {
            force: DVec3::from_slice(i) / self.seconds,
            torque: DVec3::from_slice(&i[3..]) / self.seconds,
        };
        (self.seconds > 0.0).then(|| Readings {
            pressure: self.pressure.iter().map(over).collect(),
            wrench: self.impulse.iter().map(wrench).collect(),
            contact: self.contact.iter().map(wrench).collect(),
        })
    }

    /// Save the sums, or take them over.
    ///
    /// # Errors
    /// As [`Archive::array`].
    pub fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        archive.number("gauges.seconds", &mut self.seconds)?;
        archive.array("gauges.pressure", &mut self.pressure, false)?;
        archive.array("gauges.impulse", &mut self.impulse, false)?;
        archive.array("gauges.contact", &mut self.contact, false)
    }
}
