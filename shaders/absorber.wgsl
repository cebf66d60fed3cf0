// Absorber: v = v / (1 + dt sigma(r)), the implicit step of dv/dt = -sigma v, with sigma = rate s^2 in each zone that holds
// the particle; s runs from 0 where waves come in to 1 at the far end.
// Twin: src/kernels/absorber.rs

// Corners relative to the middle of the domain; s = ramp.xyz . (r - start.xyz).
struct AbsorberZone {
    low: vec4f,
    high: vec4f,
    start: vec4f,
    ramp: vec4f, // and the rate
}

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read> absorber_zone: array<AbsorberZone>;

@compute @workgroup_size(WORKGROUP)
fn absorber(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= params.fluid {
        return;
    }
    let x = position[i];
    if x.w != FLUID {
        return;
    }
    var rate = 0.0;
    for (var k = 0u; k < arrayLength(&absorber_zone); k += 1u) {
        let zone = absorber_zone[k];
        if all(x.xyz >= zone.low.xyz) && all(x.xyz <= zone.high.xyz) {
            let s = clamp(dot(zone.ramp.xyz, x.xyz - zone.start.xyz), 0.0, 1.0);
            rate += zone.ramp.w * s * s;
        }
    }
    if rate > 0.0 {
        let v = velocity[i];
        velocity[i] = vec4f(v.xyz / (1.0 + now.dt * rate), v.w);
    }
}
