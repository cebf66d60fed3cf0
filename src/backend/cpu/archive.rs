//! The state of the CPU path.

use super::Cpu;
use crate::backend::Counters;
use crate::checkpoint::Archive;
use crate::error::{Error, Result};
use crate::fields::{Fields, State};
use crate::ledger::Ledger;
use crate::neighbours::Neighbours;
use crate::scene::Kind;

/// What is saved of particles, all of them: those of one rank, or of many.
pub(super) struct Saved<'a> {
    /// Slots of the water.
    pub fluid: usize,
    pub fields: &'a mut Fields,
    pub counters: &'a mut Counters,
    pub work: Option<&'a mut Ledger>,
    pub dt: &'a mut f64,
    /// Those of the last step where the next one begins with them.
    pub lists: Option<&'a mut Neighbours>,
}

impl Cpu {
    /// Save the particles, or take them over.
    pub(super) fn exchange(&mut self, archive: &mut Archive) -> Result<()> {
        let Self {
            // Follows from the case.
            params,
            settings: _,
            still_reacts: _,
            first_reacting: _,
            // Found by every solve.
            excess: _,
            lightness: _,
            facing: _,
            outward: _,
            groups,
            solids: _,
            grid: _,
            fixed: _,
            active_set: _,
            share: _,
            // Made anew in every step before it is used.
            poses: _,
            surface_velocity: _,
            free_bodies: _,
            slots: _,
            fluid_start: _,
            coordinates: _,
            moving: _,
            near_fluid: _,
            scratch: _,
            work: _,
            multigrid: _,
            imbalance: _,
            wall_weights: _,
            // The state.
            fields,
            neighbours,
            live,
            counters,
            dt,
            ledger,
        } = self;
        // A state of many ranks has no lists: they are made anew.
        let kept = archive.is_saving() || archive.sections.contains_key("list_start");
        let viscous = params.viscosity > 0.0;
        let saved = Saved {
            fluid: groups.fluid,
            fields,
            counters,
            // Its pressures and accelerations are made anew in every step.
            work: ledger.as_mut().map(|ledger| &mut ledger.work),
            dt,
            lists: Some(neighbours).filter(|_| viscous && kept),
        };
        let count = saved.exchange(archive)?;
        if !archive.is_saving() {
            *live = count;
            if viscous && !kept {
                self.search_again();
            }
        }
        Ok(())
    }

    /// Makes the lists of neighbours for the particles where they are.
    pub(super) fn search_again(&mut self) {
        self.cell_list();
        self.neighbour_list();
    }
}

impl Saved<'_> {
    /// Save it, or take it over; returns how many particles of water there are.
    pub(super) fn exchange(self, archive: &mut Archive) -> Result<usize> {
        let Self { fluid, fields, counters, work, dt, lists: neighbours } = self;
        let Fields {
            position,
            velocity,
            kind,
            id,
            pressure,
            number_density,
            state,
            // Made anew in every step before they are used.
            surface_pressure: _,
            source: _,
            diagonal: _,
            reaction: _,
            acceleration,
            inertia_head,
        } = fields;
        archive.array("position", position, true)?;
        archive.array("velocity", velocity, true)?;
        archive.array("id", id, true)?;
        archive.array("pressure", pressure, true)?;
        archive.array("number_density", number_density, true)?;
        archive.array("acceleration", acceleration, true)?;
        archive.array_of_some("inertia_head", inertia_head)?;
        codes(archive, "kind", kind, |k| k as u8, Kind::from_code)?;
        codes(archive, "state", state, |s| s as u8, State::from_code)?;
        // The lists of the last step serve viscosity, at the start of the next one.
        if let Some(neighbours) = neighbours {
            lists(archive, neighbours, position.len())?;
        }
        counters.exchange(archive)?;
        if let Some(work) = work {
            work.exchange(archive, "ledger.water")?;
        }
        archive.number("dt", dt)?;
        let count = kind.iter().take(fluid).filter(|&&k| k == Kind::Fluid).count();
        let sorted = kind.iter().take(count).all(|&k| k == Kind::Fluid);
        if !archive.is_saving() && (!sorted || id.iter().any(|&i| i as usize >= fluid)) {
            return Err(Error::damaged("the checkpoint's particles are out of order"));
        }
        Ok(count)
    }
}

/// Values that are stored as codes of a byte.
fn codes<T: Copy>(
    archive: &mut Archive,
    name: &str,
    values: &mut [T],
    to: impl Fn(T) -> u8,
    from: impl Fn(u8) -> Option<T>,
) -> Result<()> {
    let mut bytes: Vec<u8> = values.iter().map(|&v| to(v)).collect();
    archive.array(name, &mut bytes, true)?;
    for (value, byte) in values.iter_mut().zip(bytes) {
        *value = from(byte)
            .ok_or_else(|| Error::damaged(format!("the checkpoint's `{name}` holds a code {byte}")))?;
    }
    Ok(())
}

/// Neighbours of all rows; weights and what else belongs to them are made anew before they are used.
fn lists(archive: &mut Archive, neighbours: &mut Neighbours, slots: usize) -> Result<()> {
    let chunks = &mut neighbours.chunks;
    let mut start: Vec<u32> = chunks.iter().flat_map(|c| c.start.iter().copied()).collect();
    let mut dummies: Vec<u32> = chunks.iter().flat_map(|c| c.dummies.iter().copied()).collect();
    let mut neighbour: Vec<u32> = chunks.iter().flat_map(|c| c.neighbour.iter().copied()).collect();
    archive.array("list_start", &mut start, true)?;
    archive.array("list_dummies", &mut dummies, true)?;
    archive.array("list_neighbour", &mut neighbour, false)?;
    if archive.is_saving() {
        return Ok(());
    }
    let wrong = || Error::damaged("the checkpoint's neighbour lists are damaged");
    let (mut starts, mut ends, mut rest) = (&start[..], &dummies[..], &neighbour[..]);
    for chunk in chunks {
        let rows = chunk.rows();
        let (own_starts, other_starts) = starts.split_at(rows + 1);
        let (own_ends, other_ends) = ends.split_at(rows);
        let length = own_starts.last().map_or(0, |&n| n as usize);
        let whole = own_starts.windows(2).zip(own_ends).all(|(s, &d)| s[0] <= d && d <= s[1]);
        let (own, others) = rest.split_at_checked(length).ok_or_else(wrong)?;
        if !whole || own_starts.first() != Some(&0) || own.iter().any(|&j| j as usize >= slots) {
            return Err(wrong());
        }
        chunk.start = own_starts.to_vec();
        chunk.dummies = own_ends.to_vec();
        chunk.neighbour = own.to_vec();
        chunk.weight.clear();
        (starts, ends, rest) = (other_starts, other_ends, others);
    }
    if rest.is_empty() { Ok(()) } else { Err(wrong()) }
}
