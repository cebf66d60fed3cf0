// Right side and diagonal of the pressure Poisson equation, Eq. (8), times -1 and divided by c = 2 d / (lambda n0):
// sum w_ij (P_i - P_j) + alpha rho / (dt^2 c) P_i = b_i / c. A diagonal of 0 marks a slot whose pressure is no unknown.
// Twin: src/kernels/pressure_source.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(5) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(6) var<storage, read> number_density: array<f32>;
@group(0) @binding(7) var<storage, read> state: array<u32>;
@group(0) @binding(8) var<storage, read_write> source_diagonal: array<vec2f>;
//#if SURFACE_PRESSURE
@group(0) @binding(9) var<storage, read> surface_pressure: array<f32>;
//#endif

//#if MIXED
// Whether a slot is one of a body's wall layer.
fn is_body(i: u32) -> bool {
    return i >= params.fluid && i < params.fluid + params.body_wall;
}

// Water against solids, as a row of either sees it.
struct Boundary {
    solids: vec3f,      // r of the solids, with their weight
    solid_weight: f32,
    velocity: vec3f,    // v_j - v_i of those across the boundary, with their weight
    weight: f32,
    vector: vec3f,      // e of those
    bodies: bool,       // among the solids
}

// What a row sums over all its neighbours.
struct Sums {
    density: f32,   // W, the particle itself among them
    solids: f32,    // W of solids, the particle itself among them
    moment: Moment,
    rate: mat3x3f,  // e (v_j - v_i)^T, column c with component c of the velocity
    boundary: Boundary,
}

fn add_neighbour(sums: Sums, j: u32, w: f32, r: vec3f, v: vec3f, is_fluid: bool) -> Sums {
    var out = sums;
    let even = smooth_weight(w);
    let e = pair_vector(w, r);
    out.density += even;
    out.moment = add_moment(out.moment, e, r);
    out.rate += mat3x3f(e * v.x, e * v.y, e * v.z);
    let is_solid = j >= params.fluid;
    if is_fluid && !is_solid {
        return out;
    }
    let weight = boundary_weight(w);
    if is_solid {
        out.solids += even;
        out.boundary.solids += weight * r;
        out.boundary.solid_weight += weight;
        out.boundary.bodies = out.boundary.bodies || is_body(j);
    }
    if is_solid == is_fluid {
        out.boundary.velocity += weight * v;
        out.boundary.weight += weight;
        out.boundary.vector += e;
    }
    return out;
}

// Distance from the middle of the solids about a particle of water, over l0, from which on it is at one side of them.
const ONE_SIDED: f32 = 0.02;
// Depth of a wall below its row, over that of a flat and thick one, between which water comes to slide past it.
const THICK = vec2f(0.5, 0.9);

// Part of the divergence of row i that the mean velocity along the boundary makes up.
fn slide(i: u32, boundary: Boundary, inverse: mat3x3f) -> f32 {
    if boundary.weight <= 0.0 || boundary.solid_weight <= 0.0 || is_body(i) {
        return 0.0;
    }
    var normal = boundary.solids / boundary.solid_weight;
    var least = ONE_SIDED * params.spacing;
    var part = 1.0;
    if i >= params.fluid {
        let depth = length(normal) / (params.wall_depth * params.spacing);
        part = saturate((depth - THICK.x) / (THICK.y - THICK.x));
    } else if boundary.bodies {
        let squared = dot(boundary.vector, boundary.vector);
        normal = select(vec3f(0.0), boundary.vector * inverseSqrt(squared), squared > 0.0);
        least = 0.0;
    }
    let squared = dot(normal, normal) + least * least;
    if squared <= 0.0 {
        return 0.0;
    }
    let along = cross(normal, cross(boundary.velocity / boundary.weight, normal));
    return part / squared * dot(inverse * along, boundary.vector);
}

// sum v . M^-1 e, without what slides along a boundary.
fn divergence(i: u32, sums: Sums) -> f32 {
    let inverse = inverse_moment(sums.moment);
    let sum = dot(inverse[0], sums.rate[0]) + dot(inverse[1], sums.rate[1]) + dot(inverse[2], sums.rate[2]);
    return sum - slide(i, sums.boundary, inverse);
}

// Room before a row, over that of a flat wall, between which it comes to undo all.
const SLOT = vec2f(0.35, 0.68);
// Link of a caught particle to P = 0, over n0.
const LEAK: f32 = 0.1;

// Room that solids leave at a slot.
fn room_of(solids: f32, is_fluid: bool) -> f32 {
    let row = ((params.smooth_density - solids) / params.wall_room - SLOT.x) / (SLOT.y - SLOT.x);
    return select(saturate(row), room_in_water(solids), is_fluid);
}

//#endif
@compute @workgroup_size(WORKGROUP)
fn pressure_source(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i >= params.pressure_slots {
        return;
    }
//#if RANKS
    // A row is its rank's.
    if state[i] != INNER || position[i].w == FOREIGN {
//#else
    if state[i] != INNER {
//#endif
        source_diagonal[i] = vec2f(0.0);
        return;
    }
    let x = position[i].xyz;
    let count = neighbour_count[i];
    let near = near_of(count);
    var links = 0.0;
//#if SURFACE_PRESSURE
    var known = 0.0;
//#endif
//#if MIXED
    let v = velocity[i].xyz;
    var first_moment = vec3f(0.0);
    let zero = mat3x3f(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let nothing = Boundary(vec3f(0.0), 0.0, vec3f(0.0), 0.0, vec3f(0.0), false);
    var sums = Sums(1.0, 1.0, Moment(vec3f(0.0), vec3f(0.0)), zero, nothing);
    let is_fluid = i < params.fluid;
//#endif
    for (var k = 0u; k < near; k++) {
        let j = neighbour_list_at(k, i);
        let r = offset(x, position[j].xyz);
        let w = weight(dot(r, r));
        links += w;
//#if SURFACE_PRESSURE
        known += w * surface_pressure[j];
//#endif
//#if MIXED
        first_moment += w * r;
        sums = add_neighbour(sums, j, w, r, velocity[j].xyz - v, is_fluid);
//#endif
    }
    if links <= 0.0 {
        source_diagonal[i] = vec2f(0.0, 1.0);
        return;
    }
//#if MIXED
    let dummies = dummies_of(count);
    for (var k = 0u; k < dummies; k++) {
        let j = neighbour_list_at(dummy_plane(k), i);
        let r = offset(x, position[j].xyz);
        sums = add_neighbour(sums, j, weight(dot(r, r)), r, velocity[j].xyz - v, is_fluid);
    }
    // A wall's row undoes as much as there is water before it.
    let at_body = is_body(i) || sums.boundary.bodies;
    let share = links / params.wall_contact;
    let room = room_of(sums.solids, is_fluid);
    let row = select(saturate(share), saturate(2.0 * share - 1.0), at_body);
    let wet = select(min(row, room), room, is_fluid);
    var b = wet * now.source_density * (sums.density - params.smooth_density) / params.smooth_density
        - wet * now.source_divergence * divergence(i, sums)
        - params.density * dot(params.gravity, first_moment);
//#else
    var b = now.source_density * (number_density[i] - params.number_density) / params.number_density;
//#endif
//#if SURFACE_PRESSURE
    b += known;
//#endif
    var diagonal = links + now.compressibility;
//#if MIXED
    diagonal += select(0.0, LEAK * (1.0 - wet) * params.number_density, is_fluid);
//#endif
    source_diagonal[i] = vec2f(b, diagonal);
}
