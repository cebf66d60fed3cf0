// Right side and diagonal of the pressure Poisson equation, Eq. (8), times -1 and divided by c = 2 d / (lambda n0):
// sum w_ij (P_i - P_j) + alpha rho / (dt^2 c) P_i = b_i / c. A diagonal of 0 marks a slot whose pressure is no unknown.
// Twin: src/kernels/pressure_source.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(5) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(6) var<storage, read> number_density: array<f32>;
@group(0) @binding(7) var<storage, read> state: array<u32>;
@group(0) @binding(8) var<storage, read_write> source_diagonal: array<vec2f>;

//#if MIXED
fn divergence(r: vec3f, v: vec3f) -> f32 {
    let distance_squared = dot(r, r);
    if distance_squared == 0.0 {
        return 0.0;
    }
    return dot(v, r) * weight(distance_squared) / distance_squared;
}

//#endif
@compute @workgroup_size(WORKGROUP)
fn pressure_source(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= params.pressure_slots {
        return;
    }
    if state[i] != INNER {
        source_diagonal[i] = vec2f(0.0);
        return;
    }
    let x = position[i].xyz;
    let count = neighbour_count[i];
    let near = near_of(count);
    var links = 0.0;
//#if MIXED
    let v = velocity[i].xyz;
    var sum = 0.0;
//#endif
    for (var k = 0u; k < near; k++) {
        let j = neighbour_list[near_place(i, k)];
        let r = position[j].xyz - x;
        links += weight(dot(r, r));
//#if MIXED
        sum += divergence(r, velocity[j].xyz - v);
//#endif
    }
    if links <= 0.0 {
        source_diagonal[i] = vec2f(0.0, 1.0);
        return;
    }
    var b = now.source_density * (number_density[i] - params.number_density) / params.number_density;
//#if MIXED
    let dummies = dummies_of(count);
    for (var k = 0u; k < dummies; k++) {
        let j = neighbour_list[dummy_place(i, k)];
        sum += divergence(position[j].xyz - x, velocity[j].xyz - v);
    }
    b -= now.source_divergence * sum;
//#endif
    source_diagonal[i] = vec2f(b, links + now.compressibility);
}
