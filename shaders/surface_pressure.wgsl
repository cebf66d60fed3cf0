// Pressure of the particles on the free surface, P_s = |grad P| l0 / 2 with the pressures of the last step: P = 0 lies half a
// spacing outside their centres; 0 where the water below pulls. Walls beside the surface have the mean of the surface's particles around them, less the
// weight of what lies between.
// Twin: src/kernels/surface_pressure.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> pressure: array<f32>;
@group(0) @binding(4) var<storage, read> state: array<u32>;
@group(0) @binding(5) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(6) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(7) var<storage, read_write> surface_pressure: array<f32>;

fn of_water(i: u32, x: vec3f, near: u32) -> f32 {
    let own = pressure[i];
    var sum = vec3f(0.0);
    var level = 0.0;
    for (var k = 0u; k < near; k++) {
        let j = neighbour_list_at(k, i);
        let r = offset(x, position[j].xyz);
        let w = weight(dot(r, r));
        sum += (pressure[j] + own) * pair_vector(w, r);
        level += (pressure[j] + own) * w;
    }
    return select(0.5 * params.spacing * params.gradient_scale * length(sum), 0.0, level < 0.0);
}

fn of_wall(i: u32, x: vec3f, near: u32) -> f32 {
    var total = 0.0;
    var sum = 0.0;
    var height = 0.0;
    for (var k = 0u; k < near; k++) {
        let j = neighbour_list_at(k, i);
        if j < params.fluid && state[j] == SURFACE {
            let r = offset(x, position[j].xyz);
            let w = weight(dot(r, r));
            total += w;
            sum += w * pressure[j];
            height -= w * params.density * dot(params.gravity, r);
        }
    }
    return select(0.0, max((sum + min(height, 0.0)) / total, 0.0), total > 0.0);
}

@compute @workgroup_size(WORKGROUP)
fn surface_pressure_main(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i >= params.pressure_slots {
        return;
    }
    var p = 0.0;
    if state[i] == SURFACE {
        let x = position[i].xyz;
        let near = near_of(neighbour_count[i]);
        if i < params.fluid {
            p = of_water(i, x, near);
        } else {
            p = of_wall(i, x, near);
        }
    }
    surface_pressure[i] = p;
}
