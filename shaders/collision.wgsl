// Collision of particles that come too close (Lee et al. 2011), Eq. (18): pairs closer than a l0 that still approach each
// other rebound, dv = -(1 + b) (v_i - v_j).r r / r^2, half of it each for two fluid particles. With SHARED_COLLISIONS a
// particle takes part in each of its pairs with an equal part of its mass, one of a free body's wall layer with its part
// of the body's. Written as an acceleration; the reaction on walls as a force.
// Twin: src/kernels/collision.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(5) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(6) var<storage, read_write> acceleration: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> reaction: array<vec4f>;
//#if FORCE
@group(0) @binding(8) var<storage, read> wall_layer: array<WallParticle>;
//#endif

// Velocity that i gains against j if j were immovable.
fn rebound(x: vec3f, v: vec3f, j: u32) -> vec3f {
    let r = offset(x, position[j].xyz);
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

// Inverse of the mass with which particle i takes part in each of its pairs, over that of a particle of water: the number
// of its colliding pairs, at least one, times its lightness. 0 for what does not give way.
fn parts(i: u32) -> f32 {
    let is_fluid = i < params.fluid;
    var own = f32(is_fluid);
//#if SHARED_COLLISIONS
//#if FORCE
    if !is_fluid && i < params.fluid + params.moving_wall {
        own = wall_layer[i - params.fluid].area.w;
    }
//#endif
    if own == 0.0 {
        return 0.0;
    }
    let x = position[i].xyz;
    let v = velocity[i].xyz;
    let count = neighbour_count[i];
    var pairs = 0u;
    for (var k = 0u; k < all_of(count); k++) {
        let j = neighbour_list_at(all_plane(k, count), i);
        pairs += u32((is_fluid || j < params.fluid) && any(rebound(x, v, j) != vec3f(0.0)));
    }
    own *= max(f32(pairs), 1.0);
//#endif
    return own;
}

@compute @workgroup_size(WORKGROUP)
fn collision(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i >= params.fluid + params.reacting {
        return;
    }
    let count = neighbour_count[i];
    var change = vec3f(0.0);
    if is_close(count) {
        let x = position[i].xyz;
        let v = velocity[i].xyz;
        let own = parts(i);
        for (var k = 0u; k < all_of(count); k++) {
            let j = neighbour_list_at(all_plane(k, count), i);
            if i >= params.fluid && j >= params.fluid {
                continue;
            }
            let full = rebound(x, v, j);
            if any(full != vec3f(0.0)) {
                change += full / (own + parts(j));
            }
        }
    }
    if i < params.fluid {
        acceleration[i] = vec4f(change / now.dt, 0.0);
    }
//#if REACTION
    else {
        let k = i - params.fluid;
        var before = vec4f(0.0);
//#if ALONG
        before = reaction[k];
//#endif
//#if RANKS
        if position[i].w == FOREIGN {
            change = vec3f(0.0);
        }
//#endif
        reaction[k] = before + vec4f(params.particle_mass / now.dt * change, 0.0);
    }
//#endif
}
