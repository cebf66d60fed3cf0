// Friction of the fluid on walls whose boundary layer is thinner than a spacing, tau = rho C_f |u_t| u_t, implicit:
// a_i = -k |u_t| u_t / (1 + dt k |u_t|), k = C_f sum w / (l0 sum w above a flat wall), u_t what lies along the wall of the
// velocity over it; and its reaction on walls. Written as an acceleration.
// Twin: src/kernels/wall_friction.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(5) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(6) var<storage, read_write> acceleration: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> reaction: array<vec4f>;

// Acceleration of fluid slot i, and the sum of its weights with wall layers.
fn friction(i: u32) -> vec4f {
    let word = neighbour_count[i];
    if !sees_wall(word) {
        return vec4f(0.0);
    }
    let x = position[i].xyz;
    let neighbours = near_of(word);
    var sum = 0.0;
    var wall = vec3f(0.0);
    var normal = vec3f(0.0);
    for (var k = 0u; k < neighbours; k++) {
        let j = neighbour_list_at(k, i);
        if j >= params.fluid {
            let r = offset(x, position[j].xyz);
            let w = weight(dot(r, r));
            sum += w;
            wall += w * velocity[j].xyz;
            normal += pair_vector(w, r);
        }
    }
    if sum == 0.0 {
        return vec4f(0.0);
    }
    let over = velocity[i].xyz - wall / sum;
    let length_squared = dot(normal, normal);
    if length_squared > 0.0 {
        normal *= inverseSqrt(length_squared);
    }
    let along = over - dot(over, normal) * normal;
    let rate = params.wall_friction * sum * length(along);
    return vec4f(-rate / (1.0 + now.dt * rate) * along, sum);
}

// The sum of the weights stands beside the acceleration, for `react`.
@compute @workgroup_size(WORKGROUP)
fn wall_friction(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i < params.fluid {
        acceleration[i] = friction(i);
    }
}

// What the water loses to walls.
@compute @workgroup_size(WORKGROUP)
fn react(@builtin(global_invocation_id) id: vec3u) {
//#if REACTION
    let k = thread(id);
    let i = params.fluid + k;
    if k >= params.reacting {
        return;
    }
    var before = vec4f(0.0);
//#if VISCOSITY
    before = reaction[k];
//#endif
//#if RANKS
    if position[i].w == FOREIGN {
        reaction[k] = before;
        return;
    }
//#endif
    let x = position[i].xyz;
    let neighbours = near_of(neighbour_count[i]);
    var taken = vec3f(0.0);
    for (var n = 0u; n < neighbours; n++) {
        let j = neighbour_list_at(n, i);
        if j < params.fluid {
            let other = acceleration[j];
            if other.w > 0.0 {
                let r = offset(x, position[j].xyz);
                taken += weight(dot(r, r)) / other.w * other.xyz;
            }
        }
    }
    reaction[k] = before - vec4f(params.particle_mass * taken, 0.0);
//#endif
}
