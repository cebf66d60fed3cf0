// Coarse part of the multigrid preconditioner: the residual of the particles goes to the cells, a cycle over the levels
// gives a correction, and that is added to the particles. Levels: shaders/multigrid_levels.wgsl; the sweeps over the
// particles themselves: shaders/conjugate_gradient.wgsl.
// Twin: src/kernels/multigrid.rs
//
// A level holds x, y and b. Going down leaves x = w b / D on the next level, going up and sweeping forth go from x to y,
// sweeping back from y to x; a level's answer is in y. Large levels take a dispatch an operation; the small ones are
// done by one workgroup in one dispatch, which follows the list of operations that the plan made.

@group(0) @binding(2) var<uniform> hierarchy: Hierarchy;
@group(0) @binding(3) var<storage, read> cell_row: array<vec2u>;
@group(0) @binding(4) var<storage, read> row_cell: array<vec4u>;
@group(0) @binding(5) var<storage, read> entry: array<vec2u>;
@group(0) @binding(6) var<storage, read> member: array<vec2u>;
@group(0) @binding(7) var<storage, read> aggregate: array<vec2u>;
@group(0) @binding(8) var<storage, read> smoothed: array<f32>; // residual of the particles after their first sweep
@group(0) @binding(9) var<storage, read_write> coarse: array<f32>; // x, y and b of all rows
@group(0) @binding(10) var<storage, read> preconditioned: array<vec4f>;
@group(0) @binding(11) var<storage, read_write> corrected: array<vec4f>;
@group(0) @binding(12) var<storage, read> solve: Solve;

// The first word of what crate::backend::gpu::layout::Solve is: the iteration is done.
struct Solve {
    done: u32,
}

// As crate::kernels::multigrid.
const DAMPING: f32 = 0.9;
const OVER_CORRECTION: f32 = 1.4;

// As crate::backend::gpu::hierarchy::Operation.
const DOWN: u32 = 0u;
const UP: u32 = 1u;
const FORTH: u32 = 2u;
const BACK: u32 = 3u;

var<workgroup> part: array<f32, 256>;

fn first_row(level: u32) -> u32 {
    return row_cell[hierarchy.capacity + 1u + level].x;
}

fn end_row(level: u32) -> u32 {
    return row_cell[hierarchy.capacity + level].x;
}

fn diagonal(row: u32) -> f32 {
    return bitcast<f32>(entry_at(13u, row).y);
}

fn place_b(row: u32) -> u32 {
    return 2u * hierarchy.capacity + row;
}

// (A v)_row with v at `source`.
fn multiply(row: u32, source: u32) -> f32 {
    var sum = 0.0;
    for (var k = 0u; k < 27u; k++) {
        let e = entry_at(k, row);
        sum += bitcast<f32>(e.y) * coarse[source + e.x];
    }
    return sum;
}

fn set_b(row: u32, b: f32) {
    coarse[place_b(row)] = b;
    coarse[row] = DAMPING * b / diagonal(row);
}

// b of the next level = sums of b - A x over the up to eight rows of each of its cells: a thread for each of the eight.
fn down(level: u32, group: u32, groups: u32, t: u32) {
    let first = first_row(level + 1u);
    let end = end_row(level + 1u);
    let fine = hierarchy.level[level];
    let next = hierarchy.level[level + 1u];
    for (var base = first + group * 32u; base < end; base += groups * 32u) {
        let row = base + t / 8u;
        var r = 0.0;
        if row < end {
            let cell = row_cell[row].x;
            let p = vec3u(cell / (next.y * next.z), cell / next.z % next.y, cell % next.z);
            let c = 2u * p + ((vec3u(t) >> vec3u(2u, 1u, 0u)) & vec3u(1u));
            if all(c < fine.xyz) {
                let child = cell_row_at(fine.w + (c.x * fine.y + c.y) * fine.z + c.z).x;
                if child > 0u {
                    r = coarse[place_b(child - 1u)] - multiply(child - 1u, 0u);
                }
            }
        }
        part[t] = r;
        workgroupBarrier();
        if t % 8u == 0u && row < end {
            var sum = 0.0;
            for (var k = 0u; k < 8u; k++) {
                sum += part[t + k];
            }
            set_b(row, sum);
        }
        workgroupBarrier();
    }
}

// y = one sweep from x + the correction of the next level.
fn up(level: u32, id: u32, threads: u32) {
    let y = hierarchy.capacity;
    let factor = select(1.0, OVER_CORRECTION, level == 0u);
    let end = end_row(level);
    for (var row = first_row(level) + id; row < end; row += threads) {
        var sum = 0.0;
        var x = 0.0;
        for (var k = 0u; k < 27u; k++) {
            let e = entry_at(k, row);
            x = coarse[e.x] + factor * coarse[y + row_cell[e.x].y - 1u];
            sum += bitcast<f32>(e.y) * x;
        }
        x = coarse[row] + factor * coarse[y + row_cell[row].y - 1u];
        coarse[y + row] = x + DAMPING * (coarse[place_b(row)] - sum) / diagonal(row);
    }
}

// One sweep from the vector at `source` to the one at `to`.
fn sweep(level: u32, source: u32, to: u32, id: u32, threads: u32) {
    let end = end_row(level);
    for (var row = first_row(level) + id; row < end; row += threads) {
        let r = coarse[place_b(row)] - multiply(row, source);
        coarse[to + row] = coarse[source + row] + DAMPING * r / diagonal(row);
    }
}

fn stopped() -> bool {
    return solve.done != 0u;
}

// `down` and `up` of a large level, by all workgroups of a dispatch.
fn down_over(level: u32, group: vec3u, groups: vec3u, t: u32) {
    if stopped() {
        return;
    }
    down(level, group_number(group), group_count(groups), t);
}

fn up_over(level: u32, id: vec3u, groups: vec3u) {
    if stopped() {
        return;
    }
    up(level, thread(id), group_count(groups) * WORKGROUP);
}

// Residuals of the particles onto the finest level.
@compute @workgroup_size(WORKGROUP)
fn gather(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    if stopped() {
        return;
    }
    let end = end_row(0u);
    for (var row = first_row(0u) + thread(id); row < end; row += group_count(groups) * WORKGROUP) {
        let cell = row_cell[row];
        var sum = 0.0;
        for (var m = cell.z; m < cell.w; m++) {
            sum += smoothed[member[m].x];
        }
        set_b(row, sum);
    }
}

@compute @workgroup_size(WORKGROUP)
fn down_first(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32,
              @builtin(num_workgroups) groups: vec3u) {
    down_over(0u, group, groups, t);
}

@compute @workgroup_size(WORKGROUP)
fn up_first(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    up_over(0u, id, groups);
}

@compute @workgroup_size(WORKGROUP)
fn back_first(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    if stopped() {
        return;
    }
    sweep(0u, hierarchy.capacity, 0u, thread(id), group_count(groups) * WORKGROUP);
}

@compute @workgroup_size(WORKGROUP)
fn down_second(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32,
               @builtin(num_workgroups) groups: vec3u) {
    down_over(1u, group, groups, t);
}

@compute @workgroup_size(WORKGROUP)
fn up_second(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    up_over(1u, id, groups);
}

@compute @workgroup_size(WORKGROUP)
fn down_third(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32,
              @builtin(num_workgroups) groups: vec3u) {
    down_over(2u, group, groups, t);
}

@compute @workgroup_size(WORKGROUP)
fn up_third(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    up_over(2u, id, groups);
}

@compute @workgroup_size(WORKGROUP)
fn down_fourth(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32,
              @builtin(num_workgroups) groups: vec3u) {
    down_over(3u, group, groups, t);
}

@compute @workgroup_size(WORKGROUP)
fn up_fourth(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    up_over(3u, id, groups);
}

// The cycle over the small levels.
@compute @workgroup_size(WORKGROUP)
fn small(@builtin(local_invocation_index) t: u32) {
    if stopped() {
        return;
    }
    for (var k = 0u; k < hierarchy.operations; k++) {
        let level = hierarchy.operation[k].y;
        switch hierarchy.operation[k].x {
            case DOWN: {
                down(level, 0u, 1u, t);
            }
            case UP: {
                up(level, t, WORKGROUP);
            }
            case FORTH: {
                sweep(level, 0u, hierarchy.capacity, t, WORKGROUP);
            }
            default: {
                sweep(level, hierarchy.capacity, 0u, t, WORKGROUP);
            }
        }
        storageBarrier();
    }
}

// The particles take the correction of their cell.
@compute @workgroup_size(WORKGROUP)
fn spread(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    if stopped() {
        return;
    }
    for (var i = thread(id); i < params.pressure_slots; i += group_count(groups) * WORKGROUP) {
        var me = preconditioned[i];
        let row = aggregate[i].x;
        if row > 0u {
            me.w += OVER_CORRECTION * coarse[hierarchy.capacity + row - 1u];
        }
        corrected[i] = me;
    }
}
