// What the pressure of a wall's row is above that on the wall's surface, half way to the water before it, but for the weight of the
// water between: its excess. `before_solve` makes that of moving walls from their equations and what the last step adds, for free
// bodies; `after_solve` takes it from the pressures that are left. Of a solid's particle that is no row but beside the water's surface they
// keep the pressure that the surface has it have.
// Twin: src/kernels/wall_excess.rs

@group(0) @binding(2) var<storage, read> preconditioned: array<vec4f>; // positions, and what the solve has found
@group(0) @binding(3) var<storage, read> pressure: array<f32>;
@group(0) @binding(4) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(5) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(6) var<storage, read> source_diagonal: array<vec2f>;
@group(0) @binding(7) var<storage, read_write> excess: array<f32>; // of the walls' rows, the moving ones first
//#if COUPLED
@group(0) @binding(8) var<storage, read_write> inertia_head: array<f32>; // of moving-wall slots
@group(0) @binding(9) var<storage, read> wall_layer: array<WallParticle>;
//#if SURFACE_PRESSURE
@group(0) @binding(10) var<storage, read> surface_pressure: array<f32>;
//#endif
@group(0) @binding(11) var<storage, read> position: array<vec4f>;
//#endif
//#if SURFACE_PRESSURE
@group(0) @binding(12) var<storage, read> state: array<u32>;

//#if COUPLED
fn place_of(j: u32) -> vec3f {
    return position[j].xyz;
}

fn known_of(j: u32) -> f32 {
    return surface_pressure[j];
}
//#else
fn place_of(j: u32) -> vec3f {
    return preconditioned[j].xyz;
}

// What the solve leaves of it.
fn known_of(j: u32) -> f32 {
    return pressure[j];
}
//#endif

// The pressure of slot i at x beside the surface, from those of the surface's particles around it; DRY without any.
fn beside_surface(i: u32, x: vec3f) -> f32 {
    if state[i] != SURFACE {
        return DRY;
    }
    let near = near_of(neighbour_count[i]);
    var total = 0.0;
    var sum = 0.0;
    var height = 0.0;
    for (var n = 0u; n < near; n++) {
        let j = neighbour_list_at(n, i);
        if j < params.fluid && state[j] == SURFACE {
            let r = offset(x, place_of(j));
            let w = weight(dot(r, r));
            total += w;
            sum += w * known_of(j);
            height -= w * params.density * dot(params.gravity, r);
        }
    }
    if total == 0.0 {
        return DRY;
    }
    return known_row((sum + min(height, 0.0)) / total);
}
//#endif

//#if COUPLED
@compute @workgroup_size(WORKGROUP)
fn before_solve(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k >= params.moving_wall {
        return;
    }
    let i = params.fluid + k;
    let equation = source_diagonal[i];
    let x = position[i].xyz;
    if equation.y == 0.0 {
//#if SURFACE_PRESSURE
        excess[k] = beside_surface(i, x);
//#else
        excess[k] = DRY;
//#endif
        return;
    }
    let near = near_of(neighbour_count[i]);
    var links = 0.0;
    var sum = equation.x;
    for (var n = 0u; n < near; n++) {
        let j = neighbour_list_at(n, i);
        let r = offset(x, position[j].xyz);
        let w = weight(dot(r, r));
        links += w;
        var over = params.density * dot(params.gravity, r);
//#if SURFACE_PRESSURE
        over -= surface_pressure[j];
//#endif
        sum += w * over;
    }
    excess[k] = unknown_row(inertia_head[k] + select(0.0, 0.5 * sum / links, links > 0.0));
}

//#endif
@compute @workgroup_size(WORKGROUP)
fn after_solve(@builtin(global_invocation_id) id: vec3u) {
    let wall = thread(id);
    let i = params.fluid + wall;
    if i >= params.pressure_slots {
        return;
    }
    if source_diagonal[i].y == 0.0 {
//#if COUPLED
        if wall < params.moving_wall {
            inertia_head[wall] = 0.0;
            return;
        }
//#else
//#if SURFACE_PRESSURE
        if wall < params.moving_wall {
            excess[wall] = beside_surface(i, preconditioned[i].xyz);
            return;
        }
//#endif
//#endif
        excess[wall] = DRY;
        return;
    }
    let own = preconditioned[i];
    let own_cut = pressure[i];
    let near = near_of(neighbour_count[i]);
    var links = 0.0;
    var weight_of_water = 0.0;
//#if COUPLED
    var solved = 0.0;
//#endif
    var left = 0.0;
    for (var k = 0u; k < near; k++) {
        let j = neighbour_list_at(k, i);
        let other = preconditioned[j];
        let r = offset(own.xyz, other.xyz);
        let w = weight(dot(r, r));
        links += w;
        weight_of_water += w * params.density * dot(params.gravity, r);
        left += w * (own_cut - pressure[j]);
//#if COUPLED
        solved += w * (own.w - solution(other.w, pressure[j]));
//#endif
    }
    let half = select(0.0, 0.5 / links, links > 0.0);
    left = half * (left + weight_of_water);
//#if COUPLED
    // A free body is pressed with what it has answered in the solve, and with what it feels of the cut.
    var felt = 0.0;
    if wall < params.moving_wall {
        felt = wall_layer[wall].to_surface.w;
    }
    if felt > 0.0 {
        solved = half * (solved + weight_of_water);
        let answered = excess[wall];
//#if FILLED
        let cut = 0.0;
//#else
        let cut = own_cut - own.w;
//#endif
        excess[wall] = unknown_row(answered + cut - felt * (cut - (left - solved)));
        inertia_head[wall] = solved - (answered - inertia_head[wall]);
        return;
    }
//#endif
    excess[wall] = unknown_row(left);
}

//#if COUPLED
// What the solve has found where `left` is left of it: a pressure that was no unknown stands beside no solution.
fn solution(found: f32, left: f32) -> f32 {
//#if FILLED
    // All are raised alike.
    return found;
//#else
    return select(found, left, found == 0.0);
//#endif
}
//#endif
