// What the kernels share: the constants of a run, the coefficients of a step, the slots of the particle groups and the
// functions of a pair. Appended to every kernel's file, so that line numbers in messages stay those of the file.
//
// Positions are relative to the middle of the domain: f32 then resolves them to half the spacing of numbers that
// absolute ones would have. Sums over neighbours take r_j - r_i first.

const WORKGROUP: u32 = 256u;

// Fluid slots whose ghosts share a key of the counting sort; as crate::backend::gpu::layout::GHOST_BLOCK.
const GHOST_BLOCK: u32 = 64u;

// Kind of a particle, in position.w; as crate::scene::Kind. To that of water the rest of its place is added, see `moved`.
const FLUID: f32 = 0.0;
const GHOST: f32 = 5.0;
//#if RANKS
// Of a copy of what another rank computes, water or wall: a neighbour, of which nothing is computed here. No kind of the scene.
const FOREIGN: f32 = 6.0;
//#endif

// Part in the PPE, as crate::fields::State.
const INACTIVE: u32 = 0u;
const SURFACE: u32 = 1u;
const INNER: u32 = 2u;
// Excess of a wall's row whose pressure is no unknown; DRY in src/backend/gpu/layout.rs.
const DRY: f32 = 3.0e38;
const LARGEST: f32 = 3.4e38;

// What stands in the place of its excess if it is a solid's beside the water's surface, with a pressure that is known: less that pressure, with
// the last bit set, which an excess has not.
fn known_row(known: f32) -> f32 {
    // A normal number, which no device flushes to zero.
    let kept = select(-known, 1.0e-30, abs(known) < 1.0e-30);
    return bitcast<f32>(bitcast<u32>(kept) | 1u);
}

fn unknown_row(excess: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(excess) & 0xfffffffeu);
}

fn is_known_row(excess: f32) -> bool {
    return (bitcast<u32>(excess) & 1u) == 1u;
}

// As crate::kernels::predict::DISPLACEMENT_MAX and crate::kernels::number_density::CLOSEST.
const DISPLACEMENT_MAX: f32 = 0.5;
const CLOSEST: f32 = 0.1;

// As crate::neighbourhood::EIGENVALUE_MIN.
const EIGENVALUE_MIN: f32 = 0.1;

// Places in `counters`, as crate::backend::gpu::layout::counter.
const LOST: u32 = 0u;
const DISPLACEMENT_CLAMPS: u32 = 1u;
const PRESSURE_CLAMPS: u32 = 2u;
const NEGATIVE_PRESSURES: u32 = 3u;
const NEIGHBOURS_MAX: u32 = 4u;
const NON_FINITE: u32 = 5u;
const OVERFLOW: u32 = 6u;
// The first of as many as there are outflows.
const SWALLOWED: u32 = 8u;

struct Constants {
    gravity: vec3f,
    spacing: f32,
    lower: vec3f, // corner of the domain, relative to its middle
    effective_radius: f32,
    upper: vec3f,
    collision_distance: f32,
    cells: vec3u,
    cell_total: u32,
    fluid: u32,          // fluid slots
    moving_wall: u32,    // wall-layer slots of moving solids; they follow the fluid
    moving: u32,         // all particles of moving solids
    moving_dummy: u32,   // first slot of their dummies
    pressure_slots: u32, // slots below carry pressure: the rows of the neighbour lists and of the PPE
    capacity: u32,       // neighbours of a row at most
    reduction_groups: u32,
    max_iterations: u32,
    number_density: f32,   // n0
    surface_below: f32,    // beta n0
    restitution: f32,      // b of Eq. (18)
    viscosity: f32,        // nu 2 d / sum w r^2, with the weight of viscosity.wgsl
    particle_mass: f32,
    gradient_scale: f32,   // d / n0
    density: f32,
    tolerance_squared: f32,
    smooth_density: f32,   // W0
    surface_head: f32,     // of the missing half spacing, Pa
    wall_shear: f32,       // weight of a pair of fluid and wall in the viscous sum
    wall_friction: f32,    // C_f / l0 / wall_contact
    period: vec3f,         // from a periodic side to the opposite one, 0 along other axes
    wall_contact: f32,     // sum w of a particle of a flat wall's layer with the water above it
    inverse_period: vec3f, // 1 / period, 0 along other axes
    body_wall: u32,        // wall-layer particles of bodies, the first of the moving solids
    cell_width: vec3f,
    zero: f32,             // 0.0, which no compiler knows: see `exactly`
    drive: vec3f,          // what of gravity lies along periodic axes; `gravity` is the rest
    dynamic_viscosity: f32, // rho nu, Pa s
    wall_room: f32,        // sum W of a particle of a flat wall's layer with the water above it
    wall_depth: f32,       // of the wall's middle below a particle of a flat wall's layer, over l0
    reacting: u32,         // wall-layer slots that keep a reaction; they follow the fluid
    shear_scale: f32,      // d / sum w r^2 with the weight of viscosity.wgsl, 1/m2
}

// The PPE is kept divided by c = 2 d / (lambda n0): its right side is then in Pa and its squares stay far from the
// largest f32, and a product with the matrix needs no factor.
struct Coefficients {
    dt: f32,
    source_density: f32,    // gamma rho / dt^2 / c
    source_divergence: f32, // (1 - gamma) rho / dt (d / n0) / c
    compressibility: f32,   // alpha rho / dt^2 / c
    pressure_max: f32,
    pressure_min: f32,      // 0 where water does not pull
    speed_per_bin: f32,     // of the monitor's histogram
    shift_speed: f32,       // of particles at rest
    ahead: f32,             // from the start of the step to where forces are found
}

// Of a moving solid; its position relative to the middle of the domain.
struct Pose {
    position: vec4f,
    orientation: vec4f,
    velocity: vec4f,
    angular_velocity: vec4f,
}

// A face of a wall-layer particle: outward area, and from the particle to its middle.
struct WallFace {
    area: vec4f,
    way: vec4f,
}

// A wall-layer particle of a moving solid, in the solid's frame: outward area, from the centre of mass to the surface, from
// the particle to the surface, and its faces, which sum up to the area. Those that it lacks have none.
struct WallParticle {
    area: vec4f, // and its lightness in collisions
    arm: vec4f,
    to_surface: vec4f, // and cut_share of src/kernels/wall_excess.rs
    faces: array<WallFace, 3>,
}

struct Wrench {
    force: vec3f,
    torque: vec3f,
}

// A box in which the water comes to rest. Corners relative to the middle of the domain; s = ramp.xyz . (r - start.xyz).
struct AbsorberZone {
    low: vec4f,
    high: vec4f,
    start: vec4f,
    ramp: vec4f, // and the rate
}

// A wall layer that becomes water: its first slot, its particles, the first slot of the water; from the layer to the water, and the
// water's velocity.
struct Emission {
    wall: u32,
    count: u32,
    to: u32,
    pad: u32,
    shift: vec4f,
    velocity: vec4f,
}

// A box in which water is swallowed, but for the room in it. Corners relative to the middle of the domain.
struct Outlet {
    low: vec4f,
    high: vec4f,
    room_low: vec4f,
    room_high: vec4f,
}

// A whole number below 2^30 as the word of a vector: bits of a normal f32, which no device flushes to zero; and back, where
// 0.0 stands for 0 as well. As crate::backend::gpu::layout::word_of.
const FIRST_WORD: u32 = 0x3f800000u;

fn word_of(number: u32) -> f32 {
    return bitcast<f32>(FIRST_WORD + number);
}

fn number_of(word: f32) -> u32 {
    return max(bitcast<u32>(word), FIRST_WORD) - FIRST_WORD;
}

// A direction as such a word, to 1.3e-4, by its place on an octahedron whose lower half is folded out into a square (Cigolle et al., JCGT 3(2), 2014); and
// back, where 0.0 stands for none.
fn folded(p: vec2f) -> vec2f {
    return (1.0 - abs(p.yx)) * select(vec2f(1.0), vec2f(-1.0), p < vec2f(0.0));
}

fn direction_word(n: vec3f) -> f32 {
    let sum = dot(abs(n), vec3f(1.0));
    if sum == 0.0 {
        return 0.0;
    }
    let p = n.xy / sum;
    let parts = vec2u(round((select(p, folded(p), n.z < 0.0) + 1.0) * 16383.0));
    return word_of(1u + parts.x + (parts.y << 15u));
}

fn direction_of(word: f32) -> vec3f {
    let number = number_of(word);
    if number == 0u {
        return vec3f(0.0);
    }
    let parts = vec2i(vec2u(number - 1u, (number - 1u) >> 15u) & vec2u(32767u));
    let p = vec2f(parts - 16383) * (1.0 / 16383.0);
    let z = 1.0 - abs(p.x) - abs(p.y);
    return normalize(vec3f(select(p, folded(p), z < 0.0), z));
}

// Numbers of a thread and of a workgroup, and how many workgroups there are. Where a dispatch has more than a device starts along
// one dimension it is folded into rows of DISPATCH_WIDTH, a constant that src/backend/gpu/shader.rs adds; the last row may be more
// than was asked for. Kernels that stride over all particles by fixed numbers of workgroups have few and are never folded.
//#if FOLDED
fn thread(id: vec3u) -> u32 {
    return id.y * (DISPATCH_WIDTH * WORKGROUP) + id.x;
}

fn group_number(group: vec3u) -> u32 {
    return group.y * DISPATCH_WIDTH + group.x;
}

fn group_count(groups: vec3u) -> u32 {
    return groups.x * groups.y;
}
//#else
fn thread(id: vec3u) -> u32 {
    return id.x;
}

fn group_number(group: vec3u) -> u32 {
    return group.x;
}

fn group_count(groups: vec3u) -> u32 {
    return groups.x;
}
//#endif

// As crate::backend::gpu::hierarchy::Hierarchy; made by shaders/multigrid_levels.wgsl, used by shaders/multigrid.wgsl, told by shaders/halo.wgsl.
struct Hierarchy {
    level: array<vec4u, 16>, // cells along x, y, z, first cell
    operation: array<vec4u, 256>, // kind, level; of the first two, where ranks share the levels, what is whose
    levels: u32,
    capacity: u32,
    cells: u32,
    operations: u32,
}

@group(0) @binding(0) var<uniform> params: Constants;
@group(0) @binding(1) var<uniform> now: Coefficients;

// x as it was rounded. Compilers for devices may reckon with a sum as if it were exact, and drop what it has rounded off, or that it may be
// no number; what has passed through here they know nothing of.
fn exactly(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ bitcast<u32>(params.zero));
}

// By bits: a compiler may assume that there are no NaNs and drop a comparison.
fn finite(x: f32) -> bool {
    return (bitcast<u32>(exactly(x)) & 0x7f800000u) != 0x7f800000u;
}

fn finite_vector(v: vec3f) -> bool {
    return finite(v.x) && finite(v.y) && finite(v.z);
}

// Whether v is longer than `longest`.
fn longer(v: vec3f, longest: f32) -> bool {
    return dot(v, v) > longest * longest;
}

// v, no longer than `longest`.
fn shortened(v: vec3f, longest: f32) -> vec3f {
    return select(v, v * (longest * inverseSqrt(dot(v, v))), longer(v, longest));
}

// Whether the kind is water's; the others are 1 and more.
fn is_water(kind: f32) -> bool {
    return kind < 0.5;
}

// Of 2^k: a 256th of the gap between the numbers from there on; and what makes three bytes less than a half. As
// crate::backend::gpu::layout::Remainder.
const QUANTUM: f32 = 0x1p-31;
const REMAINDER: f32 = 0x1p25;

// x, a particle of water, after `way`. What f32 cannot hold of its place stays beside its kind, three signed bytes in 256ths of the
// widest gap between the numbers of the domain, as crate::backend::gpu::layout::Remainder: a way of less than such a gap, that of slow
// water in a long flume, is not lost but sums up. What the bytes cannot hold counts as one more with the chance of its size.
fn moved(x: vec4f, way: vec3f) -> vec4f {
    let far = max(max(params.upper.x, params.upper.y), params.upper.z);
    let quantum = bitcast<f32>(bitcast<u32>(far) & 0x7f800000u) * QUANTUM;
    let held = i32(x.w * REMAINDER);
    let asked = way + quantum * vec3f(vec3i(extractBits(held, 0u, 8u), extractBits(held, 8u, 8u), extractBits(held, 16u, 8u)));
    let end = x.xyz + asked;
    let gone = vec3f(exactly(end.x), exactly(end.y), exactly(end.z)) - x.xyz;
    let die = scrambled(scrambled(scrambled(scrambled(u32(held)) ^ bitcast<u32>(x.x)) ^ bitcast<u32>(x.y)) ^ bitcast<u32>(x.z));
    let chance = vec3f(vec3u(die, die >> 10u, die >> 20u) & vec3u(1023u)) / 1024.0;
    let rest = vec3i(clamp(floor((asked - gone) / quantum + chance), vec3f(-128.0), vec3f(127.0))) & vec3i(255);
    return vec4f(end, FLUID + f32(rest.x | (rest.y << 8u) | (rest.z << 16u)) / REMAINDER);
}

// A number as if by chance, always the same of the same one (PCG: O'Neill 2014; Jarzynski and Olano 2020).
fn scrambled(number: u32) -> u32 {
    let state = number * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// Longest way of a particle in the part `time` of the step.
fn longest_way(time: f32) -> f32 {
    return DISPLACEMENT_MAX * params.spacing * (time / now.dt);
}

// r_j - r_i, to the nearest image of j where sides are periodic; as crate::periodic::Periodic::nearest.
fn offset(here: vec3f, there: vec3f) -> vec3f {
    let r = there - here;
//#if PERIODIC
    return r - params.period * round(r * params.inverse_period);
//#else
    return r;
//#endif
}

// x, or its image between the sides where these are periodic; as crate::periodic::Periodic::wrap.
fn wrapped(x: vec3f) -> vec3f {
//#if PERIODIC
    let inside = x - params.period * floor((x - params.lower) * params.inverse_period);
    // What lies less than a rounding from a side comes to lie on the lower one.
    let off = (params.period > vec3f(0.0)) & ((inside >= params.upper) | (inside < params.lower));
    return select(inside, params.lower, off);
//#else
    return x;
//#endif
}

// sigma of crate::kernels::absorber in one zone, which may reach over a periodic side.
fn absorber_rate(zone: AbsorberZone, place: vec3f) -> f32 {
//#if PERIODIC
    let x = place - params.period * floor((place - zone.low.xyz) * params.inverse_period);
//#else
    let x = place;
//#endif
    let s = clamp(dot(zone.ramp.xyz, x - zone.start.xyz), 0.0, 1.0);
    let holds = all(x >= zone.low.xyz) && all(x <= zone.high.xyz);
    return select(0.0, zone.ramp.w * s * s, holds);
}

// Whether a particle stays: it is in the domain, and its numbers are numbers.
fn in_domain(x: vec3f, v: vec3f) -> bool {
//#if TWO_DIMENSIONS
    let y = true;
//#else
    let y = x.y >= params.lower.y && x.y < params.upper.y;
//#endif
    return finite_vector(x) && finite_vector(v) && y && x.x >= params.lower.x && x.x < params.upper.x
        && x.z >= params.lower.z && x.z < params.upper.z;
}

// Eq. (3) for a squared distance: no infinities for coincident particles, 0 beyond the effective radius.
fn weight(distance_squared: f32) -> f32 {
    let closest = CLOSEST * params.spacing;
    return max(params.effective_radius * inverseSqrt(max(distance_squared, closest * closest)) - 1.0, 0.0);
}

// W of a pair of weight w, as crate::lattice::smooth_weight.
fn smooth_weight(w: f32) -> f32 {
    let q = 1.0 / (1.0 + w);
    let rest = max(1.0 - q, 0.0);
    return rest * rest * rest * (1.0 + 3.0 * q - 2.6 * q * q);
}

// Weight of neighbours at a boundary, as crate::lattice::boundary_weight.
fn boundary_weight(w: f32) -> f32 {
    let q = 1.0 / (1.0 + w);
    let square = (1.0 - q) * (1.0 - q);
    return square * square * (1.0 + q);
}

// Solids about a particle of water, over W0, between which it comes to be caught.
const CAUGHT = vec2f(0.85, 1.0);

// Room that solids of the sum W leave a particle of water, itself among them.
fn room_in_water(solids: f32) -> f32 {
    return saturate((CAUGHT.y - solids / params.smooth_density) / (CAUGHT.y - CAUGHT.x));
}

// The sum of w r r^T / r^2 over a neighbourhood: its diagonal, and yz, xz, xy.
struct Moment {
    diagonal: vec3f,
    mixed: vec3f,
}

// Its part of a neighbour at r, with e = w r / r^2.
fn add_moment(sum: Moment, e: vec3f, r: vec3f) -> Moment {
    return Moment(sum.diagonal + e * r, sum.mixed + e.yxx * r.zzy);
}

// w r / r^2 of a pair of weight w = re / r - 1: without a division, and finite where the weight is, at r = 0.
fn pair_vector(w: f32, r: vec3f) -> vec3f {
    let inverse = (1.0 + w) / params.effective_radius;
    return w * inverse * inverse * r;
}

const SHIFT: f32 = 0.3;
const SHIFT_MAX: f32 = 0.05;

// The way of a shift, as crate::kernels::shift.
fn shift_way(imbalance: vec3f, v: vec3f) -> vec3f {
    let speed = now.shift_speed + length(v);
    return shortened(-SHIFT * now.dt * speed * params.spacing * imbalance, SHIFT_MAX * params.spacing);
}

// Inverse of M = d / n0 times the sum, or 1 where it is not known well enough.
fn inverse_moment(sum: Moment) -> mat3x3f {
    return inverse_above(EIGENVALUE_MIN, sum, params.gradient_scale, 1.0);
}

// Inverse of M = scale times the sum, or `otherwise` times 1 where a lower bound of its smallest eigenvalue is below `least`. M is
// symmetric: its inverse is the matrix of cofactors over the determinant. See src/neighbourhood.rs.
fn inverse_above(least: f32, sum: Moment, scale: f32, otherwise: f32) -> mat3x3f {
    var diagonal = scale * sum.diagonal;
    let mixed = scale * sum.mixed;
//#if TWO_DIMENSIONS
    // The plane y = 0 has no moment across it.
    diagonal.y = 1.0;
//#endif
    let cofactor = diagonal.yxx * diagonal.zzy - mixed * mixed;
    let across = mixed.yxx * mixed.zzy - diagonal * mixed;
    let determinant = diagonal.x * cofactor.x + mixed.z * across.z + mixed.y * across.y;
//#if TWO_DIMENSIONS
    let known = determinant > least * (diagonal.x + diagonal.z);
//#else
    let trace = diagonal.x + diagonal.y + diagonal.z;
    let known = 4.0 * determinant > least * trace * trace;
//#endif
    if !known {
        return otherwise * mat3x3f(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    }
    return (1.0 / determinant) * mat3x3f(
        vec3f(cofactor.x, across.z, across.y),
        vec3f(across.z, cofactor.y, across.x),
        vec3f(across.y, across.x, cofactor.z),
    );
}

// A word of `neighbour_count`: 12 bits neighbours that carry pressure, 12 bits dummies, 1 bit "a pair is close", 1 bit "one of
// those that carry pressure is a wall".
fn near_of(word: u32) -> u32 {
    return word & 0xfffu;
}

fn dummies_of(word: u32) -> u32 {
    return (word >> 12u) & 0xfffu;
}

fn is_close(word: u32) -> bool {
    return (word & 0x1000000u) != 0u;
}

fn sees_wall(word: u32) -> bool {
    return (word & 0x2000000u) != 0u;
}

fn all_of(word: u32) -> u32 {
    return near_of(word) + dummies_of(word);
}

// `neighbour_list` has a plane for each place in a row, so that neighbouring threads read neighbouring words: those that carry
// pressure from the front, dummies from the back.
fn dummy_plane(k: u32) -> u32 {
    return params.capacity - 1u - k;
}

// Of all of a row whose word is `word`: first those that carry pressure, then the dummies.
fn all_plane(k: u32, word: u32) -> u32 {
    let near = near_of(word);
    return select(dummy_plane(k - near), k, k < near);
}

fn cell_coordinates(x: vec3f) -> vec3u {
//#if PERIODIC
    let width = params.cell_width;
//#else
    let width = vec3f(params.effective_radius);
//#endif
    return min(vec3u(max((wrapped(x) - params.lower) / width, vec3f(0.0))), params.cells - 1u);
}

// The cells around a cell run from the first of these to the second one. Where sides are periodic they are counted on from
// one grid to the next: `beyond` finds them in the first.
fn lowest_around(c: vec3u) -> vec3u {
//#if PERIODIC
    return select(max(c, vec3u(1u)) - 1u, c + params.cells - 1u, params.period > vec3f(0.0));
//#else
    return max(c, vec3u(1u)) - 1u;
//#endif
}

fn highest_around(c: vec3u) -> vec3u {
//#if PERIODIC
    return select(min(c + 1u, params.cells - 1u), c + params.cells + 1u, params.period > vec3f(0.0));
//#else
    return min(c + 1u, params.cells - 1u);
//#endif
}

//#if PERIODIC
fn beyond(c: vec3u) -> vec3u {
    return c % params.cells;
}

//#endif

// z runs fastest, so that three cells above each other are one range.
fn cell_index(c: vec3u) -> u32 {
    return (c.x * params.cells.y + c.y) * params.cells.z + c.z;
}

// First key of the counting sort that belongs to moving solids: behind the cells and the ghosts' keys.
fn moving_key() -> u32 {
    return params.cell_total + (params.fluid + GHOST_BLOCK - 1u) / GHOST_BLOCK;
}

// Slot of the k-th particle of moving solids.
fn moving_slot_of(k: u32) -> u32 {
    return select(params.moving_dummy + k - params.moving_wall, params.fluid + k, k < params.moving_wall);
}

fn rotate(q: vec4f, v: vec3f) -> vec3f {
    let t = 2.0 * cross(q.xyz, v);
    return v + q.w * t + cross(q.xyz, t);
}

// Place of a moving-wall slot's row in the buffer `coupling`, and of what a free body answers: behind four vectors a slot of what
// slots between solids bring it.
fn coupled_row(k: u32) -> u32 {
    return 4u * params.moving_wall + 2u * k;
}

// What a pressure of `p` at a wall-layer particle of a moving solid, where it stands for `part` of its area, does to the solid: on each of
// its faces with the weight of the water on the way there; `least` is the lowest pressure on them. See on_faces and head in
// src/kernels/body_force.rs.
fn pressed_on_faces(pose: Pose, wall: WallParticle, part: f32, p: f32, least: f32) -> Wrench {
    var faces = wall.faces;
    let place = wall.arm.xyz - wall.to_surface.xyz;
    var sum = Wrench(vec3f(0.0), vec3f(0.0));
    for (var f = 0u; f < 3u; f++) {
        let way = faces[f].way.xyz;
        let head = params.density * dot(params.gravity, rotate(pose.orientation, way)) + params.surface_head;
        let force = rotate(pose.orientation, -part * max(p + head, least) * faces[f].area.xyz);
        sum.force += force;
        sum.torque += cross(rotate(pose.orientation, place + way), force);
    }
    return sum;
}

// The same for each pascal that acts on all of them.
fn pressed_evenly(pose: Pose, wall: WallParticle, part: f32) -> Wrench {
    var faces = wall.faces;
    let place = wall.arm.xyz - wall.to_surface.xyz;
    var torque = vec3f(0.0);
    for (var f = 0u; f < 3u; f++) {
        torque -= part * cross(place + faces[f].way.xyz, faces[f].area.xyz);
    }
    return Wrench(rotate(pose.orientation, -part * wall.area.xyz), rotate(pose.orientation, torque));
}
