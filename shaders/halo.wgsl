// What ranks show each other, packed: each with a device of its own computes the water of a slab of the tank and the wall layers in it, beside copies of
// what lies in the columns of cells next to the slab. Every kernel that changes what the next one reads across a cut is followed by one that packs
// the border into `halo`, and one that takes the copies from there; on the way the host swaps what is in it.
// Slots that are copies, of water and of walls, are FOREIGN: they are neighbours, and nothing is computed for them.
// Twin: src/share/border.rs, and of the levels src/pressure/multigrid

@group(0) @binding(2) var<storage, read_write> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> pressure: array<f32>;
@group(0) @binding(5) var<storage, read_write> state: array<u32>;
@group(0) @binding(6) var<storage, read_write> preconditioned: array<vec4f>;
@group(0) @binding(7) var<storage, read> cell_start: array<u32>;
@group(0) @binding(8) var<storage, read_write> unsorted: array<u32>;
// First place and length of four lists, then what ROWS_BEFORE begins, then the slots of the lists: given and taken of what carries pressure,
// given and taken of the water.
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
//#if MULTIGRID
@group(0) @binding(14) var<storage, read> source_diagonal: array<vec2f>;
@group(0) @binding(15) var<storage, read_write> aggregate: array<vec2u>;
@group(0) @binding(16) var<uniform> hierarchy: Hierarchy;
@group(0) @binding(17) var<storage, read_write> cell_mark: array<atomic<u32>>;
@group(0) @binding(18) var<storage, read> cell_row: array<vec2u>;
@group(0) @binding(19) var<storage, read> row_cell: array<vec4u>;
@group(0) @binding(20) var<storage, read_write> entry: array<vec2u>;
@group(0) @binding(21) var<storage, read_write> coarse: array<f32>;
// A bit for each cell of the finest level: whether it holds unknowns.
@group(0) @binding(22) var<storage, read_write> wet_cell: array<u32>;
//#endif

const GIVEN: u32 = 0u;
const TAKEN: u32 = 1u;
const WATER_GIVEN: u32 = 2u;
const WATER_TAKEN: u32 = 3u;
// Rows of the finest level of multigrid: those of the ranks before this one, and its own.
const ROWS_BEFORE: u32 = 8u;
const ROWS_OWN: u32 = 9u;

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
    if is_water(x.w) {
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

//#if MULTIGRID
// The levels of multigrid are those of all ranks, the same on each device; made and used in four places where ranks meet:
// which copies are unknowns and which cells hold unknowns, so that all number the rows alike; the operator of the finest level, of which each makes
// its own cells' rows; and in each cycle the residuals of these cells. All further levels follow from what is the same on all devices.

const ABOVE: u32 = 0x80000000u;
// Of the copy of an unknown; as in shaders/multigrid_levels.wgsl.
const UNKNOWN: vec2u = vec2u(0u, 1u);
// Entries of a row from the diagonal on: the operator is symmetric.
const HALF: u32 = 14u;
// As crate::kernels::multigrid.
const DAMPING: f32 = 0.9;

@compute @workgroup_size(WORKGROUP)
fn give_unknown(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < length_of(GIVEN) {
        halo[k] = select(0.0, 1.0, source_diagonal[slot(GIVEN, k)].y > 0.0);
    }
}

@compute @workgroup_size(WORKGROUP)
fn take_unknown(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < length_of(TAKEN) && halo[k] != 0.0 {
        aggregate[slot(TAKEN, k)] = UNKNOWN;
    }
}

@compute @workgroup_size(WORKGROUP)
fn give_wet_cells(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let words = (params.cell_total + 31u) / 32u;
    for (var word = thread(id); word < words; word += group_count(groups) * WORKGROUP) {
        var bits = 0u;
        for (var k = 0u; k < min(params.cell_total - 32u * word, 32u); k++) {
            let wet = cell_mark_at(hierarchy.level[0].w + 32u * word + k) != 0u;
            bits |= u32(wet) << k;
        }
        wet_cell[word] = bits;
    }
}

// Cells of other ranks with unknowns get a row, which has no members here.
@compute @workgroup_size(WORKGROUP)
fn take_wet_cells(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let own = hierarchy.operation[0].zw;
    for (var cell = thread(id); cell < params.cell_total; cell += group_count(groups) * WORKGROUP) {
        let is_own = cell >= own.x && cell < own.y;
        if is_own || (wet_cell[cell / 32u] >> (cell % 32u) & 1u) == 0u {
            continue;
        }
        set_cell_mark(hierarchy.level[0].w + cell, ABOVE);
        var c = coordinates_of(cell);
        for (var level = 1u; level < hierarchy.levels; level++) {
            c = c >> vec3u(1u);
            let l = hierarchy.level[level];
            set_cell_mark(l.w + (c.x * l.y + c.y) * l.z + c.z, ABOVE);
        }
    }
}

// Of a cell of the finest level.
fn coordinates_of(cell: u32) -> vec3u {
    let l = hierarchy.level[0];
    return vec3u(cell / (l.y * l.z), cell / l.z % l.y, cell % l.z);
}

// Rows of the finest level: the first one, and that behind the last.
fn finest_rows() -> vec2u {
    return vec2u(row_cell[hierarchy.capacity + 1u].x, row_cell[hierarchy.capacity].x);
}

@compute @workgroup_size(WORKGROUP)
fn give_entries(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let rows = finest_rows();
    for (var k = thread(id); k < halo_slot[ROWS_OWN]; k += group_count(groups) * WORKGROUP) {
        let row = rows.x + halo_slot[ROWS_BEFORE] + k;
        for (var e = 0u; e < HALF; e++) {
            var value = 0.0;
            // Cells beyond the capacity have no row.
            if row < rows.y {
                value = bitcast<f32>(entry_at(13u + e, row).y);
            }
            halo[HALF * k + e] = value;
        }
    }
}

// Row + 1 of the cell at a step from that at `c`, 0 if there is none.
fn row_at(c: vec3u, step: vec3i) -> u32 {
    let l = hierarchy.level[0];
//#if PERIODIC
    // Along other axes no entry leads across the sides.
    let to = vec3u(vec3i(c + l.xyz) + step) % l.xyz;
//#else
    let to = vec3u(vec3i(c) + step);
    // What is less than 0 is more than there are.
    if any(to >= l.xyz) {
        return 0u;
    }
//#endif
    return cell_row_at(l.w + (to.x * l.y + to.y) * l.z + to.z).x;
}

// Rows of the finest level's operator, of all ranks: the lower half of each mirrors the upper halves of others.
@compute @workgroup_size(WORKGROUP)
fn take_entries(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let rows = finest_rows();
    for (var row = rows.x + thread(id); row < rows.y; row += group_count(groups) * WORKGROUP) {
        let c = coordinates_of(row_cell[row].x);
        for (var k = 0u; k < 27u; k++) {
            let other = row_at(c, vec3i(vec3u(k / 9u, k / 3u % 3u, k % 3u)) - 1);
            var value = 0.0;
            if other > 0u {
                let upper = select(HALF * (other - 1u - rows.x) + 13u - k, HALF * (row - rows.x) + k - 13u, k >= 13u);
                value = halo[upper];
            }
            set_entry(k, row, vec2u(select(row, other - 1u, value != 0.0), bitcast<u32>(value)));
        }
    }
}

// Residuals of this rank's cells; `gather` of shaders/multigrid.wgsl has summed them.
@compute @workgroup_size(WORKGROUP)
fn give_coarse(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let rows = finest_rows();
    for (var k = thread(id); k < halo_slot[ROWS_OWN]; k += group_count(groups) * WORKGROUP) {
        let row = rows.x + halo_slot[ROWS_BEFORE] + k;
        var b = 0.0;
        if row < rows.y {
            b = coarse[2u * hierarchy.capacity + row];
        }
        halo[k] = b;
    }
}

// Those of all, and the first sweep.
@compute @workgroup_size(WORKGROUP)
fn take_coarse(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let rows = finest_rows();
    for (var row = rows.x + thread(id); row < rows.y; row += group_count(groups) * WORKGROUP) {
        let b = halo[row - rows.x];
        coarse[2u * hierarchy.capacity + row] = b;
        coarse[row] = DAMPING * b / bitcast<f32>(entry_at(13u, row).y);
    }
}

//#endif
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
