//! The energy ledger: what each part of a step did to the energy of the water and of the bodies that move freely.
//!
//! The entries add up to the change of that energy since the start to round-off. Those of the water are summed from
//! single particles, stage by stage ([`crate::kernels::ledger`]), apart from the energy that the monitors measure: that
//! the two agree is what closes the ledger.

use crate::body::{Pose, Wrench};
use crate::checkpoint::Archive;
use crate::error::Result;
use crate::share::Share;

/// A part of the step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry {
    /// What absorbers take from the water.
    Absorber,
    /// Kicks by gravity less what the water falls: what the time integration makes or loses; and what gravity along periodic axes does to water and bodies.
    Gravity,
    /// Explicit viscosity, friction on solids included.
    Viscosity,
    /// Friction on walls, the work on solids that move included.
    Friction,
    /// Collisions of particles.
    Collision,
    /// Pressure as solved, on the water and on what moves in it.
    Pressure,
    /// Cutting of pressures that are negative or beyond the bound.
    Clip,
    /// Shortened displacements and corrections.
    Clamps,
    /// Particles moved away from where they crowd.
    Shift,
    /// Particles taken out.
    Lost,
    /// Put in by solids that follow a table of motion.
    Walls,
    /// What free bodies received less what the water gave them: it gives at the velocity that it was told of, they
    /// receive at the one that they get.
    Exchange,
    /// Contact of solids: damping, friction, integration of springs; and of the bodies' gravity.
    Contact,
}

impl Entry {
    /// All, in the order of the tables.
    pub const ALL: [Self; 13] = [
        Self::Absorber,
        Self::Gravity,
        Self::Viscosity,
        Self::Friction,
        Self::Collision,
        Self::Pressure,
        Self::Clip,
        Self::Clamps,
        Self::Shift,
        Self::Lost,
        Self::Walls,
        Self::Exchange,
        Self::Contact,
    ];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Absorber => "absorber",
            Self::Gravity => "gravity",
            Self::Viscosity => "viscosity",
            Self::Friction => "friction",
            Self::Collision => "collision",
            Self::Pressure => "pressure",
            Self::Clip => "clip",
            Self::Clamps => "clamps",
            Self::Shift => "shift",
            Self::Lost => "lost",
            Self::Walls => "walls",
            Self::Exchange => "exchange",
            Self::Contact => "contact",
        }
    }
}

/// Work of each entry since the start [J].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ledger([f64; Entry::ALL.len()]);

impl Ledger {
    /// Work of `entry` [J].
    pub fn get(&self, entry: Entry) -> f64 {
        self.0[entry as usize]
    }

    /// Add `work` [J] to `entry`.
    pub fn add(&mut self, entry: Entry, work: f64) {
        self.0[entry as usize] += work;
    }

    /// Save the work so far under `name`, or take it over; that of another run it leaves to that.
    pub(crate) fn exchange(&mut self, archive: &mut Archive, name: &str) -> Result<()> {
        if archive.is_of_another() {
            return Ok(());
        }
        let mut entries = Entry::ALL.iter().zip(&mut self.0);
        entries.try_for_each(|(entry, work)| archive.number(&format!("{name}.{}", entry.name()), work))
    }

    /// Sum of all entries [J].
    pub fn total(&self) -> f64 {
        self.0.iter().sum()
    }

    /// Entry by entry with another one.
    pub fn plus(mut self, other: &Self) -> Self {
        self.0.iter_mut().zip(other.0).for_each(|(a, b)| *a += b);
        self
    }

    /// Summed over the ranks.
    pub(crate) fn of_ranks(mut self, share: &Share) -> Self {
        share.sum(&mut self.0);
        self
    }

    /// Books the step of solid `k` = 0.. whose `force` by the water acts for `dt` [s]: the water gave it at the velocity
    /// of `told`; a `free` solid received it on the way from the pose `before` to `after`.
    pub fn solid(&mut self, dt: f64, free: bool, force: &Wrench, poses: [&Pose; 3]) {
        let [told, before, after] = poses;
        let given = dt * power(force, told);
        self.add(Entry::Pressure, given);
        if !free {
            self.add(Entry::Walls, -given);
            return;
        }
        let received = 0.5 * dt * (power(force, before) + power(force, after));
        self.add(Entry::Exchange, received - given);
        self.add(Entry::Contact, -received);
    }
}

/// Power of a wrench on a solid [W].
fn power(wrench: &Wrench, pose: &Pose) -> f64 {
    wrench.force.dot(pose.velocity) + wrench.torque.dot(pose.angular_velocity)
}
