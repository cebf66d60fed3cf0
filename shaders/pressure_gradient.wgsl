// Pressure gradient against the smallest pressure in the neighbourhood, Eq. (9), as an acceleration:
// a_i = -1 / rho d / n0 sum w_ij (P_j - P_min) r_ij / r_ij^2 over neighbours that carry pressure.
// Twin: src/kernels/pressure_gradient.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> pressure: array<f32>;
@group(0) @binding(4) var<storage, read> state: array<u32>;
@group(0) @binding(5) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(6) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(7) var<storage, read_write> acceleration: array<vec4f>;

@compute @workgroup_size(WORKGROUP)
fn pressure_gradient(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= params.fluid {
        return;
    }
    let x = position[i];
    if x.w != FLUID {
        acceleration[i] = vec4f(0.0);
        return;
    }
    let count = neighbour_count[i];
    let near = near_of(count);
    var minimum = pressure[i];
    for (var k = 0u; k < near; k++) {
        minimum = min(minimum, pressure[neighbour_list[near_place(i, k)]]);
    }
    var sum = vec3f(0.0);
//#if CORRECTED
    var moment = Moment(vec3f(0.0), vec3f(0.0));
//#endif
    for (var k = 0u; k < near; k++) {
        let j = neighbour_list[near_place(i, k)];
        let r = position[j].xyz - x.xyz;
        let e = pair_vector(r);
        sum += (pressure[j] - minimum) * e;
//#if CORRECTED
        moment = add_moment(moment, e, r);
//#endif
    }
    var gradient = params.gradient_scale * sum;
//#if CORRECTED
    if state[i] == INNER {
        let dummies = dummies_of(count);
        for (var k = 0u; k < dummies; k++) {
            let r = position[neighbour_list[dummy_place(i, k)]].xyz - x.xyz;
            moment = add_moment(moment, pair_vector(r), r);
        }
        gradient = inverse_moment(moment) * gradient;
    }
//#endif
    var a = -gradient / params.density;
//#if MIXED
    // Gravity acts together with the pressure that balances it.
    a += params.gravity;
//#endif
    acceleration[i] = vec4f(a, 0.0);
}
