//! What ranks would have and say, before anything is computed.

use super::coarse::{self, Columns, Said};
use super::cut::{beyond, check, cut, is_ring, unevenness};
use super::loads::Loads;
use super::model::Model;
use crate::body::Pose;
use crate::cells::Grid;
use crate::cover::driven::DrivenFaces;
use crate::error::Result;
use crate::kernels::multigrid_levels::level_cells;
use crate::params::Params;
use crate::plan::{Plan, Stage};
use crate::scene::{Scene, Solid};
use crate::scheme::Preconditioner;
use crate::slots::Slots;
use glam::DVec3;
use serde::Serialize;

/// What a rank would have at t = 0.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Taken {
    /// Its columns of cells along x: the first, and that after the last.
    pub columns: [u32; 2],
    /// Particles of water that it computes.
    pub water: usize,
    /// Copies of other ranks' particles of water.
    pub copies: usize,
    /// Particles of wall layers that it computes.
    pub walls: usize,
}

/// What ranks with a device each would say at t = 0.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OnDevices {
    /// Messages to each rank beside in a step, and in each iteration of the pressure solver.
    pub messages: [u64; 2],
    /// Bytes of these, from the rank that says most to the one beside it.
    pub message_bytes: [u64; 2],
    /// Rounds in which all ranks gather something, in a step and in each iteration.
    pub rounds: [u64; 2],
    /// Bytes that all ranks together gather in them, for cells of the multigrid.
    pub round_bytes: [u64; 2],
    /// Bytes between the host and the device of a rank with others on both sides, there and back, in a step and in each iteration: borders, the
    /// water of outer columns that may go, and the finest level of the multigrid.
    pub staged_bytes: [u64; 2],
}

/// What ranks would have and say at t = 0, before anything is computed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outlook {
    /// Of each rank.
    pub parts: Vec<Taken>,
    /// Largest share of the water over the mean.
    pub unevenness: f64,
    /// Messages to each rank beside in a step, and in each iteration of the pressure solver.
    pub messages: [u64; 2],
    /// Bytes of these, from the rank that says most to the one beside it.
    pub message_bytes: [u64; 2],
    /// Rounds in which all ranks gather something, in a step and in each iteration.
    pub rounds: [u64; 2],
    /// Bytes that all ranks together gather in them, for cells of the multigrid.
    pub round_bytes: [u64; 2],
    /// What a step would take on CPUs.
    pub model: Model,
    /// The same counts of ranks with a device each.
    pub on_devices: OnDevices,
}

impl Outlook {
    /// That of `ranks` ranks in `scene` as `plan` has it; a scene with a larger spacing than that of `params` stands for one with that.
    ///
    /// # Errors
    /// As [`super::Share::new`].
    pub fn new(ranks: usize, scene: &Scene, params: &Params, plan: &Plan) -> Result<Self> {
        let grid = Grid::over(params);
        check(ranks, plan, params, &grid)?;
        let loads = Loads::new(scene, &grid, params);
        let (groups, columns) = (loads.groups(), grid.count[0] as usize);
        let (water, walls) = (&loads.water[..], &loads.walls[..]);
        let cuts = cut(water, ranks, params);
        let ring = is_ring(ranks, params);
        let of = |load: &[u64], columns: &mut dyn Iterator<Item = u32>| {
            columns.map(|c| load[c as usize]).sum::<u64>() as usize
        };
        let part = |rank: usize| Taken {
            columns: [cuts[rank], cuts[rank + 1]],
            water: of(water, &mut (cuts[rank]..cuts[rank + 1])),
            copies: of(water, &mut beyond(&cuts, rank, ring).into_iter().flatten()),
            walls: of(walls, &mut (cuts[rank]..cuts[rank + 1])),
        };
        let border = |c: &u32| [(*c as usize + columns - 1) % columns, *c as usize];
        let meet = if ring { &cuts[..ranks] } else { &cuts[1..ranks] };
        let most = |of: &[u64]| meet.iter().flat_map(border).map(|c| of[c]).max().unwrap_or(0);
        let (water_at, carriers_at) = (most(water), most(water) + most(walls));
        let count = |stages: &[Stage]| stages.iter().filter(|&&s| plan.has(s)).count() as u64;
        let motions = count(&[Stage::Viscosity, Stage::WallFriction, Stage::Collision]);
        let surface = count(&[Stage::SurfacePressure]);
        let multigrid = u64::from(plan.preconditioner == Preconditioner::Multigrid);
        let filled = u64::from(plan.filled);
        // Water on its way and copies, motion after the stages that change it, states, pressures known, guessed and found, diagonals.
        // The excess of bodies' rows, which is not much beside them.
        let step_messages = 2 + motions + 1 + surface + 2 + multigrid + u64::from(plan.coupled);
        let a_water = 64 + 48 * motions;
        let a_carrier = 1 + 8 * surface + 16 + 4 * multigrid;
        let coupled = u64::from(plan.coupled);
        let bodies = coupled + count(&[Stage::BodyForce]);
        // Levels of the multigrid that are shared have borders; the first one that is not is summed from all ranks
        // on each visit to it.
        let count = level_cells(grid.count);
        let finest = Columns::new(0, ring, cuts.clone());
        let shared = coarse::shared(finest, &count, coarse::wet_cells(&groups, params, &grid));
        let wet: Vec<[u64; 2]> = match multigrid {
            0 => vec![[0; 2]; shared.len() + 1],
            _ => (0..=shared.len()).map(|level| loads.wet_cells(level)).collect(),
        };
        let border: Vec<u64> = wet.iter().map(|[_, border]| *border).collect();
        let said = Said::new(&shared, count.len(), &border, wet[shared.len()][0]);
        // Pressures at the rims of slots are a round of their own, and what forces on driven solids ask for.
        let slots = slot_rounds(scene, params, plan)?;
        let told = Self {
            unevenness: unevenness(water, &cuts),
            parts: (0..ranks).map(part).collect(),
            model: Model::default(),
            messages: [step_messages + multigrid * said.messages[0], 1 + multigrid * (1 + said.messages[1])],
            message_bytes: [
                a_water * water_at + a_carrier * carriers_at + said.message_bytes[0],
                (8 + 4 * multigrid) * carriers_at + said.message_bytes[1],
            ],
            rounds: [
                3 + bodies + coupled + slots + 2 * filled + multigrid * said.rounds[0],
                1 + coupled + multigrid * said.rounds[1],
            ],
            round_bytes: said.round_bytes,
            on_devices: on_devices(
                plan,
                [water_at, carriers_at],
                [grid.count.map(u64::from).iter().product(), wet[0][0]],
                ranks as u64,
                slots,
            ),
        };
        Ok(Self { model: Model::new(&told), ..told })
    }
}

/// How often a step reads pressures of rows for slots, with the solids where they are at the start.
fn slot_rounds(scene: &Scene, params: &Params, plan: &Plan) -> Result<u64> {
    let told = plan.held && plan.has(Stage::BodyForce);
    if !plan.coupled && !told {
        return Ok(0);
    }
    let pose = |solid: &Solid| Pose {
        position: solid.position,
        orientation: solid.orientation,
        velocity: DVec3::ZERO,
        angular_velocity: DVec3::ZERO,
    };
    let poses: Vec<Pose> = scene.solids.iter().map(pose).collect();
    let slots = Slots::new(scene, params, told);
    let mut reads = 0;
    if plan.coupled {
        slots.rows(&poses, |rows| {
            reads += 1;
            Ok(vec![0.0; rows.len()])
        })?;
    }
    let covered = if told { DrivenFaces::new(scene).covered(scene, &poses) } else { Vec::new() };
    let of_forces = match plan.has(Stage::BodyForce) {
        true => slots.reads(&slots.held(&poses, &covered), &poses),
        false => 0,
    };
    Ok(reads + of_forces)
}

/// What devices say of borders with so much water, and with so much that carries pressure; of all cells, and of those with water.
fn on_devices(
    plan: &Plan,
    [water, carriers]: [u64; 2],
    [cells, wet]: [u64; 2],
    ranks: u64,
    slots: u64,
) -> OnDevices {
    let count = |stages: &[Stage]| stages.iter().filter(|&&s| plan.has(s)).count() as u64;
    let motions = count(&[Stage::Viscosity, Stage::WallFriction, Stage::Collision]);
    let (surface, coupled) = (count(&[Stage::SurfacePressure]), u64::from(plan.coupled));
    let (multigrid, filled) =
        (u64::from(plan.preconditioner == Preconditioner::Multigrid), u64::from(plan.filled));
    // A particle of water travels with 40 bytes; its motion is six numbers, all else is one.
    let (travels, motion, number) = (40, 24, 4);
    // Of what carries pressure: the first guess, the vector that finds the end, and the answer to be judged; then the pressure that is left. Of
    // the multigrid which of it is unknown; in each iteration the first sweep beside the vector that is multiplied.
    let shown = surface + 3 + 1 + coupled + multigrid;
    let in_iteration = 1 + multigrid;
    let border = (motion * motions + number) * water + number * shown * carriers;
    // The two outer columns of a slab come to the host and go back, and copies with them.
    // The slots at the borders are listed for the device.
    let lists = 2 * number * (carriers + water);
    let outer = 2 * (2 * travels - number) * water + (travels - number) * water;
    // A bit of each cell, half of a row of 27 entries, in each iteration a residual.
    let round_bytes = [multigrid * (cells / 8 + 14 * number * wet), multigrid * number * wet];
    // A part of it is given, all is taken.
    let levels = round_bytes.map(|bytes| bytes + bytes / ranks);
    OnDevices {
        messages: [3 + motions + shown, in_iteration],
        message_bytes: [travels * water + border, number * in_iteration * carriers],
        rounds: [
            7 + coupled + slots + count(&[Stage::BodyForce]) + 2 * filled + 2 * multigrid,
            2 + 2 * multigrid,
        ],
        round_bytes,
        // On both sides, given and taken.
        staged_bytes: [
            2 * (outer + 2 * border + lists) + levels[0],
            4 * number * in_iteration * carriers + levels[1],
        ],
    }
}
