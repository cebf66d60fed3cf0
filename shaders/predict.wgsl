// Explicit part of the step: v* = v + dt (g + nu lap v), Eq. (2) without pressure, and the way with it to r*, where the other forces
// are found: r* = r + dt v* in the paper's scheme and where there is no free surface, else r + dt v* / 2.
// Gravity along periodic axes, which no pressure balances, acts here in any scheme.
// Twin: src/kernels/predict.rs

@group(0) @binding(2) var<storage, read_write> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> acceleration: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> counters: array<atomic<u32>>;

@compute @workgroup_size(WORKGROUP)
fn predict(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i >= params.fluid {
        return;
    }
    let x = position[i];
    if !is_water(x.w) {
        return;
    }
//#if MIXED
    // Gravity acts with the pressure gradient.
    var a = vec3f(0.0);
//#else
    var a = params.gravity;
//#endif
//#if PERIODIC
    a += params.drive;
//#endif
//#if VISCOSITY
    a += acceleration[i].xyz;
    acceleration[i] = vec4f(0.0);
//#endif
    let old = velocity[i];
    let v = old.xyz + now.dt * a;
    let way = now.ahead * v;
    let longest = longest_way(now.ahead);
    if longer(way, longest) {
        atomicAdd(&counters[DISPLACEMENT_CLAMPS], 1u);
    }
    position[i] = moved(x, shortened(way, longest));
    velocity[i] = vec4f(v, old.w);
}
