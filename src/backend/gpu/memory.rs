//! How much of everything a scene takes on a device: numbers of things, buffers, workgroups.

use super::buffers::{Row, TABLE};
use super::hierarchy::Levels;
use super::layout::{GHOST_BLOCK, MONITOR_WIDTH, WORKGROUP};
use super::parts::{Grain, Split};
use crate::cells::Grid;
use crate::compute::{Host, Id, Program, Spec};
use crate::params::Params;
use crate::plan::{Arrays, Plan};
use crate::scene::Scene;

/// Workgroups that share a reduction at most: every one of them adds the sums of all others.
const REDUCTION_GROUPS_MAX: u64 = 1024;
/// Keys of a scan that a workgroup takes at a time: four a thread.
pub(crate) const SCAN_BLOCK: u64 = 4 * WORKGROUP;
/// Workgroups of a scan at most; they then take several blocks. A GPU is full with them.
pub(crate) const SCAN_GROUPS_MAX: u64 = 1024;

/// Numbers of things that buffers hold.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sizes {
    /// All particles.
    pub total: u64,
    /// Fluid particles.
    pub fluid: u64,
    /// Wall-layer particles of moving solids.
    pub moving_wall: u64,
    /// Wall-layer particles that keep what viscosity, friction and collisions do to them, the first of all.
    pub reacting: u64,
    /// All particles of moving solids.
    pub moving: u64,
    /// Particles that never move.
    pub fixed: u64,
    /// Particles that carry pressure.
    pub pressure: u64,
    /// Those of all ranks together; 0 where there is one.
    pub pressure_of_all: u64,
    /// Cells of the grid.
    pub cells: u64,
    /// Cells of the grid along x, y, z.
    pub grid: [u32; 3],
    /// Moving solids.
    pub solids: u64,
    /// Boxes in which the water comes to rest.
    pub absorbers: u64,
    /// Openings through which water comes in and goes out.
    pub openings: u64,
    /// Most parts of layers that become water in a step.
    pub emissions: u64,
    /// Neighbours of a row at most.
    pub capacity: u64,
    /// Rows of the PPE that a thread takes at least. One fills a GPU best; software pays for every workgroup and
    /// is twice as fast with four.
    pub rows_per_thread: u64,
}

impl Sizes {
    /// Of `scene`.
    pub fn new(scene: &Scene, params: &Params, grid: &Grid, plan: &Plan) -> Self {
        let g = scene.groups;
        Self {
            total: g.total() as u64,
            fluid: g.fluid as u64,
            moving_wall: g.moving_wall as u64,
            reacting: plan.reaction.rows(g.pressure() - g.fluid, g.moving_wall) as u64,
            moving: (g.moving_wall + g.moving_dummy) as u64,
            fixed: g.static_range().len() as u64,
            pressure: g.pressure() as u64,
            pressure_of_all: 0,
            cells: grid.total() as u64,
            grid: grid.count,
            solids: scene.solids.len() as u64,
            absorbers: params.absorbers.len() as u64,
            openings: scene.openings.len() as u64,
            emissions: scene.emissions() as u64,
            capacity: params.row_capacity as u64,
            rows_per_thread: 1,
        }
    }

    /// Of the same scene with a spacing `finer` times as small, nearly: water fills a volume, walls and bodies'
    /// layers line surfaces.
    pub fn refined(&self, finer: f64) -> Self {
        let flat = self.grid[1] == 1;
        let surface = |n: u64| (n as f64 * if flat { finer } else { finer * finer }).round() as u64;
        let volume = |n: u64| (n as f64 * if flat { finer * finer } else { finer.powi(3) }).round() as u64;
        let mut grid = self.grid.map(|n| (f64::from(n) * finer).ceil() as u32);
        if flat {
            grid[1] = 1;
        }
        let (fluid, moving, fixed) = (volume(self.fluid), surface(self.moving), surface(self.fixed));
        Self {
            total: fluid + moving + fixed,
            fluid,
            moving_wall: surface(self.moving_wall),
            reacting: surface(self.reacting),
            moving,
            fixed,
            pressure: fluid + surface(self.pressure - self.fluid),
            cells: grid.iter().map(|&n| u64::from(n)).product(),
            grid,
            ..*self
        }
    }

    /// Particles that the counting sort takes.
    pub fn sorted(&self) -> u64 {
        self.fluid + self.moving
    }

    /// Particles that carry pressure, of which the levels of multigrid are: those of all ranks, which have them in common.
    pub(crate) fn carriers(&self) -> u64 {
        if self.pressure_of_all > 0 { self.pressure_of_all } else { self.pressure }
    }

    /// Keys of the counting sort.
    pub fn keys(&self) -> u64 {
        self.cells + self.fluid.div_ceil(GHOST_BLOCK) + if self.moving > 0 { self.cells } else { 0 }
    }

    /// Workgroups of the conjugate gradients.
    pub fn reduction_groups(&self) -> u64 {
        self.pressure.div_ceil(self.rows_per_thread * WORKGROUP).clamp(1, REDUCTION_GROUPS_MAX)
    }

    /// Workgroups of the monitor: a few particles a thread.
    pub(crate) fn monitor_groups(&self) -> u64 {
        self.fluid.div_ceil(8 * MONITOR_WIDTH).clamp(1, 512)
    }

    /// Chunks of up to [`WORKGROUP`] wall-layer particles of one solid, at most.
    pub(crate) fn force_chunks(&self) -> u64 {
        self.moving_wall.div_ceil(WORKGROUP) + self.solids
    }
}

/// A buffer as it is to be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Allocation {
    /// Which one.
    pub id: Id,
    /// Size.
    pub bytes: u64,
    /// Who else than the shaders touches it.
    pub host: Host,
    /// What it serves.
    pub purpose: &'static str,
    /// What of it stays together where it is divided.
    pub grain: Grain,
}

impl Allocation {
    /// The buffer of a row of the table; of 16 bytes at least, since devices bind no empty buffers.
    fn new(row: &Row, sizes: &Sizes, levels: &Levels) -> Self {
        let Spec { id, size, host, .. } = row.spec;
        let grain = match row.split {
            Split::Whole => Grain::Whole,
            Split::Planes { length, .. } => Grain::Plane((size * length(sizes, levels)).max(16)),
            Split::Ranges => Grain::Element(size),
        };
        let bytes = (size * (row.length)(sizes, levels)).max(16);
        Self { id, bytes, host, purpose: row.purpose, grain }
    }
}

/// Bytes that buffers start with which grow: those of contact with the pairs of solids that come close.
const GROWING_START: u64 = 4096;

/// What a scene takes on a device.
#[derive(Clone, Debug, Default)]
pub struct Memory {
    /// Every buffer.
    pub buffers: Vec<Allocation>,
    /// Workgroups of the largest dispatch.
    pub workgroups: u64,
    /// Workgroups of the largest of the dispatches that are never folded into rows: their number is fixed, since their order of
    /// sums follows it.
    pub strided: u64,
}

impl Memory {
    /// The buffers of `sizes` for the planned stages; of a dry scene only those of contact, if it is planned there.
    pub fn new(s: &Sizes, plan: &Plan) -> Self {
        let of_contact = plan.contact.program.map_or(&[][..], |p| p.buffers).iter();
        let contact = of_contact.map(|&Spec { id, host, .. }| {
            let purpose = "contact, to begin with";
            Allocation { id, bytes: GROWING_START, host, purpose, grain: Grain::Whole }
        });
        if !plan.wet() {
            return Self { buffers: contact.collect(), workgroups: 0, strided: 0 };
        }
        let levels = Levels::new(s);
        let planned = TABLE.iter().filter(|row| plan.needs(row.arrays));
        let of_particles = planned.map(|row| Allocation::new(row, s, &levels));
        let threads = s.pressure.max(s.sorted()).div_ceil(WORKGROUP);
        let scan = s.keys().div_ceil(SCAN_BLOCK).min(SCAN_GROUPS_MAX);
        let of_levels = plan.needs(Arrays::Multigrid).then(|| levels.workgroups());
        let workgroups = [threads, scan, s.force_chunks(), s.solids].into_iter().chain(of_levels);
        let workgroups = workgroups.max().unwrap_or(1);
        let strided = s.reduction_groups().max(s.monitor_groups());
        Self { buffers: of_particles.chain(contact).collect(), workgroups, strided }
    }

    /// With the buffers of `program`, which start small and grow with what they are to hold.
    #[must_use]
    pub(super) fn with(mut self, program: &Program) -> Self {
        let of = |&Spec { id, host, .. }: &Spec| {
            let purpose = "borders of a rank, to begin with";
            Allocation { id, bytes: GROWING_START, host, purpose, grain: Grain::Whole }
        };
        self.buffers.extend(program.buffers.iter().map(of));
        self
    }

    /// All bytes.
    pub fn total(&self) -> u64 {
        self.buffers.iter().map(|b| b.bytes).sum()
    }

    /// Name and bytes of the largest buffer, its parts together.
    pub fn largest(&self) -> (&'static str, u64) {
        self.buffers.iter().max_by_key(|b| b.bytes).map_or(("nothing", 0), |b| (b.id.name(), b.bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The transport case at l0 = 7.5 mm, and nine times as many particles; a good half carries pressure.
    #[test]
    fn large_scenes_fit_what_devices_bind() {
        let scene = |k: u64| Sizes {
            total: 577_000 * k,
            fluid: 211_000 * k,
            moving_wall: 6_000 * k,
            reacting: 6_000 * k,
            moving: 9_000 * k,
            fixed: 357_000 * k,
            pressure: 340_000 * k,
            pressure_of_all: 0,
            cells: 500_000 * k,
            grid: [250, 20 * k as u32, 100],
            solids: 2,
            absorbers: 1,
            openings: 1,
            emissions: 1,
            capacity: 64,
            rows_per_thread: 1,
        };
        let plan = Plan::every_stage();
        let (middle, large) = (Memory::new(&scene(1), &plan), Memory::new(&scene(9), &plan));
        assert!(middle.total() < 207_000_000, "{}", middle.total());
        // What wgpu binds on any adapter, software included.
        assert!(middle.largest().1 <= 128 << 20, "{:?}", middle.largest());
        assert!(large.total() < 2_000_000_000, "{}", large.total());
        assert!(large.largest().1 < (1 << 31) - 1 && large.workgroups < 65_536, "{:?}", large.largest());
        assert_eq!(large.largest().0, "neighbour_list");
    }

    #[test]
    fn a_dry_scene_takes_nothing() {
        assert_eq!(Memory::new(&Sizes::default(), &Plan::no_stage()).total(), 0);
    }
}
