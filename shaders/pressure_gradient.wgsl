// Pressure gradient against the smallest pressure in the neighbourhood, Eq. (9), as an acceleration:
// a_i = -1 / rho d / n0 sum w_ij (P_j - P_min) r_ij / r_ij^2 over neighbours that carry pressure.
// Consistent below the surface: against max(P_min, min (P_j - rho g . r_ij)), with dummies at P_i + rho g . r_ij, times the
// inverse of the moment matrix; on the surface against -P_i.
// Twin: src/kernels/pressure_gradient.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> pressure: array<f32>;
@group(0) @binding(4) var<storage, read> state: array<u32>;
@group(0) @binding(5) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(6) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(7) var<storage, read_write> acceleration: array<vec4f>;
//#if MIXED
@group(0) @binding(9) var<storage, read> velocity: array<vec4f>;

// Mean velocity of the solids about fluid slot i at x, and the room that they leave it; 1 where there are no bodies.
fn solids_about(i: u32, x: vec3f) -> vec4f {
    if params.body_wall == 0u {
        return vec4f(0.0, 0.0, 0.0, 1.0);
    }
    let count = neighbour_count[i];
    var sum = 0.0;
    var moving = vec3f(0.0);
    for (var k = 0u; k < all_of(count); k++) {
        let j = neighbour_list_at(all_plane(k, count), i);
        if j >= params.fluid {
            let r = offset(x, position[j].xyz);
            let w = smooth_weight(weight(dot(r, r)));
            sum += w;
            moving += w * velocity[j].xyz;
        }
    }
    return vec4f(select(vec3f(0.0), moving / sum, sum > 0.0), room_in_water(1.0 + sum));
}

//#endif
//#if CONSISTENT
@group(0) @binding(8) var<storage, read_write> imbalance: array<vec4f>;

// What still water's pressure grows by along r.
fn hydrostatic(r: vec3f) -> f32 {
    return params.density * dot(params.gravity, r);
}
//#endif

@compute @workgroup_size(WORKGROUP)
fn pressure_gradient(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i >= params.fluid {
        return;
    }
    let x = position[i];
    if !is_water(x.w) {
        acceleration[i] = vec4f(0.0);
//#if CONSISTENT
        imbalance[i] = vec4f(0.0);
//#endif
        return;
    }
    let count = neighbour_count[i];
    let near = near_of(count);
    let own = pressure[i];
    var reference = own;
//#if CONSISTENT
    var level = own;
//#endif
    for (var k = 0u; k < near; k++) {
        let j = neighbour_list_at(k, i);
        reference = min(reference, pressure[j]);
//#if CONSISTENT
        level = min(level, pressure[j] - hydrostatic(offset(x.xyz, position[j].xyz)));
//#endif
    }
    var sum = vec3f(0.0);
//#if CONSISTENT
    let inner = state[i] == INNER;
    if inner {
        reference = max(reference, level);
    } else {
        reference = -own;
    }
    var one_side = vec3f(0.0);
    var moment = Moment(vec3f(0.0), vec3f(0.0));
//#endif
    for (var k = 0u; k < near; k++) {
        let j = neighbour_list_at(k, i);
        let r = offset(x.xyz, position[j].xyz);
        let e = pair_vector(weight(dot(r, r)), r);
        sum += (pressure[j] - reference) * e;
//#if CONSISTENT
        one_side += e;
        moment = add_moment(moment, e, r);
//#endif
    }
//#if CONSISTENT
    if inner {
        let dummies = dummies_of(count);
        for (var k = 0u; k < dummies; k++) {
            let r = offset(x.xyz, position[neighbour_list_at(dummy_plane(k), i)].xyz);
            let e = pair_vector(weight(dot(r, r)), r);
            sum += (own + hydrostatic(r) - reference) * e;
            one_side += e;
            moment = add_moment(moment, e, r);
        }
        sum = inverse_moment(moment) * sum;
    }
    imbalance[i] = select(vec4f(0.0), vec4f(params.gradient_scale * one_side, 0.0), inner);
//#endif
    let gradient = params.gradient_scale * sum;
    var a = -gradient / params.density;
//#if MIXED
    // Gravity acts together with the pressure that balances it.
    a += params.gravity;
    // Without room a particle goes where the solids go: no pressure carries it.
    let about = solids_about(i, x.xyz);
    let room = about.w;
    if room < 1.0 {
        a = room * a + (1.0 - room) / now.dt * (about.xyz - velocity[i].xyz);
    }
//#endif
    acceleration[i] = vec4f(a, 0.0);
}
