// Correction: v = v* + dt a, r = r* + dt^2 a with a of the collision or of the pressure gradient.
// Twin: src/kernels/correct.rs

@group(0) @binding(2) var<storage, read_write> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> acceleration: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> counters: array<atomic<u32>>;

@compute @workgroup_size(WORKGROUP)
fn correct(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= params.fluid {
        return;
    }
    let a = acceleration[i].xyz;
    let old = velocity[i];
    // Most particles collide with none.
    if all(a == vec3f(0.0)) && finite_vector(old.xyz) {
        return;
    }
    let x = position[i];
    if x.w != FLUID {
        return;
    }
    var change = now.dt * a;
    let longest = DISPLACEMENT_MAX * params.spacing / now.dt;
    let squared = dot(change, change);
    if squared > longest * longest {
        change *= longest * inverseSqrt(squared);
        atomicAdd(&counters[DISPLACEMENT_CLAMPS], 1u);
    }
    let v = old.xyz + change;
    if !finite_vector(v) {
        atomicMin(&counters[NON_FINITE], u32(old.w));
    }
    position[i] = vec4f(x.xyz + now.dt * change, x.w);
    velocity[i] = vec4f(v, old.w);
    acceleration[i] = vec4f(0.0);
}
