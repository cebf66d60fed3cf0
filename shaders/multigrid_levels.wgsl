// Levels of the multigrid preconditioner, made afresh every step: the background cells that hold unknowns, then 2 x 2 x 2
// cells of the last level and so on; on each the Galerkin operator, a stencil of 27 entries a row.
// Twin: src/kernels/multigrid_levels.rs
//
// The cells of all levels lie in one array, coarsest level first, and are numbered in that order by one scan, so rows of a
// level follow each other and an overflow of the buffers hits the finest level alone: such cells go uncorrected, which
// leaves the preconditioner symmetric and positive. Each row gathers its own entries; nothing depends on arrival.

@group(0) @binding(2) var<uniform> hierarchy: Hierarchy;
@group(0) @binding(3) var<storage, read> position: array<vec4f>;
@group(0) @binding(4) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(5) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(6) var<storage, read> source_diagonal: array<vec2f>;
@group(0) @binding(7) var<storage, read> cell_start: array<u32>;
@group(0) @binding(8) var<storage, read> moving_slot: array<vec2u>;
@group(0) @binding(9) var<storage, read> static_start: array<u32>;
@group(0) @binding(10) var<storage, read> static_particle: array<vec4u>;
// Unknowns in a cell of the finest level, ABOVE for a coarser cell that holds some, 0 for the rest.
@group(0) @binding(11) var<storage, read_write> cell_mark: array<atomic<u32>>;
@group(0) @binding(12) var<storage, read_write> cell_row: array<vec2u>; // row + 1 or 0, first member
@group(0) @binding(13) var<storage, read_write> row_block: array<vec2u>;
// Of each row: cell within its level, row + 1 of the next coarser level or 0, members from, to. Behind the last row:
// the number of rows, then the first row of each level.
@group(0) @binding(14) var<storage, read_write> row_cell: array<vec4u>;
@group(0) @binding(15) var<storage, read_write> member: array<vec2u>; // slot, bits of the diagonal; in cell order
@group(0) @binding(16) var<storage, read_write> aggregate: array<vec2u>; // of a slot: row + 1 or 0, place_of its cell or, where sides are periodic, the cell
@group(0) @binding(17) var<storage, read_write> entry: array<vec2u>; // column, bits of the value; entry after entry

const ABOVE: u32 = 0x80000000u;

fn cell_at(level: u32, c: vec3u) -> u32 {
    let l = hierarchy.level[level];
    return l.w + (c.x * l.y + c.y) * l.z + c.z;
}

fn coordinates_of(level: u32, cell: u32) -> vec3u {
    let l = hierarchy.level[level];
    return vec3u(cell / (l.y * l.z), cell / l.z % l.y, cell % l.z);
}

// The difference of two of these is the entry in the stencil.
fn place_of(c: vec3i) -> i32 {
    return 9 * c.x + 3 * c.y + c.z;
}

//#if PERIODIC
// The step from a cell of a level to its neighbour. Along a periodic axis the last cell is the neighbour of the first.
fn step_to(level: u32, here: vec3u, there: vec3u) -> vec3i {
    let d = vec3i(there) - vec3i(here);
    let goes_round = (params.period > vec3f(0.0)) & (abs(d) > vec3i(1));
    return select(d, d - sign(d) * vec3i(hierarchy.level[level].xyz), goes_round);
}

//#endif

fn first_row(level: u32) -> u32 {
    return row_cell[hierarchy.capacity + 1u + level].x;
}

fn end_row(level: u32) -> u32 {
    return row_cell[hierarchy.capacity + level].x;
}

// Where the particles of a cell are listed: fluid, moving solids, what never moves.
struct Listed {
    first: vec3u,
    count: vec3u,
}

//#if STATIC
// Whether there is fluid within one cell: walls elsewhere have no row, and so no unknown.
fn near_fluid(cell: u32) -> bool {
    let c = coordinates_of(0u, cell);
    let low = lowest_around(c);
    let high = highest_around(c);
    for (var x = low.x; x <= high.x; x++) {
        for (var y = low.y; y <= high.y; y++) {
//#if PERIODIC
            for (var z = low.z; z <= high.z; z++) {
                let around = cell_index(beyond(vec3u(x, y, z)));
                if cell_start_at(around) < cell_start_at(around + 1u) {
                    return true;
                }
            }
//#else
            if cell_start_at(cell_index(vec3u(x, y, low.z))) < cell_start_at(cell_index(vec3u(x, y, high.z)) + 1u) {
                return true;
            }
//#endif
        }
    }
    return false;
}

//#endif
fn listed(cell: u32) -> Listed {
    var out: Listed;
    out.first.x = cell_start_at(cell);
    out.count.x = cell_start_at(cell + 1u) - out.first.x;
//#if MOVING
    let moving = moving_key() + cell;
    out.first.y = cell_start_at(moving) - params.fluid;
    out.count.y = cell_start_at(moving + 1u) - params.fluid - out.first.y;
//#endif
//#if STATIC
    out.first.z = static_start_at(cell);
    out.count.z = static_start_at(cell + 1u) - out.first.z;
    if out.count.z > 0u && !near_fluid(cell) {
        out.count.z = 0u;
    }
//#endif
    return out;
}

// Slot of the k-th of them.
fn slot_of(l: Listed, k: u32) -> u32 {
    if k < l.count.x {
        return l.first.x + k;
    }
//#if MOVING
    if k < l.count.x + l.count.y {
        return moving_slot[l.first.y + k - l.count.x].x;
    }
//#endif
//#if STATIC
    return static_particle[l.first.z + k - l.count.x - l.count.y].w;
//#else
    return params.pressure_slots;
//#endif
}

// Diagonal of a slot, 0 if its pressure is no unknown.
fn diagonal_of(slot: u32) -> f32 {
    var diagonal = 0.0;
    if slot < params.pressure_slots {
        diagonal = source_diagonal[slot].y;
    }
    return diagonal;
}

//#if RANKS
// Whether a cell of the finest level is this rank's. The others' have no unknowns here: their ranks tell which have some (shaders/halo.wgsl), and a
// wall at a border of cells that its host has in another column than the device goes uncorrected.
fn is_own(cell: u32) -> bool {
    let own = hierarchy.operation[0].zw;
    return cell >= own.x && cell < own.y;
}

//#endif
// Count the unknowns of each cell and mark the cells above.
@compute @workgroup_size(WORKGROUP)
fn mark(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    for (var cell = thread(id); cell < params.cell_total; cell += group_count(groups) * WORKGROUP) {
//#if RANKS
        if !is_own(cell) {
            continue;
        }
//#endif
        let l = listed(cell);
        let all = l.count.x + l.count.y + l.count.z;
        var unknowns = 0u;
        for (var k = 0u; k < all; k++) {
            unknowns += u32(diagonal_of(slot_of(l, k)) > 0.0);
        }
        if unknowns > 0u {
            set_cell_mark(hierarchy.level[0].w + cell, unknowns);
            var c = coordinates_of(0u, cell);
            for (var level = 1u; level < hierarchy.levels; level++) {
                c = c >> vec3u(1u);
                set_cell_mark(cell_at(level, c), ABOVE);
            }
        }
    }
}

var<workgroup> lane: array<vec2u, 256>;
var<workgroup> across: array<vec2u, 16>;

// Sum of the values of lower threads (xy), and of all (zw).
fn exclusive_scan(value: vec2u, t: u32) -> vec4u {
    workgroupBarrier();
    lane[t] = value;
    workgroupBarrier();
    if t < 16u {
        var sum = vec2u(0u);
        for (var k = 0u; k < 16u; k++) {
            let v = lane[t * 16u + k];
            lane[t * 16u + k] = sum;
            sum += v;
        }
        across[t] = sum;
    }
    workgroupBarrier();
    var before = vec2u(0u);
    var total = vec2u(0u);
    for (var k = 0u; k < 16u; k++) {
        if k < t / 16u {
            before += across[k];
        }
        total += across[k];
    }
    return vec4u(before + lane[t], total);
}

// Rows and members that a cell brings.
fn brings(cell: u32) -> vec2u {
    if cell >= hierarchy.cells {
        return vec2u(0u);
    }
    let mark = cell_mark_at(cell);
    return vec2u(u32(mark != 0u), mark & ~ABOVE);
}

fn blocks() -> u32 {
    return (hierarchy.cells + 4u * WORKGROUP - 1u) / (4u * WORKGROUP);
}

// Scan within blocks of four cells a thread.
@compute @workgroup_size(WORKGROUP)
fn scan_blocks(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32,
               @builtin(num_workgroups) groups: vec3u) {
    for (var block = group_number(group); block < blocks(); block += group_count(groups)) {
        let first = (block * WORKGROUP + t) * 4u;
        var sum = vec2u(0u);
        for (var k = 0u; k < 4u; k++) {
            sum += brings(first + k);
        }
        let scan = exclusive_scan(sum, t);
        var before = scan.xy;
        for (var k = 0u; k < 4u; k++) {
            if first + k < hierarchy.cells {
                set_cell_row(first + k, before);
            }
            before += brings(first + k);
        }
        if t == 0u {
            row_block[block] = scan.zw;
        }
    }
}

// One workgroup scans the sums of the blocks.
@compute @workgroup_size(WORKGROUP)
fn scan_sums(@builtin(local_invocation_index) t: u32) {
    var carry = vec2u(0u);
    for (var first = 0u; first < blocks(); first += WORKGROUP) {
        var value = vec2u(0u);
        if first + t < blocks() {
            value = row_block[first + t];
        }
        let scan = exclusive_scan(value, t);
        if first + t < blocks() {
            row_block[first + t] = carry + scan.xy;
        }
        carry += scan.zw;
    }
    if t == 0u {
        row_cell[hierarchy.capacity].x = min(carry.x, hierarchy.capacity);
    }
}

fn number_row(cell: u32, before: vec2u) {
    let number = cell_row_at(cell) + before;
    let own = brings(cell);
    // The level that the cell belongs to: levels lie coarsest first.
    var level = 0u;
    while cell < hierarchy.level[level].w {
        level++;
    }
    if cell == hierarchy.level[level].w {
        row_cell[hierarchy.capacity + 1u + level].x = min(number.x, hierarchy.capacity);
    }
    let used = own.x > 0u && number.x < hierarchy.capacity;
    set_cell_row(cell, vec2u(select(0u, number.x + 1u, used), number.y));
    if used {
        row_cell[number.x] = vec4u(cell - hierarchy.level[level].w, 0u, number.y, number.y + own.y);
    }
}

@compute @workgroup_size(WORKGROUP)
fn number_rows(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32,
               @builtin(num_workgroups) groups: vec3u) {
    for (var block = group_number(group); block < blocks(); block += group_count(groups)) {
        for (var k = 0u; k < 4u; k++) {
            let cell = (block * WORKGROUP + t) * 4u + k;
            if cell < hierarchy.cells {
                number_row(cell, row_block[block]);
            }
        }
    }
}

// The unknowns of each cell, in the order of the lists; they learn their row.
@compute @workgroup_size(WORKGROUP)
fn members(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    for (var cell = thread(id); cell < params.cell_total; cell += group_count(groups) * WORKGROUP) {
        let row = cell_row_at(hierarchy.level[0].w + cell);
//#if RANKS
        if !is_own(cell) {
            continue;
        }
//#endif
        if row.x > 0u {
//#if PERIODIC
            let place = cell;
//#else
            let place = bitcast<u32>(place_of(vec3i(coordinates_of(0u, cell))));
//#endif
            let l = listed(cell);
            let all = l.count.x + l.count.y + l.count.z;
            var to = row.y;
            for (var k = 0u; k < all; k++) {
                let slot = slot_of(l, k);
                let diagonal = diagonal_of(slot);
                if diagonal > 0.0 {
                    member[to] = vec2u(slot, bitcast<u32>(diagonal));
                    aggregate[slot] = vec2u(row.x, place);
                    to++;
                }
            }
        }
    }
}

// Pairs of a weight re / r - 1 below this are as far apart as they reach; their distance errs by as much in f32.
const REACH_END: f32 = 1e-4;

//#if RANKS
// No column of cells.
const NOWHERE: u32 = 0xffffffffu;
// Of the copy of an unknown, without a row so far.
const UNKNOWN: vec2u = vec2u(0u, 1u);

// Copies of other ranks' unknowns, which take_unknown of shaders/halo.wgsl has named, learn the row of their cell.
@compute @workgroup_size(WORKGROUP)
fn place_copies(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let column = hierarchy.level[0].y * hierarchy.level[0].z;
    for (var c = thread(id); c < 2u * column; c += group_count(groups) * WORKGROUP) {
        let beside = select(hierarchy.operation[1].z, hierarchy.operation[1].w, c >= column);
        if beside == NOWHERE {
            continue;
        }
        let cell = beside + c % column;
        let row = cell_row_at(hierarchy.level[0].w + cell).x;
//#if PERIODIC
        let place = cell;
//#else
        let place = bitcast<u32>(place_of(vec3i(coordinates_of(0u, cell))));
//#endif
        let l = listed(cell);
        let particles = l.count.x + l.count.y + l.count.z;
        for (var k = 0u; k < particles; k++) {
            let slot = slot_of(l, k);
            if slot < params.pressure_slots && all(aggregate[slot] == UNKNOWN) {
                aggregate[slot] = vec2u(row, place);
            }
        }
    }
}

//#endif
var<private> value: array<f32, 27>;
var<private> column: array<u32, 27>;

fn empty_stencil(row: u32) {
    for (var k = 0u; k < 27u; k++) {
        value[k] = 0.0;
        column[k] = row;
    }
}

// Keep the stencil; the row learns its parent.
fn keep_stencil(level: u32, row: u32, c: vec3u) {
    for (var k = 0u; k < 27u; k++) {
        set_entry(k, row, vec2u(column[k], bitcast<u32>(value[k])));
    }
    if level + 1u < hierarchy.levels {
        row_cell[row].y = cell_row_at(cell_at(level + 1u, c >> vec3u(1u))).x;
    }
}

// Operator of the finest level: what the rows of a cell's unknowns hold, by the cell that a neighbour lies in.
@compute @workgroup_size(WORKGROUP)
fn galerkin(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let end = end_row(0u);
    for (var row = first_row(0u) + thread(id); row < end; row += group_count(groups) * WORKGROUP) {
        let cell = row_cell[row];
        let c = coordinates_of(0u, cell.x);
//#if PERIODIC
//#else
        let own = place_of(vec3i(c)) - 13;
//#endif
        empty_stencil(row);
        for (var m = cell.z; m < cell.w; m++) {
            let i = member[m].x;
            value[13] += bitcast<f32>(member[m].y);
            let x = position[i].xyz;
            let near = near_of(neighbour_count[i]);
            for (var k = 0u; k < near; k++) {
                let j = neighbour_list_at(k, i);
                let other = aggregate[j];
                if other.x > 0u {
                    let r = offset(x, position[j].xyz);
                    // Listed pairs lay in neighbouring cells when both were sorted: within the stencil, but for those as far apart as
                    // the lists reach where a wall lies on a border of cells, on this side or on that one by round-off.
                    let w = weight(dot(r, r));
                    if w < REACH_END { continue; }
//#if PERIODIC
                    let to = u32(place_of(step_to(0u, c, coordinates_of(0u, other.y))) + 13);
//#else
                    let to = u32(bitcast<i32>(other.y) - own);
//#endif
                    value[to] -= w;
                    column[to] = other.x - 1u;
                }
            }
        }
        keep_stencil(0u, row, c);
    }
}

// Operator of a level from that of the level below: entries of up to eight rows, by the parents of row and column.
fn coarsen(level: u32, row: u32) {
    let p = coordinates_of(level, row_cell[row].x);
    let size = hierarchy.level[level - 1u].xyz;
    empty_stencil(row);
    for (var octant = 0u; octant < 8u; octant++) {
        let c = 2u * p + ((vec3u(octant) >> vec3u(2u, 1u, 0u)) & vec3u(1u));
        if all(c < size) {
            let child = cell_row_at(cell_at(level - 1u, c)).x;
            if child > 0u {
                for (var k = 0u; k < 27u; k++) {
                    let e = entry_at(k, child - 1u);
                    let v = bitcast<f32>(e.y);
                    if v != 0.0 {
                        let d = vec3i(vec3u(k / 9u, k / 3u % 3u, k % 3u)) - 1;
//#if PERIODIC
                        let neighbour = vec3u(vec3i(c + size) + d) % size;
                        let to = u32(place_of(step_to(level, p, neighbour >> vec3u(1u))) + 13);
//#else
                        let to = u32(place_of(((vec3i(c) + d) >> vec3u(1u)) - vec3i(p)) + 13);
//#endif
                        value[to] += v;
                        column[to] = row_cell[e.x].y - 1u;
                    }
                }
            }
        }
    }
    keep_stencil(level, row, p);
}

// The rows of a level, from row `id` of it on, by so many threads.
fn coarsen_over(level: u32, id: u32, threads: u32) {
    let end = end_row(level);
    for (var row = first_row(level) + id; row < end; row += threads) {
        coarsen(level, row);
    }
}

@compute @workgroup_size(WORKGROUP)
fn coarsen_second(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    coarsen_over(1u, thread(id), group_count(groups) * WORKGROUP);
}

@compute @workgroup_size(WORKGROUP)
fn coarsen_third(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    coarsen_over(2u, thread(id), group_count(groups) * WORKGROUP);
}

@compute @workgroup_size(WORKGROUP)
fn coarsen_fourth(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    coarsen_over(3u, thread(id), group_count(groups) * WORKGROUP);
}

// All further levels, one after the other, by one workgroup: they are small. The first of them is that of the cycle's first operation over
// small levels, or the third.
@compute @workgroup_size(WORKGROUP)
fn coarsen_rest(@builtin(local_invocation_index) t: u32) {
    for (var level = max(2u, hierarchy.operation[0].y); level < hierarchy.levels; level++) {
        coarsen_over(level, t, WORKGROUP);
        storageBarrier();
    }
}
