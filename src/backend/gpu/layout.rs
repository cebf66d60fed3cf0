//! The structs and numbers that the host shares with the shaders.

use super::memory::Sizes;
use crate::cells::Grid;
pub use crate::compute::{MONITOR_WIDTH, WORKGROUP};
use crate::kernels::body_force::missing_head;
use crate::kernels::openings;
use crate::kernels::pressure_source::{compressible_diagonal, laplacian_coefficient};
use crate::monitor::SPEED_BINS;
use crate::neighbourhood::scale;
use crate::params::{Params, Step, Zone};
use crate::pressure::Settings;
use crate::scene::Groups;
use crate::shape::MOST_FACES;
use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3, Vec3};

/// Fluid slots whose ghosts share a key of the counting sort; `GHOST_BLOCK` in shaders/common.wgsl.
pub const GHOST_BLOCK: u64 = 64;
/// Excess of a wall's row whose pressure is no unknown [Pa]; `DRY` in shaders/common.wgsl.
const DRY: f32 = 3.0e38;
/// Fluid particles at most: so many numbers have a word.
pub(crate) const FLUID_MAX: usize = 1 << 30;
/// The word of number 0, 1.0; `FIRST_WORD` in shaders/common.wgsl.
pub const FIRST_WORD: u32 = 0x3f80_0000;

/// Excess of a wall's row as the device has it [Pa]; 0 where the pressure is no unknown, which is told by `DRY` or, beside the surface, by the last bit.
pub(crate) fn excess(kept: f32) -> f64 {
    let unknown = kept < DRY && kept.to_bits() & 1 == 0;
    if unknown { kept.into() } else { 0.0 }
}

/// A number below [`FLUID_MAX`] as the fourth component of a vector: the bits of a normal f32, which no device flushes to zero.
pub(crate) fn word_of(number: u32) -> f32 {
    f32::from_bits(FIRST_WORD + number)
}

/// The number of a word; 0 of 0.0, which stands beside what has no number.
pub(crate) fn number_of(word: f32) -> u32 {
    word.to_bits().max(FIRST_WORD) - FIRST_WORD
}

/// A direction of length 1 as such a word, to 1.3e-4, or that of no length; `direction_word` in shaders/common.wgsl, where the map is told.
pub(crate) fn direction_word(n: DVec3) -> f32 {
    let sum = n.abs().element_sum();
    if sum == 0.0 {
        return word_of(0);
    }
    let p = n.truncate() / sum;
    let p = if n.z < 0.0 { folded(p) } else { p };
    let part = |c: f64| ((c + 1.0) * 16383.0).round() as u32;
    word_of(1 + part(p.x) + (part(p.y) << 15))
}

/// A place on the lower half of the octahedron out in the square, or back; `folded` in shaders/common.wgsl.
fn folded(p: DVec2) -> DVec2 {
    let sign = |c: f64| if c < 0.0 { -1.0 } else { 1.0 };
    DVec2::new((1.0 - p.y.abs()) * sign(p.x), (1.0 - p.x.abs()) * sign(p.y))
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
    pub dynamic_viscosity: f32,
    pub wall_room: f32,
    pub wall_depth: f32,
    pub reacting: u32,
    pub shear_scale: f32,
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
    pub pressure_min: f32,
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

/// A wall-layer particle of a moving solid; see `WallParticle` in shaders/common.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct WallParticle {
    pub area: [f32; 4],
    pub arm: [f32; 4],
    pub to_surface: [f32; 4],
    pub faces: [[[f32; 4]; 2]; MOST_FACES],
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

/// A box in which water is swallowed, but for the room in it; see `Outlet` in shaders/common.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[allow(missing_docs)]
pub struct Outlet {
    pub low: [f32; 4],
    pub high: [f32; 4],
    pub room_low: [f32; 4],
    pub room_high: [f32; 4],
}

impl Outlet {
    /// One that swallows nothing.
    pub const CLOSED: Self =
        Self { low: [1.0; 4], high: [-1.0; 4], room_low: [1.0; 4], room_high: [-1.0; 4] };

    /// That of the host, relative to the `middle` of the domain.
    pub fn new(outlet: &openings::Outlet, middle: DVec3) -> Self {
        let corners = |low: DVec3, high: DVec3| {
            let four = |v: DVec3| (v - middle).as_vec3().extend(0.0).to_array();
            // A box that holds nothing must not become one that does by rounding.
            if low.cmpgt(high).any() { ([1.0; 4], [-1.0; 4]) } else { (four(low), four(high)) }
        };
        let (low, high) = corners(outlet.low, outlet.high);
        let (room_low, room_high) = corners(outlet.room_low, outlet.room_high);
        Self { low, high, room_low, room_high }
    }
}

/// A box in which the water comes to rest; see `AbsorberZone` in shaders/common.wgsl.
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
    pub moves: [[f32; 4]; 3],
    pub crosses: [[f32; 4]; 3],
    pub turns: [[f32; 4]; 3],
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

/// Origin of the device's positions [m]: the middle of the domain, where f32 is finest. In two dimensions
/// the plane y = 0 stays in place.
pub fn middle(params: &Params) -> DVec3 {
    let m = 0.5 * (params.domain_min + params.domain_max);
    if params.dimensions == 2 { DVec3::new(m.x, 0.0, m.z) } else { m }
}

/// What of a place of water f32 cannot hold: three signed bytes, in 256ths of the widest gap between the numbers of the domain,
/// which stand beside the kind of the water as a number below a half. `moved` in shaders/common.wgsl.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Remainder {
    /// [m]
    quantum: f64,
}

impl Remainder {
    /// Of three bytes, as the number that stands for them.
    const SCALE: f32 = (1 << 25) as f32;

    /// In the domain of `params`.
    pub fn new(params: &Params) -> Self {
        let far = (params.domain_max - middle(params)).as_vec3().max_element();
        Self { quantum: f64::from(f32::from_bits(far.to_bits() & 0x7f80_0000)) * (-31.0_f64).exp2() }
    }

    /// A particle of water at `place` from the middle of the domain, as the device keeps it.
    pub fn pack(self, place: DVec3) -> [f32; 4] {
        let at = place.as_vec3();
        let rest = ((place - at.as_dvec3()) / self.quantum).round().to_array();
        let byte = |k: usize| u32::from(rest[k].clamp(-128.0, 127.0) as i8 as u8) << (8 * k);
        [at.x, at.y, at.z, (byte(0) | byte(1) | byte(2)) as f32 / Self::SCALE]
    }

    /// Where a particle is, from the middle of the domain [m]; of one that is no water the fourth number is its kind.
    pub fn place(self, x: &[f32; 4]) -> DVec3 {
        let at = Vec3::new(x[0], x[1], x[2]).as_dvec3();
        if x[3] >= 0.5 {
            return at;
        }
        let bits = (x[3] * Self::SCALE) as u32;
        let rest = |k: u32| f64::from((bits >> (8 * k)) as u8 as i8);
        at + self.quantum * DVec3::new(rest(0), rest(1), rest(2))
    }
}

impl Constants {
    /// In f64 as far as possible, rounded once.
    pub fn new(params: &Params, groups: &Groups, grid: &Grid, settings: &Settings, sizes: &Sizes) -> Self {
        let middle = middle(params);
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
            viscosity: crate::kernels::viscosity::coefficient(params) as f32,
            particle_mass: params.particle_mass() as f32,
            gradient_scale: scale(params) as f32,
            density: params.density as f32,
            tolerance_squared: (settings.tolerance * settings.tolerance) as f32,
            smooth_density: params.smooth_density as f32,
            surface_head: missing_head(params) as f32,
            wall_shear: params.shear.wall as f32,
            wall_friction: params.wall_friction as f32,
            period: period.as_vec3().to_array(),
            inverse_period: inverse.as_vec3().to_array(),
            cell_width: grid.width.as_vec3().to_array(),
            drive: params.drive.as_vec3().to_array(),
            wall_contact: params.wall_contact as f32,
            body_wall: params.body_wall as u32,
            zero: 0.0,
            dynamic_viscosity: (params.density * params.viscosity) as f32,
            wall_room: params.wall_room as f32,
            wall_depth: params.wall_depth as f32,
            reacting: sizes.reacting as u32,
            shear_scale: crate::kernels::viscosity::scale(params) as f32,
        }
    }
}

impl Coefficients {
    /// In f64 as far as possible, rounded once.
    pub fn new(params: &Params, step: &Step) -> Self {
        let per_time = params.density / step.dt;
        // The device's PPE is divided by it.
        let c = laplacian_coefficient(params);
        let range = crate::kernels::monitor::speed_range(params, step.dt);
        Self {
            dt: step.dt as f32,
            source_density: (step.relaxation * per_time / step.dt / c) as f32,
            source_divergence: ((1.0 - step.relaxation) * per_time * scale(params) / c) as f32,
            compressibility: (compressible_diagonal(params, step) / c) as f32,
            pressure_max: step.pressure_max as f32,
            pressure_min: step.pressure_min as f32,
            speed_per_bin: (range / SPEED_BINS as f64) as f32,
            shift_speed: step.shift_speed as f32,
            ahead: step.ahead as f32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn directions_travel_as_words_and_those_of_axes_exactly() {
        // As `direction_of` in shaders/common.wgsl.
        let back = |word: f32| {
            let number = number_of(word);
            if number == 0 {
                return DVec3::ZERO;
            }
            let part = |n: u32| (f64::from(n & 32767) - 16383.0) / 16383.0;
            let p = DVec2::new(part(number - 1), part((number - 1) >> 15));
            let z = 1.0 - p.abs().element_sum();
            (if z < 0.0 { folded(p) } else { p }).extend(z).normalize()
        };
        for axis in DVec3::AXES.into_iter().flat_map(|e| [e, -e]).chain([DVec3::ZERO]) {
            assert_eq!(back(direction_word(axis)), axis);
        }
        let mut off = 0.0_f64;
        for k in 0..10_000 {
            let (z, turn) = (f64::from(k).mul_add(2e-4, 1e-4) - 1.0, 2.4 * f64::from(k));
            let n = DVec3::new((1.0 - z * z).sqrt() * turn.cos(), (1.0 - z * z).sqrt() * turn.sin(), z);
            let word = direction_word(n);
            assert!(word.is_normal());
            off = off.max((back(word) - n).length());
            // In the plane it stays there.
            let flat = DVec3::new(turn.cos(), 0.0, turn.sin());
            assert_eq!(back(direction_word(flat)).y, 0.0);
        }
        assert!(off < 1.3e-4, "{off:e}");
    }

    #[test]
    fn a_place_of_water_keeps_eight_bits_more_than_f32() {
        let remainder = Remainder { quantum: 256.0 * (-31.0_f64).exp2() };
        let gap = 256.0 * (-23.0_f64).exp2();
        for place in [DVec3::new(301.0 + 1e-6, -477.3, 3e-9), DVec3::new(-256.123_456_7, 0.0, 511.999_99)] {
            let x = remainder.pack(place);
            assert_eq!([x[0], x[1], x[2]], place.as_vec3().to_array());
            assert!((0.0..0.5).contains(&x[3]));
            let off = (remainder.place(&x) - place).abs().max_element();
            assert!(off <= gap / 512.0 + 1e-14, "{off} of {gap}");
            assert_eq!(remainder.pack(remainder.place(&x)), x);
        }
        // Half a gap is a tie, and the larger number may be the one that is kept.
        let tie = DVec3::new(300.0 + 0.5 * gap, 300.0 + 1.5 * gap, 0.0);
        assert!((remainder.place(&remainder.pack(tie)) - tie).abs().max_element() <= gap / 256.0);
        assert_eq!(remainder.place(&[1.0, 2.0, 3.0, 5.0]), DVec3::new(1.0, 2.0, 3.0));
    }
}
