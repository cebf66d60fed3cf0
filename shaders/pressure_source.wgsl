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
// What a row sums over all its neighbours.
struct Sums {
    density: f32,    // W, the particle itself among them
    solids: f32,     // W of solids, the particle itself among them
    moment: Moment,
    inner: mat3x3f,  // e (v_j - v_i)^T, column c with component c of the velocity
    solid: mat3x3f,  // the same of the solids around a fluid particle
    normal: vec3f,   // e of those solids
}

fn add_neighbour(sums: Sums, w: f32, r: vec3f, v: vec3f, is_solid: bool, slips: bool) -> Sums {
    var out = sums;
    let even = smooth_weight(w);
    let e = pair_vector(w, r);
    let rate = mat3x3f(e * v.x, e * v.y, e * v.z);
    out.density += even;
    out.solids += select(0.0, even, is_solid);
    out.moment = add_moment(out.moment, e, r);
    if slips {
        out.solid += rate;
        out.normal += e;
    } else {
        out.inner += rate;
    }
    return out;
}

// sum v . M^-1 e, of solids with their velocity along the mean normal alone.
fn divergence(sums: Sums) -> f32 {
    let inverse = inverse_moment(sums.moment);
    var sum = dot(inverse[0], sums.inner[0]) + dot(inverse[1], sums.inner[1]) + dot(inverse[2], sums.inner[2]);
    let squared = dot(sums.normal, sums.normal);
    if squared > 0.0 {
        let normal = sums.normal * inverseSqrt(squared);
        sum += dot(inverse * normal, sums.solid * normal);
    }
    return sum;
}

//#endif
//#if MIXED
// Room before a row at a body, over that of a flat wall, between which it comes to undo all.
const SLOT = vec2f(0.35, 0.68);
// Link of a caught particle to P = 0, over n0.
const LEAK: f32 = 0.1;

// Room that solids leave at a slot.
fn room_of(solids: f32, is_fluid: bool) -> f32 {
    let row = ((params.smooth_density - solids) / params.wall_room - SLOT.x) / (SLOT.y - SLOT.x);
    return select(saturate(row), room_in_water(solids), is_fluid);
}

// Whether a slot is one of a body's wall layer.
fn is_body(i: u32) -> bool {
    return i >= params.fluid && i < params.fluid + params.body_wall;
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
    var sums = Sums(1.0, 1.0, Moment(vec3f(0.0), vec3f(0.0)), zero, zero, vec3f(0.0));
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
        let is_solid = j >= params.fluid;
        sums = add_neighbour(sums, w, r, velocity[j].xyz - v, is_solid, is_solid && i < params.fluid);
//#endif
    }
    if links <= 0.0 {
        source_diagonal[i] = vec2f(0.0, 1.0);
        return;
    }
//#if MIXED
    // Whether a wall's row is a body's or lies at one. Rows of walls have other walls among the dummies.
    var at_body = is_body(i);
    let dummies = dummies_of(count);
    for (var k = 0u; k < dummies; k++) {
        let j = neighbour_list_at(dummy_plane(k), i);
        at_body = at_body || is_body(j);
        let r = offset(x, position[j].xyz);
        sums = add_neighbour(sums, weight(dot(r, r)), r, velocity[j].xyz - v, true, i < params.fluid);
    }
    // A wall's row undoes as much as there is water before it.
    let share = links / params.wall_contact;
    let room = room_of(sums.solids, i < params.fluid);
    let row = select(saturate(share), min(saturate(2.0 * share - 1.0), room), at_body);
    let wet = select(row, room, i < params.fluid);
    var b = wet * now.source_density * (sums.density - params.smooth_density) / params.smooth_density
        - wet * now.source_divergence * divergence(sums)
        - params.density * dot(params.gravity, first_moment);
//#else
    var b = now.source_density * (number_density[i] - params.number_density) / params.number_density;
//#endif
//#if SURFACE_PRESSURE
    b += known;
//#endif
    var diagonal = links + now.compressibility;
//#if MIXED
    diagonal += select(0.0, LEAK * (1.0 - wet) * params.number_density, i < params.fluid);
//#endif
    source_diagonal[i] = vec2f(b, diagonal);
}
