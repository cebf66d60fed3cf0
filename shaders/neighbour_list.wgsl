// Neighbour list: all particles within the effective radius.
// Twin: src/kernels/neighbour_list.rs
//
// A thread finds the row of one pressure-carrying particle. With the balanced source no wall carries pressure to a wall, and none
// to water behind a moving solid.
// Rows of ghosts, and of walls with no fluid within one cell, stay empty. A row that is full counts on and reports itself;
// nothing is dropped unseen. Where sides are periodic the cells around go on at the other side.

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> cell_start: array<u32>;
@group(0) @binding(4) var<storage, read> moving_slot: array<vec2u>; // slot, and where it faces
@group(0) @binding(5) var<storage, read> static_start: array<u32>;
// Bits of x, y, z, and the slot, in cell order: one load a candidate.
@group(0) @binding(6) var<storage, read> static_particle: array<vec4u>;
@group(0) @binding(7) var<storage, read_write> neighbour_list: array<u32>;
@group(0) @binding(8) var<storage, read_write> neighbour_count: array<u32>;
@group(0) @binding(9) var<storage, read_write> counters: array<atomic<u32>>;

var<private> near: u32;
var<private> dummies: u32;
var<private> smallest: f32;
var<private> wall: bool;
var<private> carriers: u32;
// Where the row's own particle faces, if it is of a moving solid's wall layer.
var<private> outward: vec3f;

// As crate::kernels::neighbour_list::BEHIND.
const BEHIND: f32 = 0.54;

// A neighbour j at r. Of a pair of water and a moving solid's wall layer `facing` is where the wall faces, turned round if j is the
// wall: what then lies behind it counts and carries no pressure.
fn see(i: u32, j: u32, r: vec3f, facing: vec3f) {
    let distance_squared = dot(r, r);
    if distance_squared >= params.effective_radius * params.effective_radius || j == i {
        return;
    }
    smallest = min(smallest, distance_squared);
    let room = near + dummies < params.capacity;
    if j < carriers && dot(r, facing) >= -BEHIND * sqrt(distance_squared) {
        if room {
            set_neighbour_list(near, i, j);
        }
        near += 1u;
        wall = wall || j >= params.fluid;
    } else {
        if room {
            set_neighbour_list(dummy_plane(dummies), i, j);
        }
        dummies += 1u;
    }
}

// Whether there is fluid in a column of cells, the last one included.
fn holds_fluid(first: u32, last: u32) -> bool {
    return cell_start_at(first) < cell_start_at(last + 1u);
}

fn near_fluid(low: vec3u, high: vec3u) -> bool {
    for (var x = low.x; x <= high.x; x++) {
        for (var y = low.y; y <= high.y; y++) {
//#if PERIODIC
            for (var z = low.z; z <= high.z; z++) {
                let cell = cell_index(beyond(vec3u(x, y, z)));
                if holds_fluid(cell, cell) {
                    return true;
                }
            }
//#else
            if holds_fluid(cell_index(vec3u(x, y, low.z)), cell_index(vec3u(x, y, high.z))) {
                return true;
            }
//#endif
        }
    }
    return false;
}

// The particles of a column of cells, the last one not included.
fn see_cells(i: u32, me: vec3f, first: u32, last: u32) {
    let fluid_end = cell_start_at(last);
    for (var j = cell_start_at(first); j < fluid_end; j++) {
        see(i, j, offset(me, position[j].xyz), outward);
    }
//#if MOVING
    let moving = moving_key();
    let moving_end = cell_start_at(moving + last) - params.fluid;
    for (var k = cell_start_at(moving + first) - params.fluid; k < moving_end; k++) {
        let other = moving_slot[k];
        var facing = vec3f(0.0);
        if i < params.fluid {
            facing = -direction_of(bitcast<f32>(other.y));
        }
        see(i, other.x, offset(me, position[other.x].xyz), facing);
    }
//#endif
//#if STATIC
    let static_end = static_start_at(last);
    for (var k = static_start_at(first); k < static_end; k++) {
        let other = static_particle[k];
        see(i, other.w, offset(me, bitcast<vec3f>(other.xyz)), vec3f(0.0));
    }
//#endif
}

@compute @workgroup_size(WORKGROUP)
fn neighbour_list_main(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i >= params.pressure_slots {
        return;
    }
    let me = position[i];
    let cell = cell_coordinates(me.xyz);
    let low = lowest_around(cell);
    let high = highest_around(cell);
    var searched = is_water(me.w);
//#if RANKS
    searched = searched || me.w == FOREIGN;
//#endif
    if i >= params.fluid {
        searched = near_fluid(low, high);
    }
    if !searched {
        neighbour_count[i] = 0u;
        return;
    }
    near = 0u;
    dummies = 0u;
    wall = false;
    carriers = params.pressure_slots;
//#if MIXED
    carriers = select(params.fluid, params.pressure_slots, i < params.fluid);
//#endif
    outward = vec3f(0.0);
//#if MOVING
    if i >= params.fluid && i < params.fluid + params.moving_wall {
        let own = moving_key() + cell_index(cell);
        let end = cell_start_at(own + 1u) - params.fluid;
        for (var k = cell_start_at(own) - params.fluid; k < end; k++) {
            if moving_slot[k].x == i {
                outward = direction_of(bitcast<f32>(moving_slot[k].y));
            }
        }
    }
//#endif
    smallest = params.effective_radius * params.effective_radius;
    for (var x = low.x; x <= high.x; x++) {
        for (var y = low.y; y <= high.y; y++) {
//#if PERIODIC
            for (var z = low.z; z <= high.z; z++) {
                let cell = cell_index(beyond(vec3u(x, y, z)));
                see_cells(i, me.xyz, cell, cell + 1u);
            }
//#else
            see_cells(i, me.xyz, cell_index(vec3u(x, y, low.z)), cell_index(vec3u(x, y, high.z)) + 1u);
//#endif
        }
    }
    let found = near + dummies;
    // A look before the atomic: after the first steps hardly a row is longer than the longest so far.
    if found > atomicLoad(&counters[NEIGHBOURS_MAX]) {
        atomicMax(&counters[NEIGHBOURS_MAX], found);
    }
    if found > params.capacity {
        atomicMin(&counters[OVERFLOW], i);
        near = min(near, params.capacity);
        dummies = min(dummies, params.capacity - near);
    }
    let close = smallest < params.collision_distance * params.collision_distance;
    neighbour_count[i] = near | (dummies << 12u) | (u32(close) << 24u) | (u32(wall) << 25u);
}
