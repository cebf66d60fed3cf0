//! What the device holds: the structs shared with the shaders, and how much of everything a scene takes.

use super::buffers::{Row, TABLE};
use super::hierarchy::Levels;
use super::parts::{Grain, Split};
use crate::cells::Grid;
use crate::compute::{Host, Id, Program, Spec};
pub use crate::compute::{MONITOR_WIDTH, WORKGROUP};
use crate::kernels::body_force::missing_head;
use crate::kernels::openings;
use crate::monitor::SPEED_BINS;
use crate::neighbours::capacity;
use crate::params::{Params, Step, Zone};
use crate::plan::{Arrays, Plan};
use crate::pressure::Settings;
use crate::scene::{Groups, Scene};
use bytemuck::{Pod, Zeroable};
use glam::DVec3;

/// Workgroups that share a reduction at most: every one of them adds the sums of all others.
const REDUCTION_GROUPS_MAX: u64 = 1024;
/// Keys of a scan that a workgroup takes at a time: four a thread.
pub(crate) const SCAN_BLOCK: u64 = 4 * WORKGROUP;
/// Workgroups of a scan at most; they then take several blocks. A GPU is full with them.
pub(crate) const SCAN_GROUPS_MAX: u64 = 1024;
/// Fluid slots whose ghosts share a key of the counting sort; `GHOST_BLOCK` in shaders/common.wgsl.
pub const GHOST_BLOCK: u64 = 64;
/// Excess of a wall's row whose pressure is no unknown [Pa]; `DRY` in shaders/common.wgsl.
pub(crate) const DRY: f32 = 3.0e38;
/// Fluid particles at most: so many numbers have a word.
pub(crate) const FLUID_MAX: usize = 1 << 30;
/// The word of number 0, 1.0; `FIRST_WORD` in shaders/common.wgsl.
pub const FIRST_WORD: u32 = 0x3f80_0000;

/// A number below [`FLUID_MAX`] as the fourth component of a vector: the bits of a normal f32, which no device flushes to zero.
pub(crate) fn word_of(number: u32) -> f32 {
    f32::from_bits(FIRST_WORD + number)
}

/// The number of a word; 0 of 0.0, which stands beside what has no number.
pub(crate) fn number_of(word: f32) -> u32 {
    word.to_bits().max(FIRST_WORD) - FIRST_WORD
}

/// Places in the buffer of counters.
pub mod counter {
    /// Particles lost since the last look.
    pub const LOST: usize = 0;
    /// Displacements clamped since the last look.
    pub const DISPLACEMENT_CLAMPS: usize = 1;
    /// Pressures clamped since the last look.
    pub const PRESSURE_CLAMPS: usize = 2;
    /// Negative pressures set to zero since the last look.
    pub const NEGATIVE_PRESSURES: usize = 3;
    /// Most neighbours of a row.
    pub const NEIGHBOURS_MAX: usize = 4;
    /// Smallest number of a particle that became non-finite, or `u32::MAX`.
    pub const NON_FINITE: usize = 5;
    /// Smallest slot with more neighbours than a row holds, or `u32::MAX`.
    pub const OVERFLOW: usize = 6;
    /// First of the particles that each outflow has swallowed since the last look.
    pub const SWALLOWED: usize = 8;
    /// Words in the buffer.
    pub const WORDS: usize = SWALLOWED + crate::case::OUTFLOWS_MAX;
    /// Their start values.
    pub const START: [u32; WORDS] = {
        let mut start = [0; WORDS];
        (start[NON_FINITE], start[OVERFLOW]) = (u32::MAX, u32::MAX);
        start
    };
}

/// Constants of a run; see `Constants` in shaders/common.wgsl for the units.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Constants {
    pub gravity: [f32; 3],
    pub spacing: f32,
    pub lower: [f32; 3],
    pub effective_radius: f32,
    pub upper: [f32; 3],
    pub collision_distance: f32,
    pub cells: [u32; 3],
    pub cell_total: u32,
    pub fluid: u32,
    pub moving_wall: u32,
    pub moving: u32,
    pub moving_dummy: u32,
    pub pressure_slots: u32,
    pub capacity: u32,
    pub reduction_groups: u32,
    pub max_iterations: u32,
    pub number_density: f32,
    pub surface_below: f32,
    pub restitution: f32,
    pub viscosity: f32,
    pub particle_mass: f32,
    pub gradient_scale: f32,
    pub density: f32,
    pub tolerance_squared: f32,
    pub smooth_density: f32,
    pub surface_head: f32,
    pub wall_shear: f32,
    pub wall_friction: f32,
    pub period: [f32; 3],
    pub wall_contact: f32,
    pub inverse_period: [f32; 3],
    pub body_wall: u32,
    pub cell_width: [f32; 3],
    pub zero: f32,
    pub drive: [f32; 3],
    pub pad_drive: f32,
}

/// Coefficients of a step; see `Coefficients` in shaders/common.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Coefficients {
    pub dt: f32,
    pub source_density: f32,
    pub source_divergence: f32,
    pub compressibility: f32,
    pub pressure_max: f32,
    pub speed_per_bin: f32,
    pub shift_speed: f32,
    pub ahead: f32,
}

/// State of the conjugate gradients; see `Solve` in shaders/conjugate_gradient.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Solve {
    pub done: u32,
    pub outcome: u32,
    pub iterations: u32,
    pub unknowns: u32,
    pub source_squared: f32,
    pub residual_squared: f32,
    pub true_residual_squared: f32,
    pub rz: f32,
    pub rz_old: f32,
}

/// Pose of a moving solid; see `Pose` in shaders/common.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Pose {
    pub position: [f32; 4],
    pub orientation: [f32; 4],
    pub velocity: [f32; 4],
    pub angular_velocity: [f32; 4],
}

/// A wall-layer particle of a moving solid; see `WallParticle` in shaders/body_force.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct WallParticle {
    pub area: [f32; 4],
    pub arm: [f32; 4],
    pub to_surface: [f32; 4],
}

/// A wall layer that becomes water; see `Emission` in shaders/common.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Emission {
    pub wall: u32,
    pub count: u32,
    pub to: u32,
    pub pad: u32,
    pub shift: [f32; 4],
    pub velocity: [f32; 4],
}

/// A box in which water is swallowed; see `Outlet` in shaders/common.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Outlet {
    pub low: [f32; 4],
    pub high: [f32; 4],
}

impl Outlet {
    /// One that swallows nothing.
    pub const CLOSED: Self = Self { low: [1.0; 4], high: [-1.0; 4] };

    /// That of the host, relative to the `middle` of the domain.
    pub fn new(outlet: &openings::Outlet, middle: DVec3) -> Self {
        if outlet.is_closed() {
            return Self::CLOSED;
        }
        let four = |v: DVec3| v.as_vec3().extend(0.0).to_array();
        Self { low: four(outlet.low - middle), high: four(outlet.high - middle) }
    }
}

/// A box in which the water comes to rest; see `AbsorberZone` in shaders/absorber.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct AbsorberZone {
    pub low: [f32; 4],
    pub high: [f32; 4],
    pub start: [f32; 4],
    pub ramp: [f32; 4],
}

impl AbsorberZone {
    /// `zone` with its places relative to the `middle` of the domain.
    pub fn new(zone: &Zone, middle: DVec3) -> Self {
        let place = |x: DVec3| (x - middle).as_vec3().extend(0.0).to_array();
        Self {
            low: place(zone.low),
            high: place(zone.high),
            start: place(zone.start),
            ramp: zone.ramp.as_vec3().extend(zone.rate as f32).to_array(),
        }
    }
}

/// A free body in the pressure equation; see `FreeBody` in shaders/coupling.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct FreeBody {
    pub inverse_mass: [f32; 4],
    pub inertia_x: [f32; 4],
    pub inertia_y: [f32; 4],
    pub inertia_z: [f32; 4],
    pub force: [f32; 4],
    pub torque: [f32; 4],
    pub first: u32,
    pub count: u32,
    pub solid: u32,
    pub bodies: u32,
}

/// Sums of one workgroup in the ledger: the first entries of [`crate::ledger::Entry`], then the number of lost particles.
pub const LEDGER_WIDTH: u64 = 11;

/// Sums of one workgroup of the monitor; see `MonitorSum` in shaders/monitor.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct MonitorSum {
    pub momentum: [f32; 3],
    pub kinetic: f32,
    pub position: [f32; 3],
    pub density_error: f32,
    pub extent_max: [f32; 3],
    pub density_error_max: f32,
    pub particles: u32,
    pub inner: u32,
    pub speed_squared_max: f32,
    pub pad: u32,
}

/// Coefficient c of the Laplacian, by which the device's PPE is divided [1/m2].
pub fn laplacian_coefficient(params: &Params) -> f64 {
    crate::kernels::pressure_source::laplacian_coefficient(params)
}

/// Origin of the device's positions [m]: the middle of the domain, where f32 is finest. In two dimensions
/// the plane y = 0 stays in place.
pub fn middle(params: &Params) -> DVec3 {
    let m = 0.5 * (params.domain_min + params.domain_max);
    if params.dimensions == 2 { DVec3::new(m.x, 0.0, m.z) } else { m }
}

impl Constants {
    /// In f64 as far as possible, rounded once.
    pub fn new(params: &Params, groups: &Groups, grid: &Grid, settings: &Settings, sizes: &Sizes) -> Self {
        let middle = middle(params);
        let laplacian = laplacian_coefficient(params);
        let period = params.periodic.length();
        let inverse = DVec3::from_array(period.to_array().map(|l| if l > 0.0 { 1.0 / l } else { 0.0 }));
        Self {
            gravity: params.gravity.as_vec3().to_array(),
            spacing: params.spacing as f32,
            lower: (params.domain_min - middle).as_vec3().to_array(),
            effective_radius: params.effective_radius as f32,
            upper: (params.domain_max - middle).as_vec3().to_array(),
            collision_distance: params.collision_distance as f32,
            cells: grid.count,
            cell_total: grid.total() as u32,
            fluid: groups.fluid as u32,
            moving_wall: groups.moving_wall as u32,
            moving: (groups.moving_wall + groups.moving_dummy) as u32,
            moving_dummy: groups.moving_dummy_range().start as u32,
            pressure_slots: groups.pressure() as u32,
            capacity: sizes.capacity as u32,
            reduction_groups: sizes.reduction_groups() as u32,
            max_iterations: settings.max_iterations,
            number_density: params.number_density as f32,
            surface_below: (params.free_surface_threshold * params.number_density) as f32,
            restitution: params.collision_restitution as f32,
            viscosity: (params.viscosity * laplacian) as f32,
            particle_mass: params.particle_mass() as f32,
            gradient_scale: (f64::from(params.dimensions) / params.number_density) as f32,
            density: params.density as f32,
            tolerance_squared: (settings.tolerance * settings.tolerance) as f32,
            smooth_density: params.smooth_density as f32,
            surface_head: missing_head(params) as f32,
            wall_shear: params.wall_shear as f32,
            wall_friction: params.wall_friction as f32,
            period: period.as_vec3().to_array(),
            inverse_period: inverse.as_vec3().to_array(),
            cell_width: grid.width.as_vec3().to_array(),
            drive: params.drive.as_vec3().to_array(),
            wall_contact: params.wall_contact as f32,
            body_wall: params.body_wall as u32,
            zero: 0.0,
            pad_drive: 0.0,
        }
    }
}

impl Coefficients {
    /// In f64 as far as possible, rounded once.
    pub fn new(params: &Params, step: &Step) -> Self {
        let per_time = params.density / step.dt;
        let c = laplacian_coefficient(params);
        let divergence = f64::from(params.dimensions) / params.number_density;
        let range = crate::kernels::monitor::speed_range(params, step.dt);
        Self {
            dt: step.dt as f32,
            source_density: (step.relaxation * per_time / step.dt / c) as f32,
            source_divergence: ((1.0 - step.relaxation) * per_time * divergence / c) as f32,
            compressibility: (step.compressibility * per_time / step.dt / c) as f32,
            pressure_max: step.pressure_max as f32,
            speed_per_bin: (range / SPEED_BINS as f64) as f32,
            shift_speed: step.shift_speed as f32,
            ahead: step.ahead as f32,
        }
    }
}

/// Numbers of things that buffers hold.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sizes {
    /// All particles.
    pub total: u64,
    /// Fluid particles.
    pub fluid: u64,
    /// Wall-layer particles of moving solids.
    pub moving_wall: u64,
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
    /// Neighbours of a row at most.
    pub capacity: u64,
    /// Rows of the PPE that a thread takes at least. One fills a GPU best; software pays for every workgroup and
    /// is twice as fast with four.
    pub rows_per_thread: u64,
}

impl Sizes {
    /// Of `scene`.
    pub fn new(scene: &Scene, params: &Params, grid: &Grid) -> Self {
        let g = scene.groups;
        Self {
            total: g.total() as u64,
            fluid: g.fluid as u64,
            moving_wall: g.moving_wall as u64,
            moving: (g.moving_wall + g.moving_dummy) as u64,
            fixed: g.static_range().len() as u64,
            pressure: g.pressure() as u64,
            pressure_of_all: 0,
            cells: grid.total() as u64,
            grid: grid.count,
            solids: scene.solids.len() as u64,
            absorbers: params.absorbers.len() as u64,
            openings: scene.openings.len() as u64,
            capacity: capacity(params.neighbours) as u64,
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
    use crate::plan::Stage;
    use crate::scheme::Preconditioner;

    /// The transport case at l0 = 7.5 mm, and nine times as many particles; a good half carries pressure.
    #[test]
    fn large_scenes_fit_what_devices_bind() {
        let scene = |k: u64| Sizes {
            total: 577_000 * k,
            fluid: 211_000 * k,
            moving_wall: 6_000 * k,
            moving: 9_000 * k,
            fixed: 357_000 * k,
            pressure: 340_000 * k,
            pressure_of_all: 0,
            cells: 500_000 * k,
            grid: [250, 20 * k as u32, 100],
            solids: 2,
            absorbers: 1,
            openings: 1,
            capacity: 64,
            rows_per_thread: 1,
        };
        let reasons = Stage::ALL.map(|s| (s, Ok("planned"))).to_vec();
        let plan = Plan {
            reasons,
            preconditioner: Preconditioner::Multigrid,
            coupled: true,
            excess: crate::plan::Excess::All,
            contact: Default::default(),
            fixed_walls: true,
            filled: false,
            ledger: false,
        };
        let (middle, large) = (Memory::new(&scene(1), &plan), Memory::new(&scene(9), &plan));
        assert!(middle.total() < 206_000_000, "{}", middle.total());
        // What wgpu binds on any adapter, software included.
        assert!(middle.largest().1 <= 128 << 20, "{:?}", middle.largest());
        assert!(large.total() < 2_000_000_000, "{}", large.total());
        assert!(large.largest().1 < (1 << 31) - 1 && large.workgroups < 65_536, "{:?}", large.largest());
        assert_eq!(large.largest().0, "neighbour_list");
    }

    #[test]
    fn numbers_travel_as_words_that_are_no_denormals_and_no_infinities() {
        let last = FLUID_MAX as u32 - 1;
        for number in [0, 1, (1 << 23) - 1, 1 << 23, (1 << 24) + 1, 80_600_407, last] {
            assert!(word_of(number).is_normal(), "{number}");
            assert_eq!(number_of(word_of(number)), number);
        }
        assert_eq!(word_of(last), f32::MAX);
        assert_eq!(number_of(0.0), 0);
    }

    #[test]
    fn a_dry_scene_takes_nothing() {
        let reasons = Stage::ALL.map(|s| (s, Err("no fluid"))).to_vec();
        let plan = Plan {
            reasons,
            preconditioner: Preconditioner::Jacobi,
            coupled: false,
            excess: crate::plan::Excess::None,
            contact: Default::default(),
            fixed_walls: false,
            filled: false,
            ledger: false,
        };
        assert_eq!(Memory::new(&Sizes::default(), &plan).total(), 0);
    }
}
