// The water's part of the energy ledger: what a stage is about to do to the energy v^2 / 2 - g . x of the particles, per mass, and
// the gradient of the pressure as it was solved, before it was cut. Each workgroup adds to sums of its own, with what the additions
// round off kept beside them; the host puts them together in f64.
// Twin: src/kernels/ledger.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read> acceleration: array<vec4f>;
@group(0) @binding(5) var<storage, read> unclipped: array<vec4f>; // acceleration by the pressure as solved
@group(0) @binding(6) var<storage, read_write> ledger_sum: array<vec2f>; // and what it lacks
@group(0) @binding(7) var<storage, read_write> pressure: array<f32>;
@group(0) @binding(8) var<storage, read_write> clipped: array<f32>;
@group(0) @binding(9) var<storage, read> preconditioned: array<vec4f>; // position, pressure as solved
//#if CONSISTENT
@group(0) @binding(10) var<storage, read> imbalance: array<vec4f>;
//#endif
//#if SURFACE_PRESSURE
@group(0) @binding(11) var<storage, read> surface_pressure: array<f32>;
//#endif
//#if ABSORBER
@group(0) @binding(12) var<storage, read> absorber_zone: array<AbsorberZone>;
//#endif

// Places in the sums of a workgroup: the first entries of crate::ledger::Entry, then the number of lost particles.
//#if ABSORBER
const ABSORBED: u32 = 0u;
//#endif
const GRAVITY: u32 = 1u;
const VISCOSITY: u32 = 2u;
const FRICTION: u32 = 3u;
const COLLISION: u32 = 4u;
const PRESSURE: u32 = 5u;
const CLIP: u32 = 6u;
const CLAMPS: u32 = 7u;
//#if CONSISTENT
const SHIFTED: u32 = 8u;
//#endif
const TAKEN_OUT: u32 = 9u;
const NUMBER: u32 = 10u;
// As crate::backend::gpu::layout::LEDGER_WIDTH.
const LEDGER_WIDTH: u32 = 11u;

var<workgroup> lane: array<vec4f, 256>;

// Add the sum of `value` over the workgroup to its entries.
fn book(entries: vec4u, value: vec4f, t: u32, group: u32) {
    lane[t] = value;
    workgroupBarrier();
    for (var half = WORKGROUP / 2u; half > 0u; half /= 2u) {
        if t < half {
            lane[t] += lane[t + half];
        }
        workgroupBarrier();
    }
    // One thread after the other: two of the entries may be the same.
    if t == 0u {
        for (var k = 0u; k < 4u; k++) {
            let place = group * LEDGER_WIDTH + entries[k];
            let old = ledger_sum[place];
            let part = lane[0][k] + old.y;
            let grown = exactly(old.x + part);
            ledger_sum[place] = vec2f(grown, part - (grown - old.x));
        }
    }
}

fn stride(groups: u32) -> u32 {
    return groups * WORKGROUP;
}

// Energy gained with a change of velocity from v on and a way.
fn gain(v: vec3f, change: vec3f, way: vec3f) -> f32 {
    return dot(change, v + 0.5 * change) - dot(params.gravity, way);
}

// Work of the acceleration `part` where `total` acts, in `kick` without its clamp.
fn kick_work(v: vec3f, part: vec3f, total: vec3f) -> f32 {
    let work = now.dt * dot(part, v + 0.5 * now.dt * total);
    return select(work, work - now.dt * now.dt * dot(params.gravity, part), now.ahead == now.dt);
}

// Work of the clamps in `kick` and, with what is left of the step, in `correct`.
fn clamp_work(v: vec3f, total: vec3f, rest: f32) -> f32 {
    let longest = DISPLACEMENT_MAX * params.spacing / now.dt;
    let change = shortened(now.dt * total, longest);
    // Neither limit is met by a way of nothing.
    let way = shortened(rest * (v + change), longest_way(rest));
    if all(change == now.dt * total) && all(way == rest * (v + change)) {
        return 0.0;
    }
    let carried = select(vec3f(0.0), now.dt * change, now.ahead == now.dt);
    return gain(v, change, carried + way) - kick_work(v, total, total) + rest * dot(params.gravity, v + now.dt * total);
}

//#if ABSORBER
@compute @workgroup_size(WORKGROUP)
fn absorber_work(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
                 @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    var sum = vec4f(0.0);
    for (var i = id.x; i < params.fluid; i += stride(groups.x)) {
        let x = position[i];
        if is_water(x.w) {
            var rate = 0.0;
            for (var k = 0u; k < arrayLength(&absorber_zone); k++) {
                rate += absorber_rate(absorber_zone[k], x.xyz);
            }
            // v^2 (b^2 - 1) / 2 with b = 1 / (1 + dt sigma), without the difference of two numbers near 1.
            let v = velocity[i].xyz;
            let s = now.dt * rate;
            sum.x -= 0.5 * dot(v, v) * s * (2.0 + s) / ((1.0 + s) * (1.0 + s));
        }
    }
    book(vec4u(ABSORBED, CLAMPS, CLAMPS, CLAMPS), sum, t, group.x);
}

//#endif
@compute @workgroup_size(WORKGROUP)
fn predict_work(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
                @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    var sum = vec4f(0.0);
    for (var i = id.x; i < params.fluid; i += stride(groups.x)) {
        if is_water(position[i].w) {
            let v = velocity[i].xyz;
//#if MIXED
            var total = vec3f(0.0);
//#else
            var total = params.gravity;
//#endif
//#if PERIODIC
            total += params.drive;
//#endif
            var viscosity = 0.0;
//#if VISCOSITY
            let viscous = acceleration[i].xyz;
            total += viscous;
            viscosity = now.dt * dot(viscous, v + 0.5 * now.dt * total);
//#endif
            let change = now.dt * total;
            let way = now.ahead * (v + change);
            let unclamped = gain(v, change, way);
            let clamped = -dot(params.gravity, shortened(way, longest_way(now.ahead)) - way);
            sum += vec4f(unclamped - viscosity, viscosity, clamped, 0.0);
        }
    }
    book(vec4u(GRAVITY, VISCOSITY, CLAMPS, CLAMPS), sum, t, group.x);
}

// Of the particles that the cell list is about to take out.
@compute @workgroup_size(WORKGROUP)
fn lost_work(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
             @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    var sum = vec4f(0.0);
    for (var i = id.x; i < params.fluid; i += stride(groups.x)) {
        let kind = position[i].w;
        let x = wrapped(position[i].xyz);
        let v = velocity[i].xyz;
        if is_water(kind) && !in_domain(x, v) && finite_vector(x + v) {
            sum += vec4f(dot(params.gravity, x) - 0.5 * dot(v, v), 1.0, 0.0, 0.0);
        }
    }
    book(vec4u(TAKEN_OUT, NUMBER, CLAMPS, CLAMPS), sum, t, group.x);
}

fn kick(entry: u32, first: u32, t: u32, group: u32, groups: u32) {
    var sum = vec4f(0.0);
    for (var i = first; i < params.fluid; i += stride(groups)) {
        let a = acceleration[i].xyz;
        if is_water(position[i].w) && any(a != vec3f(0.0)) {
            let v = velocity[i].xyz;
            sum += vec4f(kick_work(v, a, a), clamp_work(v, a, 0.0), 0.0, 0.0);
        }
    }
    book(vec4u(entry, CLAMPS, CLAMPS, CLAMPS), sum, t, group);
}

@compute @workgroup_size(WORKGROUP)
fn friction_work(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
                 @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    kick(FRICTION, id.x, t, group.x, groups.x);
}

@compute @workgroup_size(WORKGROUP)
fn collision_work(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
                  @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    kick(COLLISION, id.x, t, group.x, groups.x);
}

@compute @workgroup_size(WORKGROUP)
fn pressure_work(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
                 @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
//#if MIXED
    let gravity = params.gravity;
//#else
    let gravity = vec3f(0.0);
//#endif
    var sum = vec4f(0.0);
    for (var i = id.x; i < params.fluid; i += stride(groups.x)) {
        if is_water(position[i].w) {
            let v = velocity[i].xyz;
            let a = acceleration[i].xyz;
            let solved = unclipped[i].xyz;
            let rest = now.dt - now.ahead;
            let fallen = rest * dot(params.gravity, v + now.dt * a);
            sum += vec4f(kick_work(v, gravity, a) - fallen, kick_work(v, solved - gravity, a),
                         kick_work(v, a - solved, a), clamp_work(v, a, rest));
        }
    }
    book(vec4u(GRAVITY, PRESSURE, CLIP, CLAMPS), sum, t, group.x);
}

//#if CONSISTENT
@compute @workgroup_size(WORKGROUP)
fn shift_work(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
              @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    var sum = vec4f(0.0);
    for (var i = id.x; i < params.fluid; i += stride(groups.x)) {
        if is_water(position[i].w) {
            sum.x -= dot(params.gravity, shift_way(imbalance[i].xyz, velocity[i].xyz));
        }
    }
    book(vec4u(SHIFTED, CLAMPS, CLAMPS, CLAMPS), sum, t, group.x);
}

//#endif
// Puts the pressure as solved in place of the cut one.
@compute @workgroup_size(WORKGROUP)
fn as_solved(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i < params.pressure_slots {
        clipped[i] = pressure[i];
        var p = preconditioned[i].w;
//#if SURFACE_PRESSURE
        p += surface_pressure[i];
//#endif
        pressure[i] = p;
    }
}

// And back.
@compute @workgroup_size(WORKGROUP)
fn as_clipped(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i < params.pressure_slots {
        pressure[i] = clipped[i];
    }
}
