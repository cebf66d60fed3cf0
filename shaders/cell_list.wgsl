// Cell list: count, scan, stable scatter. The fluid is reordered by cell, ghosts last; moving solids are indexed by cell.
// Twin: src/kernels/cell_list.rs
//
// One counting sort serves both. Its keys are the cell of a fluid particle, then ghosts by their slots, GHOST_BLOCK slots a
// key, then the cells once more for the particles of moving solids. Atomic arrival order decides where a particle of a key
// lands in `unsorted`; `place` then ranks each within its key by slot, so the final order is the twin's and the same in
// every run. Fluid that has left through a periodic side is brought back on the way. Ranking compares all of a key with each other, which is why the ghosts, however many, do not share one.

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read> pressure: array<f32>;
@group(0) @binding(5) var<storage, read_write> cell_of: array<vec2u>; // key, arrival in the key
@group(0) @binding(6) var<storage, read_write> cell_count: array<atomic<u32>>;
@group(0) @binding(7) var<storage, read_write> cell_start: array<u32>;
@group(0) @binding(8) var<storage, read_write> block_sum: array<u32>;
@group(0) @binding(9) var<storage, read_write> unsorted: array<u32>;
// Positions, velocities and pressures of the fluid in the new order, one after the other; copied back afterwards.
// By numbers: four invocations that each write a component of one vector would race.
@group(0) @binding(10) var<storage, read_write> sorted: array<f32>;
@group(0) @binding(11) var<storage, read_write> moving_slot: array<vec2u>; // slot, and where it faces
@group(0) @binding(12) var<storage, read_write> counters: array<atomic<u32>>;

fn particles() -> u32 {
    return params.fluid + params.moving;
}

fn keys() -> u32 {
//#if MOVING
    return moving_key() + params.cell_total;
//#else
    return moving_key();
//#endif
}

fn slot_of(k: u32) -> u32 {
//#if MOVING
    if k >= params.fluid {
        return moving_slot_of(k - params.fluid);
    }
//#endif
    return k;
}

@compute @workgroup_size(WORKGROUP)
fn count(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k >= particles() {
        return;
    }
    let x = position[slot_of(k)];
    var key = params.cell_total + k / GHOST_BLOCK;
    if k >= params.fluid {
        key = moving_key() + cell_index(cell_coordinates(x.xyz));
//#if RANKS
    } else if is_water(x.w) || x.w == FOREIGN {
//#else
    } else if is_water(x.w) {
//#endif
        if in_domain(wrapped(x.xyz), velocity[k].xyz) {
            key = cell_index(cell_coordinates(x.xyz));
        } else {
            atomicAdd(&counters[LOST], 1u);
        }
    }
    cell_of[k] = vec2u(key, add_cell_count(key, 1u));
}

var<workgroup> lane: array<u32, 256>;
var<workgroup> row: array<u32, 16>;

// Sum of the values of lower threads, and of all.
fn exclusive_scan(value: u32, t: u32) -> vec2u {
    workgroupBarrier();
    lane[t] = value;
    workgroupBarrier();
    if t < 16u {
        var sum = 0u;
        for (var k = 0u; k < 16u; k++) {
            let v = lane[t * 16u + k];
            lane[t * 16u + k] = sum;
            sum += v;
        }
        row[t] = sum;
    }
    workgroupBarrier();
    var before = 0u;
    var total = 0u;
    for (var k = 0u; k < 16u; k++) {
        if k < t / 16u {
            before += row[k];
        }
        total += row[k];
    }
    return vec2u(before + lane[t], total);
}

fn blocks() -> u32 {
    return (keys() + 4u * WORKGROUP - 1u) / (4u * WORKGROUP);
}

// Scan within blocks of four keys a thread.
@compute @workgroup_size(WORKGROUP)
fn scan_blocks(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32,
               @builtin(num_workgroups) groups: vec3u) {
    for (var block = group_number(group); block < blocks(); block += group_count(groups)) {
        let first = (block * WORKGROUP + t) * 4u;
        var before: vec4u;
        var sum = 0u;
        for (var k = 0u; k < 4u; k++) {
            before[k] = sum;
            if first + k < keys() {
                sum += cell_count_at(first + k);
            }
        }
        let scan = exclusive_scan(sum, t);
        for (var k = 0u; k < 4u; k++) {
            if first + k < keys() {
                set_cell_start(first + k, scan.x + before[k]);
            }
        }
        if t == 0u {
            block_sum[block] = scan.y;
        }
    }
}

// One workgroup scans the sums of the blocks.
@compute @workgroup_size(WORKGROUP)
fn scan_sums(@builtin(local_invocation_index) t: u32) {
    var carry = 0u;
    for (var first = 0u; first < blocks(); first += WORKGROUP) {
        var value = 0u;
        if first + t < blocks() {
            value = block_sum[first + t];
        }
        let scan = exclusive_scan(value, t);
        if first + t < blocks() {
            block_sum[first + t] = carry + scan.x;
        }
        carry += scan.y;
    }
}

@compute @workgroup_size(WORKGROUP)
fn scan_add(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32,
            @builtin(num_workgroups) groups: vec3u) {
    for (var block = group_number(group); block < blocks(); block += group_count(groups)) {
        let first = (block * WORKGROUP + t) * 4u;
        for (var k = 0u; k < 4u; k++) {
            if first + k < keys() {
                set_cell_start(first + k, cell_start_at(first + k) + block_sum[block]);
            }
        }
    }
    if group_number(group) == 0u && t == 0u {
        set_cell_start(keys(), particles());
    }
}

@compute @workgroup_size(WORKGROUP)
fn scatter(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k >= particles() {
        return;
    }
    let cell = cell_of[k];
    unsorted[cell_start_at(cell.x) + cell.y] = k;
}

fn store(at: u32, v: vec4f) {
    set_sorted(at, v.x);
    set_sorted(at + 1u, v.y);
    set_sorted(at + 2u, v.z);
    set_sorted(at + 3u, v.w);
}

@compute @workgroup_size(WORKGROUP)
fn place(@builtin(global_invocation_id) id: vec3u) {
    let at = thread(id);
    if at >= particles() {
        return;
    }
    let me = unsorted[at];
    let key = cell_of[me].x;
    let first = cell_start_at(key);
    let end = cell_start_at(key + 1u);
    var rank = 0u;
    for (var k = first; k < end; k++) {
        rank += u32(unsorted[k] < me);
    }
    let to = first + rank;
//#if MOVING
    if me >= params.fluid {
        let slot = slot_of(me);
        moving_slot[to - params.fluid] = vec2u(slot, bitcast<u32>(velocity[slot].w));
        return;
    }
//#endif
    let velocities = 4u * params.fluid;
    let pressures = 2u * velocities;
    if key < params.cell_total {
        let x = position[me];
        store(4u * to, vec4f(wrapped(x.xyz), x.w));
        store(velocities + 4u * to, velocity[me]);
        set_sorted(pressures + to, pressure[me]);
    } else {
        store(4u * to, vec4f(params.lower, GHOST));
        store(velocities + 4u * to, vec4f(0.0, 0.0, 0.0, velocity[me].w));
        set_sorted(pressures + to, 0.0);
    }
}
