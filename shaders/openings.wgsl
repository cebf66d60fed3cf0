// Openings: a layer of wall particles becomes water where it has gone a spacing into the tank, and water behind an outflow is
// swallowed.
// Twin: src/kernels/openings.rs

@group(0) @binding(2) var<storage, read_write> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> pressure: array<f32>;
@group(0) @binding(5) var<storage, read> emission: array<Emission>;
@group(0) @binding(6) var<storage, read> outlet: array<Outlet>;
@group(0) @binding(7) var<storage, read_write> counters: array<atomic<u32>>;

// A thread for each particle of the emissions, one after the other.
@compute @workgroup_size(WORKGROUP)
fn emit(@builtin(global_invocation_id) id: vec3u) {
    var k = thread(id);
    for (var e = 0u; e < arrayLength(&emission); e += 1u) {
        let layer = emission[e];
        if layer.count == 0u {
            return;
        }
        if k < layer.count {
            let wall = layer.wall + k;
            let i = layer.to + k;
            position[i] = vec4f(position[wall].xyz + layer.shift.xyz, FLUID);
            velocity[i] = vec4f(layer.velocity.xyz, velocity[i].w);
            pressure[i] = pressure[wall];
            return;
        }
        k -= layer.count;
    }
}

@compute @workgroup_size(WORKGROUP)
fn swallow(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i >= params.fluid {
        return;
    }
    let x = position[i];
    if !is_water(x.w) {
        return;
    }
    let place = wrapped(x.xyz);
    let outlets = arrayLength(&outlet);
    var first = outlets;
    for (var k = 0u; k < outlets; k += 1u) {
        let it = outlet[k];
        if within(place, it.room_low.xyz, it.room_high.xyz) {
            return;
        }
        if first == outlets && within(place, it.low.xyz, it.high.xyz) {
            first = k;
        }
    }
    if first < outlets {
        position[i].w = GHOST;
        atomicAdd(&counters[SWALLOWED + first], 1u);
    }
}

fn within(x: vec3f, low: vec3f, high: vec3f) -> bool {
    return all(x >= low) && all(x <= high);
}
