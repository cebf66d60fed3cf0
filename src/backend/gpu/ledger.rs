//! The water's part of the energy ledger on the device.

use super::kernels::{ledger as kernel, pressure_gradient};
use super::layout::LEDGER_WIDTH;
use super::{Gpu, buffers, groups};
use crate::error::Result;
use crate::ledger::{Entry, Ledger};
use crate::plan::{Arrays, ParticleStage};

impl Gpu {
    /// Numbers in the sums.
    pub(super) fn ledger_length(&self) -> usize {
        (LEDGER_WIDTH * self.sizes.monitor_groups()) as usize
    }

    /// Books what `stage` is about to do, if the ledger is kept.
    pub(super) fn book(&mut self, stage: ParticleStage) -> Result<()> {
        if !self.plan.needs(Arrays::Ledger) {
            return Ok(());
        }
        let kernel = match stage {
            ParticleStage::Absorber => kernel::absorber_work,
            ParticleStage::Predict => kernel::predict_work,
            ParticleStage::CellList => kernel::lost_work,
            ParticleStage::Correct => kernel::pressure_work,
            ParticleStage::Shift => kernel::shift_work,
            ParticleStage::PressureGradient => return self.as_solved(),
            _ => return Ok(()),
        };
        self.context.pass([(kernel, self.sizes.monitor_groups())])
    }

    /// Books the kick that `stage` has found and `correct` is about to give.
    pub(super) fn book_kick(&mut self, stage: ParticleStage) -> Result<()> {
        if !self.plan.needs(Arrays::Ledger) {
            return Ok(());
        }
        let friction = stage == ParticleStage::WallFriction;
        let kernel = if friction { kernel::friction_work } else { kernel::collision_work };
        self.context.pass([(kernel, self.sizes.monitor_groups())])
    }

    /// The acceleration by the pressure as it was solved.
    fn as_solved(&mut self) -> Result<()> {
        let (fluid, rows) = (self.sizes.fluid, groups(self.sizes.pressure));
        self.context
            .pass([(kernel::as_solved, rows), (pressure_gradient::pressure_gradient, groups(fluid))])?;
        let bytes = buffers::acceleration.size() * fluid;
        self.context.copy(buffers::acceleration, 0, buffers::unclipped, bytes)?;
        self.context.pass([(kernel::as_clipped, rows)])
    }

    /// Work so far, put together in f64.
    pub(super) fn read_ledger(&mut self) -> Result<Option<Ledger>> {
        if !self.plan.needs(Arrays::Ledger) {
            return Ok(None);
        }
        let mut sums = [0.0; LEDGER_WIDTH as usize];
        let parts = self.context.download(buffers::ledger_sum, self.ledger_length())?;
        for part in parts.chunks_exact(sums.len()) {
            sums.iter_mut().zip(part).for_each(|(sum, [s, rest])| *sum += f64::from(*s) + f64::from(*rest));
        }
        let mass = self.params.particle_mass();
        let mut ledger = Ledger::default();
        let [entries @ .., lost] = sums;
        Entry::ALL.into_iter().zip(entries).for_each(|(entry, sum)| ledger.add(entry, mass * sum));
        // Positions on the device count from the middle of the domain.
        ledger.add(Entry::Lost, mass * lost * self.params.gravity.dot(self.middle));
        Ok(Some(ledger))
    }
}
