// What ranks show each other, packed: each with a device of its own computes the water of a slab of the tank and the wall layers in it, beside copies of
// what lies in the columns of cells next to the slab. Every kernel that changes what the next one reads across a cut is followed by one that packs
// the border into `halo`, and one that takes the copies from there; on the way the host swaps what is in it.
// Slots that are copies, of water and of walls, are FOREIGN: they are neighbours, and nothing is computed for them.
// Twin: src/share/border.rs

@group(0) @binding(2) var<storage, read_write> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> pressure: array<f32>;
@group(0) @binding(5) var<storage, read_write> state: array<u32>;
@group(0) @binding(6) var<storage, read_write> preconditioned: array<vec4f>;
@group(0) @binding(7) var<storage, read> cell_start: array<u32>;
@group(0) @binding(8) var<storage, read_write> unsorted: array<u32>;
// First place and length of four lists, then the slots in them: given and taken of what carries pressure, given and taken of the water.
@group(0) @binding(9) var<storage, read> halo_slot: array<u32>;
// What they hold, one list at a time.
@group(0) @binding(10) var<storage, read_write> halo: array<f32>;
// Where the water of each column of cells begins, and where that of the last one ends.
@group(0) @binding(11) var<storage, read_write> column_start: array<u32>;
//#if SURFACE_PRESSURE
@group(0) @binding(12) var<storage, read_write> surface_pressure: array<f32>;
//#endif
//#if COUPLED
@group(0) @binding(13) var<storage, read_write> inertia_head: array<f32>; // of moving-wall slots
//#endif

const GIVEN: u32 = 0u;
const TAKEN: u32 = 1u;
const WATER_GIVEN: u32 = 2u;
const WATER_TAKEN: u32 = 3u;

// As crate::backend::gpu::rank::settle.
const NO_PARTICLE: u32 = 0xffffffffu;
const TAKEN_OUT: u32 = 0xfffffffeu;

// FOREIGN of shaders/common.wgsl.
const COPY: f32 = 6.0;
// Kind of a wall that is this rank's; the host knows which kind it is.
const WALL: f32 = 1.0;

fn length_of(list: u32) -> u32 {
    return halo_slot[2u * list + 1u];
}

fn slot(list: u32, k: u32) -> u32 {
    return halo_slot[halo_slot[2u * list] + k];
}

// Column of cells of each particle of this rank's water.
@compute @workgroup_size(WORKGROUP)
fn columns(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i >= params.fluid {
        return;
    }
    let x = position[i];
    var column = NO_PARTICLE;
    if x.w == FLUID {
        // What is about to be taken out is counted where it is.
        column = select(TAKEN_OUT, cell_coordinates(x.xyz).x, in_domain(wrapped(x.xyz), velocity[i].xyz));
    }
    unsorted[i] = column;
}

@compute @workgroup_size(WORKGROUP)
fn column_starts(@builtin(global_invocation_id) id: vec3u) {
    let c = thread(id);
    if c <= params.cells.x {
        column_start[c] = cell_start_at(c * params.cells.y * params.cells.z);
    }
}

// Marks the wall layers by what `halo` says: 1 for this rank's.
@compute @workgroup_size(WORKGROUP)
fn mark_walls(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    let i = params.fluid + k;
    if i < params.pressure_slots {
        position[i].w = select(COPY, WALL, halo[k] != 0.0);
    }
}

@compute @workgroup_size(WORKGROUP)
fn give_motion(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < length_of(WATER_GIVEN) {
        let i = slot(WATER_GIVEN, k);
        let x = position[i];
        let v = velocity[i];
        halo[6u * k] = x.x;
        halo[6u * k + 1u] = x.y;
        halo[6u * k + 2u] = x.z;
        halo[6u * k + 3u] = v.x;
        halo[6u * k + 4u] = v.y;
        halo[6u * k + 5u] = v.z;
    }
}

@compute @workgroup_size(WORKGROUP)
fn take_motion(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < length_of(WATER_TAKEN) {
        let i = slot(WATER_TAKEN, k);
        position[i] = vec4f(halo[6u * k], halo[6u * k + 1u], halo[6u * k + 2u], COPY);
        velocity[i] = vec4f(halo[6u * k + 3u], halo[6u * k + 4u], halo[6u * k + 5u], velocity[i].w);
    }
}

@compute @workgroup_size(WORKGROUP)
fn give_state(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < length_of(WATER_GIVEN) {
        halo[k] = f32(state[slot(WATER_GIVEN, k)]);
    }
}

@compute @workgroup_size(WORKGROUP)
fn take_state(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < length_of(WATER_TAKEN) {
        state[slot(WATER_TAKEN, k)] = u32(halo[k]);
    }
}

@compute @workgroup_size(WORKGROUP)
fn give_pressure(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < length_of(GIVEN) {
        halo[k] = pressure[slot(GIVEN, k)];
    }
}

@compute @workgroup_size(WORKGROUP)
fn take_pressure(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < length_of(TAKEN) {
        pressure[slot(TAKEN, k)] = halo[k];
    }
}

// The vector that is multiplied next, beside the positions.
@compute @workgroup_size(WORKGROUP)
fn give_search(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < length_of(GIVEN) {
        halo[k] = preconditioned[slot(GIVEN, k)].w;
    }
}

@compute @workgroup_size(WORKGROUP)
fn take_search(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < length_of(TAKEN) {
        preconditioned[slot(TAKEN, k)].w = halo[k];
    }
}

// Of rows that are other ranks' nothing is known: what multigrid, which is of each rank's own rows, starts from.
@compute @workgroup_size(WORKGROUP)
fn drop_search(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < length_of(TAKEN) {
        preconditioned[slot(TAKEN, k)].w = 0.0;
    }
}

//#if SURFACE_PRESSURE
@compute @workgroup_size(WORKGROUP)
fn give_surface_pressure(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < length_of(GIVEN) {
        halo[k] = surface_pressure[slot(GIVEN, k)];
    }
}

@compute @workgroup_size(WORKGROUP)
fn take_surface_pressure(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < length_of(TAKEN) {
        surface_pressure[slot(TAKEN, k)] = halo[k];
    }
}

//#endif
//#if COUPLED
// Of moving walls; there is none of other slots.
@compute @workgroup_size(WORKGROUP)
fn give_head(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < length_of(GIVEN) {
        let i = slot(GIVEN, k);
        var head = 0.0;
        if i >= params.fluid && i < params.fluid + params.moving_wall {
            head = inertia_head[i - params.fluid];
        }
        halo[k] = head;
    }
}

@compute @workgroup_size(WORKGROUP)
fn take_head(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < length_of(TAKEN) {
        let i = slot(TAKEN, k);
        if i >= params.fluid && i < params.fluid + params.moving_wall {
            inertia_head[i - params.fluid] = halo[k];
        }
    }
}
//#endif
