// Pressure Poisson equation by preconditioned conjugate gradients, matrix-free over the neighbour lists:
// (A p)_i = D_i p_i - sum w_ij p_j.
// Twin: src/kernels/conjugate_gradient.rs (the operator) and src/pressure/cg.rs (the iteration)
//
// Two dispatches an iteration with the diagonal as preconditioner. With z = r / D of the last residual,
//   multiply:  beta = rz / rz_old,  p = z + beta p,  q = A z + beta q (so q = A p),  partial sums of p.q
//   advance:   alpha = rz / p.q,  x += alpha p,  r -= alpha q,  z = r / D,  partial sums of r.z and r.r
// With multigrid `advance` leaves z = w r / D, the first sweep from zero, and a cycle follows it that makes a better z:
//   descend:   its residual r - A z goes to the cells; the verdict of the iteration falls here
//   (shaders/multigrid.wgsl adds the correction of the cells)
//   ascend:    z = one more sweep from there, partial sums of r.z
// With free bodies `respond` of shaders/coupling.wgsl goes before every dispatch that multiplies.
// z lies next to the positions (one load a neighbour). Sums are trees of fixed shape: 16 x 16 in a workgroup, then every
// workgroup of the next dispatch adds the workgroups' sums in the same order, so all come to the same scalars and the same
// verdict without another dispatch. Scalars and verdict stay here; the host looks at `solve` every few iterations.
// Words of `solve` that a dispatch writes are read by later dispatches only; `done` is the exception and atomic, and who
// sees it early stops for the same reason a moment sooner.

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(4) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(5) var<storage, read> source_diagonal: array<vec2f>;
@group(0) @binding(6) var<storage, read_write> pressure: array<f32>;
@group(0) @binding(7) var<storage, read_write> preconditioned: array<vec4f>; // position, z
@group(0) @binding(8) var<storage, read_write> residual: array<f32>;
@group(0) @binding(9) var<storage, read_write> search: array<vec2f>; // p, q
// Sums of the workgroups: [0, groups) of `start_residual` and `multiply`, [groups, 2 groups) of `start` and `advance`.
@group(0) @binding(10) var<storage, read_write> partial_sum: array<vec4f>;
@group(0) @binding(11) var<storage, read_write> solve: Solve;
@group(0) @binding(12) var<storage, read_write> counters: array<atomic<u32>>;
//#if MULTIGRID
@group(0) @binding(13) var<storage, read_write> smoothed: array<f32>; // r - A z after the first sweep
@group(0) @binding(14) var<storage, read> corrected: array<vec4f>; // position, z with the cells' correction

// As crate::kernels::multigrid.
const DAMPING: f32 = 0.9;
//#else
const DAMPING: f32 = 1.0;
//#endif

//#if SURFACE_PRESSURE
@group(0) @binding(16) var<storage, read> surface_pressure: array<f32>; // 0 where the pressure is unknown
//#endif

//#if COUPLED
// Rows of free bodies and what the bodies answer; see shaders/coupling.wgsl.
@group(0) @binding(15) var<storage, read> coupling: array<vec4f>;

// Row i of kappa S M^-1 S^T z: what the body at i makes of z.
fn of_body(i: u32) -> f32 {
    let k = i - params.fluid;
    if i < params.fluid || k >= params.moving_wall {
        return 0.0;
    }
    let row = coupled_row(k);
    let force = coupling[row];
    let y = number_of(force.w);
    return dot(force.xyz, coupling[y].xyz) + dot(coupling[row + 1u].xyz, coupling[y + 1u].xyz);
}

//#endif
// As crate::backend::gpu::layout::Solve.
struct Solve {
    done: atomic<u32>,
    outcome: u32,
    iterations: u32,
    unknowns: atomic<u32>,
    source_squared: f32,
    residual_squared: f32,
    true_residual_squared: f32,
    rz: f32,
    rz_old: f32,
}

// As crate::pressure::Outcome.
const CONVERGED: u32 = 0u;
const ZERO_SOURCE: u32 = 1u;
const MAX_ITERATIONS: u32 = 2u;
const BREAKDOWN: u32 = 3u;
const NOT_FINITE: u32 = 4u;
const GO_ON: u32 = 5u;

var<workgroup> lane: array<vec4f, 256>;
var<workgroup> row: array<vec4f, 16>;
var<workgroup> stop: u32;

// Sum over the workgroup, the same on every thread and in a fixed order.
fn workgroup_sum(value: vec4f, t: u32) -> vec4f {
    lane[t] = value;
    workgroupBarrier();
    if t < 16u {
        var sum = vec4f(0.0);
        for (var k = 0u; k < 16u; k++) {
            sum += lane[k * 16u + t];
        }
        row[t] = sum;
    }
    workgroupBarrier();
    var sum = vec4f(0.0);
    for (var k = 0u; k < 16u; k++) {
        sum += row[k];
    }
    return sum;
}

// Sum of the workgroups' sums; in w whether the iteration is done, which so reaches every thread without a barrier of
// its own.
fn sum_of_partials(first: u32, t: u32) -> vec4f {
    var sum = vec4f(0.0);
    if t == 0u {
        sum.w = f32(atomicLoad(&solve.done));
    }
    for (var k = t; k < params.reduction_groups; k += WORKGROUP) {
        sum += partial_sum[first + k];
    }
    return workgroup_sum(sum, t);
}

fn done(t: u32) -> bool {
    if t == 0u {
        stop = atomicLoad(&solve.done);
    }
    return workgroupUniformLoad(&stop) != 0u;
}

fn finish(outcome: u32) {
    solve.outcome = outcome;
    atomicStore(&solve.done, 1u);
}

fn stride() -> u32 {
    return params.reduction_groups * WORKGROUP;
}

// sum w_ij z_j. Rows whose pressure is no unknown hold z = 0, which makes surface particles Dirichlet points.
fn neighbours(i: u32, x: vec3f) -> f32 {
    let near = near_of(neighbour_count[i]);
    var sum = 0.0;
    for (var k = 0u; k < near; k++) {
        let other = preconditioned[neighbour_list_at(k, i)];
        let r = offset(x, other.xyz);
        sum += weight(dot(r, r)) * other.w;
    }
    return sum;
}

// x next to the positions, 0 where it is no unknown.
@compute @workgroup_size(WORKGROUP)
fn pack(@builtin(global_invocation_id) id: vec3u) {
    for (var i = id.x; i < params.pressure_slots; i += stride()) {
        let x = select(0.0, pressure[i], source_diagonal[i].y > 0.0);
        pressure[i] = x;
        preconditioned[i] = vec4f(position[i].xyz, x);
    }
}

// (A z)_i of a row with an unknown, with what a body adds.
fn times(i: u32, diagonal: f32, z: vec4f) -> f32 {
    let water = diagonal * z.w - neighbours(i, z.xyz);
//#if COUPLED
    return water + of_body(i);
//#else
    return water;
//#endif
}

// The diagonal that z is divided by: multigrid goes by the water's alone.
fn divisor(i: u32, diagonal: f32) -> f32 {
//#if MULTIGRID
    return diagonal;
//#else
//#if COUPLED
    let k = i - params.fluid;
    if i >= params.fluid && k < params.moving_wall {
        return diagonal + coupling[coupled_row(k) + 1u].w;
    }
//#endif
    return diagonal;
//#endif
}

fn residuals(id: u32, t: u32) -> vec4f {
    var sum = vec4f(0.0);
    for (var i = id; i < params.pressure_slots; i += stride()) {
        let equation = source_diagonal[i];
        var r = 0.0;
        if equation.y > 0.0 {
            let me = preconditioned[i];
            r = equation.x - times(i, equation.y, me);
            sum += vec4f(equation.x * equation.x, r * r, 1.0, 0.0);
        }
        residual[i] = r;
    }
    return workgroup_sum(sum, t);
}

// r = b - A x; sums of b.b, r.r and the number of unknowns.
@compute @workgroup_size(WORKGROUP)
fn start_residual(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
                  @builtin(workgroup_id) group: vec3u) {
    let sum = residuals(id.x, t);
    if t == 0u {
        partial_sum[group.x] = sum;
        // A workgroup's number is exact in f32, that of all may be too large for it.
        atomicAdd(&solve.unknowns, u32(sum.z));
    }
}

// Start from zero if the last pressure is worse than none; z as in `advance`; sums of r.z and r.r.
@compute @workgroup_size(WORKGROUP)
fn start(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
         @builtin(workgroup_id) group: vec3u) {
    let first = sum_of_partials(0u, t);
    let zero = first.x == 0.0 || first.z == 0.0;
    let restart = first.y > first.x || zero;
    var sum = vec4f(0.0);
    for (var i = id.x; i < params.pressure_slots; i += stride()) {
        let equation = source_diagonal[i];
        if equation.y > 0.0 {
            if restart {
                pressure[i] = 0.0;
                residual[i] = equation.x;
            }
            let r = residual[i];
            let z = DAMPING * r / divisor(i, equation.y);
            preconditioned[i].w = z;
            sum += vec4f(r * z, r * r, 0.0, 0.0);
        }
    }
    // `lane` is free again: every thread has passed the second barrier of the sum above.
    sum = workgroup_sum(sum, t);
    if t == 0u {
        partial_sum[params.reduction_groups + group.x] = sum;
        if group.x == 0u {
            solve.source_squared = first.x;
            if zero {
                finish(ZERO_SOURCE);
            }
        }
    }
}

// Whether the iteration goes on with a residual r.r.
fn judge(residual_squared: f32) -> u32 {
    if !finite(residual_squared) {
        return NOT_FINITE;
    }
    if residual_squared <= params.tolerance_squared * solve.source_squared {
        return CONVERGED;
    }
    return select(GO_ON, MAX_ITERATIONS, solve.iterations >= params.max_iterations);
}

//#if MULTIGRID
@compute @workgroup_size(WORKGROUP)
fn descend(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
           @builtin(workgroup_id) group: vec3u) {
    let total = sum_of_partials(params.reduction_groups, t);
    if total.w != 0.0 {
        return;
    }
    let verdict = judge(total.y);
    if group.x == 0u && t == 0u {
        solve.residual_squared = total.y;
        if verdict != GO_ON {
            finish(verdict);
        }
    }
    if verdict != GO_ON {
        return;
    }
    for (var i = id.x; i < params.pressure_slots; i += stride()) {
        let diagonal = source_diagonal[i].y;
        if diagonal > 0.0 {
            let me = preconditioned[i];
            smoothed[i] = residual[i] - (diagonal * me.w - neighbours(i, me.xyz));
        }
    }
}

@compute @workgroup_size(WORKGROUP)
fn ascend(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
          @builtin(workgroup_id) group: vec3u) {
    if done(t) {
        return;
    }
    var sum = 0.0;
    for (var i = id.x; i < params.pressure_slots; i += stride()) {
        let diagonal = source_diagonal[i].y;
        if diagonal > 0.0 {
            let me = corrected[i];
            let near = near_of(neighbour_count[i]);
            var others = 0.0;
            for (var k = 0u; k < near; k++) {
                let other = corrected[neighbour_list_at(k, i)];
                let r = offset(me.xyz, other.xyz);
                others += weight(dot(r, r)) * other.w;
            }
            let r = residual[i];
            let z = me.w + DAMPING * (r - (diagonal * me.w - others)) / diagonal;
            preconditioned[i].w = z;
            sum += r * z;
        }
    }
    let all = workgroup_sum(vec4f(sum, 0.0, 0.0, 0.0), t);
    if t == 0u {
        partial_sum[params.reduction_groups + group.x] = all;
    }
}

//#endif
@compute @workgroup_size(WORKGROUP)
fn multiply(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
            @builtin(workgroup_id) group: vec3u) {
    let total = sum_of_partials(params.reduction_groups, t);
    if total.w != 0.0 {
        return;
    }
    let rz = total.x;
    var verdict = GO_ON;
//#if MULTIGRID
    // `descend` has judged the residual.
//#else
    verdict = judge(total.y);
//#endif
    if verdict == GO_ON && !(finite(rz) && rz > 0.0) {
        verdict = BREAKDOWN;
    }
    if group.x == 0u && t == 0u {
        solve.rz = rz;
//#if MULTIGRID
//#else
        solve.residual_squared = total.y;
//#endif
        if verdict != GO_ON {
            finish(verdict);
        }
    }
    if verdict != GO_ON {
        return;
    }
    let first = solve.iterations == 0u;
    let beta = rz / solve.rz_old;
    var sum = 0.0;
    for (var i = id.x; i < params.pressure_slots; i += stride()) {
        let diagonal = source_diagonal[i].y;
        if diagonal > 0.0 {
            let me = preconditioned[i];
            var p = vec2f(me.w, times(i, diagonal, me));
            if !first {
                p += beta * search[i];
            }
            search[i] = p;
            sum += p.x * p.y;
        }
    }
    let all = workgroup_sum(vec4f(sum, 0.0, 0.0, 0.0), t);
    if t == 0u {
        partial_sum[group.x] = all;
    }
}

@compute @workgroup_size(WORKGROUP)
fn advance(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
           @builtin(workgroup_id) group: vec3u) {
    let total = sum_of_partials(0u, t);
    if total.w != 0.0 {
        return;
    }
    let pq = total.x;
    if !(finite(pq) && pq > 0.0) {
        if group.x == 0u && t == 0u {
            finish(BREAKDOWN);
        }
        return;
    }
    let alpha = solve.rz / pq;
    var sum = vec4f(0.0);
    for (var i = id.x; i < params.pressure_slots; i += stride()) {
        let diagonal = source_diagonal[i].y;
        if diagonal > 0.0 {
            let p = search[i];
            pressure[i] += alpha * p.x;
            let r = residual[i] - alpha * p.y;
            residual[i] = r;
            let z = DAMPING * r / divisor(i, diagonal);
            preconditioned[i].w = z;
            sum += vec4f(r * z, r * r, 0.0, 0.0);
        }
    }
    sum = workgroup_sum(sum, t);
    if t == 0u {
        partial_sum[params.reduction_groups + group.x] = sum;
        if group.x == 0u {
            solve.rz_old = solve.rz;
            solve.iterations += 1u;
        }
    }
}

// What follows runs once the iteration is done: the true residual of x, which in f32 stays above the one that the
// iteration carries on, and the bounds of the pressure.
@compute @workgroup_size(WORKGROUP)
fn end_pack(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32) {
    if !done(t) {
        return;
    }
    for (var i = id.x; i < params.pressure_slots; i += stride()) {
        preconditioned[i].w = pressure[i];
    }
}

@compute @workgroup_size(WORKGROUP)
fn end_residual(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
                @builtin(workgroup_id) group: vec3u) {
    if !done(t) {
        return;
    }
    let sum = residuals(id.x, t);
    if t == 0u {
        partial_sum[group.x] = sum;
    }
}

@compute @workgroup_size(WORKGROUP)
fn end(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
       @builtin(workgroup_id) group: vec3u) {
    if !done(t) {
        return;
    }
    var cut = vec4f(0.0);
    for (var i = id.x; i < params.pressure_slots; i += stride()) {
        var p = pressure[i];
//#if SURFACE_PRESSURE
        p += surface_pressure[i];
//#endif
//#if FILLED
        // shaders/pressure_level.wgsl bounds it when it has its level.
        pressure[i] = p;
//#else
//#if RANKS
        // Counted where it is computed.
        if position[i].w != FOREIGN {
            cut += vec4f(f32(p > now.pressure_max), f32(p < now.pressure_min), 0.0, 0.0);
        }
//#else
        cut += vec4f(f32(p > now.pressure_max), f32(p < now.pressure_min), 0.0, 0.0);
//#endif
        pressure[i] = clamp(p, now.pressure_min, now.pressure_max);
//#endif
    }
    cut = workgroup_sum(cut, t);
    if t == 0u && cut.x + cut.y > 0.0 {
        atomicAdd(&counters[PRESSURE_CLAMPS], u32(cut.x));
        atomicAdd(&counters[NEGATIVE_PRESSURES], u32(cut.y));
    }
    if group.x == 0u {
        let sum = sum_of_partials(0u, t);
        if t == 0u {
            solve.true_residual_squared = sum.y;
        }
    }
}
