//! The CPU path as one of many ranks: a part of the water, and all solids.

use super::Cpu;
use super::archive::Saved;
use crate::backend::{Backend, Counters, Ranked};
use crate::cells::Grid;
use crate::checkpoint::Archive;
use crate::error::Result;
use crate::fields::{Fields, insert};
use crate::kernels::openings::Emission;
use crate::ledger::Ledger;
use crate::neighbours::Neighbours;
use crate::output::pieces::Pieces;
use crate::plan::Plan;
use crate::pressure::Settings;
use crate::ranks::{Standing, Team};
use crate::share::{Settled, Share, Start, room};
use glam::DVec3;
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

/// Whether the pressure-carrying slot `i` is computed here: on one rank, or as `share` has it.
pub(super) fn owns(share: Option<&Share>, i: usize) -> bool {
    share.is_none_or(|share| share.owns(i))
}

impl Cpu {
    /// The part of a rank of `team`, which begins with `start`.
    ///
    /// # Errors
    /// [`crate::error::Error::Usage`] for a slab whose cells are more than can be numbered.
    pub fn of_team(team: Arc<dyn Team>, start: &Start, plan: &Plan, settings: Settings) -> Result<Self> {
        let grid = Grid::over(&start.params);
        let mut share = Share::new(team, start, &grid);
        let mut cpu = Self::on_grid(
            share.slab(grid).numbered(&start.params)?,
            &start.scene,
            &start.params,
            plan,
            settings,
        );
        cpu.fields.id[..start.ids.len()].copy_from_slice(&start.ids);
        share.begin(cpu.groups, start.ids.len(), &cpu.fields, &cpu.grid);
        cpu.share = Some(Box::new(share));
        Ok(cpu)
    }

    /// What each rank holds and said.
    pub(super) fn standings(&self) -> Vec<Standing> {
        let Some(share) = &self.share else { return Vec::new() };
        share.gather_all(vec![share.standing(self.live, self.bytes())])
    }

    /// Slots of the water that is computed here: all of it but copies of other ranks'.
    pub(super) fn own(&self) -> Range<usize> {
        self.share.as_ref().map_or(0..self.live, |share| share.own())
    }

    /// Shows the ranks beside this one where the water at their borders is and how it moves.
    pub(super) fn show_motion(&mut self) {
        if let Some(share) = &self.share {
            let Fields { position, velocity, .. } = &mut self.fields;
            share.swap(&mut [&mut &mut position[..], &mut &mut velocity[..]]);
        }
    }

    /// Water that has moved goes to the ranks whose it is now, and copies of that at borders come here.
    pub(super) fn settle(&mut self) {
        let Some(share) = &mut self.share else { return };
        let Settled { water: here, still } = share.settle(&mut self.fields, &self.grid, &self.params);
        if let Some([walls, dummies]) = still {
            let places: Vec<_> = walls.iter().map(|s| (s.position, s.pressure)).collect();
            let dummies: Vec<_> = dummies.iter().map(|s| s.position).collect();
            self.lay_still(&places, &dummies);
            if self.still_reacts {
                // Viscosity has acted in this step already.
                let felt = &mut self.fields.reaction[self.groups.moving_wall..];
                felt.iter_mut().zip(&walls).for_each(|(felt, s)| *felt = s.reaction);
            }
        }
        self.make_room(here.len());
        if let Some(share) = &self.share {
            share.place(&here, &mut self.fields, self.live);
            self.live = here.len();
        }
    }

    /// Slots for `water` particles of water, more if there are fewer: those of solids move up.
    fn make_room(&mut self, water: usize) {
        let (slots, Some(share)) = (self.groups.fluid, &mut self.share) else { return };
        if water <= slots {
            return;
        }
        let more = room(water, share.all().fluid) - slots;
        self.fields.widen(slots, more, self.params.domain_min);
        if !self.imbalance.is_empty() {
            insert(&mut self.imbalance, slots, more, DVec3::ZERO);
        }
        self.groups.fluid += more;
        self.solids.iter_mut().for_each(|solid| solid.move_slots(more as isize, more as isize));
        if let Some((list, _)) = &mut self.fixed {
            list.slot.iter_mut().for_each(|slot| *slot += more as u32);
        }
        // Made anew right after.
        self.neighbours = Neighbours::new(self.groups.pressure());
        share.groups_are(self.groups);
    }

    /// The tank is cut anew: walls that never move are at `walls`, with these pressures, and dummies; cells are those of the slab.
    fn lay_still(&mut self, walls: &[(DVec3, f64)], dummies: &[DVec3]) {
        let before = self.groups;
        if let Some(share) = &self.share {
            // A slab that has become too wide, most of it dry, is one of billions of cells.
            let slab = share.slab(self.grid).numbered(&self.params);
            self.grid = slab.unwrap_or_else(|e| panic!("ranks: {e}"));
        }
        self.fields.lay_still(&before, walls, dummies);
        (self.groups.static_wall, self.groups.static_dummy) = (walls.len(), dummies.len());
        let [from, to] = [before, self.groups].map(|g| g.moving_dummy_range().start as isize);
        self.solids.iter_mut().for_each(|solid| solid.move_slots(0, to - from));
        self.fixed = Self::index_fixed(&self.grid, self.groups, &self.fields.position, &mut self.scratch);
        let carriers = self.groups.pressure() - self.groups.fluid;
        self.excess.lay_still(carriers);
        if self.still_reacts {
            self.fields.reaction.truncate(self.groups.moving_wall);
            self.fields.reaction.resize(carriers, DVec3::ZERO);
        }
        // Made anew right after.
        self.neighbours = Neighbours::new(self.groups.pressure());
        self.share.iter_mut().for_each(|share| share.groups_are(self.groups));
    }

    /// `emissions` with the slots that they have here.
    pub(super) fn emissions_here<'a>(&mut self, emissions: &'a [Emission]) -> Cow<'a, [Emission]> {
        let Some(share) = &self.share else { return Cow::Borrowed(emissions) };
        let all = share.all().fluid;
        let comes: usize = emissions.iter().map(|e| e.wall.len()).sum();
        self.make_room(self.live + comes);
        let fluid = self.groups.fluid;
        let here = |slot: usize| slot + fluid - all;
        let of = |e: &Emission| Emission {
            wall: here(e.wall.start)..here(e.wall.end),
            to: here(e.to),
            ..e.clone()
        };
        emissions.iter().map(of).collect()
    }
}

impl Ranked for Cpu {
    fn share(&self) -> Option<&Share> {
        self.share.as_deref()
    }

    fn team_description(&self) -> String {
        let (ranks, one) = (self.share.as_ref().map_or(1, |share| share.ranks()), self.description());
        let threads = one.strip_prefix("CPU, ").unwrap_or(&one);
        format!("CPU, {ranks} rank{} of {threads}", if ranks == 1 { "" } else { "s" })
    }

    fn write_piece(&mut self, pieces: &Pieces) -> Result<Vec<u64>> {
        let Some(share) = &self.share else { return Ok(Vec::new()) };
        share.write_piece(pieces, &self.fields, &self.params.periodic)
    }

    fn read_walls(&mut self) -> Result<[Vec<f64>; 2]> {
        Ok(self.share.as_ref().map_or_else(Default::default, |share| share.gather_walls(&self.fields)))
    }

    fn keep(&mut self) -> Result<()> {
        let Self { share, fields, .. } = self;
        if let Some(share) = share {
            share.keep(fields);
        }
        Ok(())
    }

    fn recall(&mut self) -> Result<Option<Fields>> {
        let Self { share, fields, params, .. } = self;
        let Some(share) = share.as_mut() else { return Ok(None) };
        let Some(mut kept) = share.gather_kept(fields) else { return Ok(None) };
        kept.wrap(&share.all(), &params.periodic);
        Ok(Some(kept))
    }

    fn dt(&self) -> f64 {
        self.dt
    }

    fn save_all(
        &self,
        archive: &mut Archive,
        mut fields: Fields,
        mut counters: Counters,
        mut work: Option<Ledger>,
        mut dt: f64,
    ) -> Result<()> {
        let fluid = self.share.as_ref().map_or(0, |share| share.all().fluid);
        let (fields, counters) = (&mut fields, &mut counters);
        let saved = Saved { fluid, fields, counters, work: work.as_mut(), dt: &mut dt, lists: None };
        saved.exchange(archive).map(drop)
    }

    fn read_all(&mut self, archive: &mut Archive) -> Result<Fields> {
        let (mut fields, fluid) = match &self.share {
            Some(share) => (share.blank(&self.fields), share.all().fluid),
            None => (self.fields.clone(), self.groups.fluid),
        };
        let work = self.ledger.as_mut().map(|ledger| &mut ledger.work);
        let (counters, dt) = (&mut self.counters, &mut self.dt);
        let saved = Saved { fluid, fields: &mut fields, counters, work, dt, lists: None };
        saved.exchange(archive)?;
        Ok(fields)
    }

    fn restore(&mut self, fields: Option<Fields>) -> Result<()> {
        let Some(share) = self.share.as_mut() else { return Ok(()) };
        if share.rank() > 0 {
            // Those of the first rank are of all since the start of the run.
            self.counters = Counters::new(self.counters.swallowed.len());
            if let Some(ledger) = &mut self.ledger {
                ledger.work = Ledger::default();
            }
        }
        let whole = fields.map(|fields| (fields, self.dt));
        let portion = share.portion(whole, &self.grid, &self.params);
        share.divide_as(&portion);
        self.dt = portion.dt;
        let (walls, dummies) = portion.still_places();
        self.lay_still(&walls, &dummies);
        self.make_room(portion.water());
        let Some(share) = self.share.as_mut() else { return Ok(()) };
        share.take_over(&portion, &mut self.fields);
        // Zero between two steps.
        self.fields.acceleration.fill(DVec3::ZERO);
        self.fields.reaction.fill(DVec3::ZERO);
        share.begin(self.groups, portion.water(), &self.fields, &self.grid);
        self.live = portion.water();
        self.neighbours = Neighbours::new(self.neighbours.rows());
        if self.params.viscosity > 0.0 {
            self.search_again();
        }
        Ok(())
    }
}
