// Absorber: v = v / (1 + dt sigma(r)), the implicit step of dv/dt = -sigma v, with sigma = rate s^2 in each zone that holds
// the particle, or an image of it; s runs from 0 where waves come in to 1 at the far end.
// Twin: src/kernels/absorber.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read> absorber_zone: array<AbsorberZone>;

@compute @workgroup_size(WORKGROUP)
fn absorber(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i >= params.fluid {
        return;
    }
    let x = position[i];
    if !is_water(x.w) {
        return;
    }
    var rate = 0.0;
    for (var k = 0u; k < arrayLength(&absorber_zone); k += 1u) {
        rate += absorber_rate(absorber_zone[k], x.xyz);
    }
    if rate > 0.0 {
        let v = velocity[i];
        velocity[i] = vec4f(v.xyz / (1.0 + now.dt * rate), v.w);
    }
}
