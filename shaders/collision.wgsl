// Collision of particles that come too close (Lee et al. 2011), Eq. (18): pairs closer than a l0 that still approach each
// other rebound, dv = -(1 + b) (v_i - v_j).r r / r^2, half of it each for two fluid particles. Written as an acceleration;
// the reaction on wall layers of moving solids as a force.
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

@compute @workgroup_size(WORKGROUP)
fn collision(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= params.fluid + params.moving_wall {
        return;
    }
    let count = neighbour_count[i];
    var change = vec3f(0.0);
    if (count >> 24u) != 0u {
        let x = position[i].xyz;
        let v = velocity[i].xyz;
        let near = near_of(count);
        for (var k = 0u; k < near; k++) {
            let j = neighbour_list[near_place(i, k)];
            if i < params.fluid {
                change += select(1.0, 0.5, j < params.fluid) * rebound(x, v, j);
            } else if j < params.fluid {
                change += rebound(x, v, j);
            }
        }
        if i < params.fluid {
            let dummies = dummies_of(count);
            for (var k = 0u; k < dummies; k++) {
                change += rebound(x, v, neighbour_list[dummy_place(i, k)]);
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
