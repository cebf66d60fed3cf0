// Collision of particles that come too close (Lee et al. 2011), Eq. (18): pairs closer than a l0 that still approach each
// other rebound, dv = -(1 + b) (v_i - v_j).r r / r^2, half of it each for two fluid particles. With SHARED_COLLISIONS a
// particle takes part in each of its pairs with an equal part of its mass. Written as an acceleration; the reaction on
// wall layers of moving solids as a force.
// Twin: src/kernels/collision.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(5) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(6) var<storage, read_write> acceleration: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> reaction: array<vec4f>;

// Velocity that i gains against j if j were immovable.
fn rebound(x: vec3f, v: vec3f, j: u32) -> vec3f {
    let r = position[j].xyz - x;
    let distance_squared = dot(r, r);
    if distance_squared >= params.collision_distance * params.collision_distance || distance_squared == 0.0 {
        return vec3f(0.0);
    }
    let approach = dot(v - velocity[j].xyz, r);
    if approach <= 0.0 {
        return vec3f(0.0);
    }
    return -(1.0 + params.restitution) * approach / distance_squared * r;
}

// Parts into which fluid particle i is split: the number of its colliding pairs, at least one.
fn parts(i: u32) -> f32 {
//#if SHARED_COLLISIONS
    let x = position[i].xyz;
    let v = velocity[i].xyz;
    let count = neighbour_count[i];
    var pairs = 0u;
    for (var k = 0u; k < near_of(count); k++) {
        pairs += u32(any(rebound(x, v, neighbour_list[near_place(i, k)]) != vec3f(0.0)));
    }
    for (var k = 0u; k < dummies_of(count); k++) {
        pairs += u32(any(rebound(x, v, neighbour_list[dummy_place(i, k)]) != vec3f(0.0)));
    }
    return max(f32(pairs), 1.0);
//#else
    return 1.0;
//#endif
}

@compute @workgroup_size(WORKGROUP)
fn collision(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= params.fluid + params.moving_wall {
        return;
    }
    let count = neighbour_count[i];
    var change = vec3f(0.0);
    if is_close(count) {
        let x = position[i].xyz;
        let v = velocity[i].xyz;
        let near = near_of(count);
        // Solids are immovable here: infinitely many parts of them change nothing.
        var own = 0.0;
        if i < params.fluid {
            own = parts(i);
        }
        for (var k = 0u; k < near; k++) {
            let j = neighbour_list[near_place(i, k)];
            if i >= params.fluid && j >= params.fluid {
                continue;
            }
            let full = rebound(x, v, j);
            if any(full != vec3f(0.0)) {
                var other = 0.0;
                if j < params.fluid {
                    other = parts(j);
                }
                change += full / (own + other);
            }
        }
        if i < params.fluid {
            let dummies = dummies_of(count);
            for (var k = 0u; k < dummies; k++) {
                change += rebound(x, v, neighbour_list[dummy_place(i, k)]) / own;
            }
        }
    }
    if i < params.fluid {
        acceleration[i] = vec4f(change / now.dt, 0.0);
    }
//#if REACTION
    else {
        reaction[i - params.fluid] += vec4f(params.particle_mass / now.dt * change, 0.0);
    }
//#endif
}
