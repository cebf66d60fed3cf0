// Level of the pressure where the water fills all its room. Without a free surface the pressure equation fixes the pressure but
// for a constant: the mean of the right side, which alpha alone would have to balance, is taken off, and the smallest
// pressure found is made 0.
// Twin: src/kernels/pressure_level.rs

@group(0) @binding(2) var<storage, read> state: array<u32>;
@group(0) @binding(3) var<storage, read_write> source_diagonal: array<vec2f>;
@group(0) @binding(4) var<storage, read_write> pressure: array<f32>;
// Of the workgroups: the sum of right sides and the number of rows, then the smallest pressure.
@group(0) @binding(5) var<storage, read_write> partial_sum: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> counters: array<atomic<u32>>;

// The largest f32.
const NONE: f32 = 3.4028234e38;

var<workgroup> lane: array<vec2f, 256>;
var<workgroup> row: array<vec2f, 16>;

fn stride() -> u32 {
    return params.reduction_groups * WORKGROUP;
}

// Whether slot `i` is a row of the pressure equation that is computed here.
fn is_row(i: u32) -> bool {
//#if RANKS
    return source_diagonal[i].y > 0.0;
//#else
    return state[i] == INNER;
//#endif
}

// Sum over the workgroup, the same on every thread and in a fixed order.
fn total(value: vec2f, t: u32) -> vec2f {
    lane[t] = value;
    workgroupBarrier();
    if t < 16u {
        var sum = vec2f(0.0);
        for (var k = 0u; k < 16u; k++) {
            sum += lane[k * 16u + t];
        }
        row[t] = sum;
    }
    workgroupBarrier();
    var sum = vec2f(0.0);
    for (var k = 0u; k < 16u; k++) {
        sum += row[k];
    }
    return sum;
}

// Smallest of the workgroup.
fn lowest(value: f32, t: u32) -> f32 {
    lane[t].x = value;
    workgroupBarrier();
    if t < 16u {
        var least = NONE;
        for (var k = 0u; k < 16u; k++) {
            least = min(least, lane[k * 16u + t].x);
        }
        row[t].x = least;
    }
    workgroupBarrier();
    var least = NONE;
    for (var k = 0u; k < 16u; k++) {
        least = min(least, row[k].x);
    }
    return least;
}

@compute @workgroup_size(WORKGROUP)
fn sum_source(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
              @builtin(workgroup_id) group: vec3u) {
    var sum = vec2f(0.0);
    for (var i = id.x; i < params.pressure_slots; i += stride()) {
        sum += select(vec2f(0.0), vec2f(source_diagonal[i].x, 1.0), is_row(i));
    }
    sum = total(sum, t);
    if t == 0u {
        partial_sum[group.x] = vec4f(sum, 0.0, 0.0);
    }
}

@compute @workgroup_size(WORKGROUP)
fn subtract_mean(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32) {
    var sum = vec2f(0.0);
    for (var k = t; k < params.reduction_groups; k += WORKGROUP) {
        sum += partial_sum[k].xy;
    }
    sum = total(sum, t);
    let mean = sum.x / max(sum.y, 1.0);
    for (var i = id.x; i < params.pressure_slots; i += stride()) {
        if is_row(i) {
            source_diagonal[i].x -= mean;
        }
    }
}

@compute @workgroup_size(WORKGROUP)
fn find_lowest(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
               @builtin(workgroup_id) group: vec3u) {
    var least = NONE;
    for (var i = id.x; i < params.pressure_slots; i += stride()) {
        least = min(least, select(NONE, pressure[i], is_row(i)));
    }
    least = lowest(least, t);
    if t == 0u {
        partial_sum[group.x] = vec4f(least, 0.0, 0.0, 0.0);
    }
}

@compute @workgroup_size(WORKGROUP)
fn raise(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32) {
    var least = NONE;
    for (var k = t; k < params.reduction_groups; k += WORKGROUP) {
        least = min(least, partial_sum[k].x);
    }
    least = lowest(least, t);
    var cut = 0u;
    for (var i = id.x; i < params.pressure_slots; i += stride()) {
        if is_row(i) {
            let p = pressure[i] - least;
            cut += u32(p > now.pressure_max);
            pressure[i] = min(p, now.pressure_max);
        }
    }
    if cut > 0u {
        atomicAdd(&counters[PRESSURE_CLAMPS], cut);
    }
}
