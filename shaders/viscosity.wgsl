// Viscous acceleration, Eqs. (2) and (6), a_i = nu 2 d / (sum w r^2) sum w_ij (v_j - v_i), and its reaction on
// walls. w is that of Eq. (3) in the paper's scheme, else 1 / q - 1 + 32 (1 - q)^4. Pairs of fluid and wall weigh params.wall_shear. Positions and neighbours are those of the last step.
// Twin: src/kernels/viscosity.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(5) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(6) var<storage, read_write> acceleration: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> reaction: array<vec4f>;

fn shear(i: u32, below: u32) -> vec3f {
    let x = position[i].xyz;
    let v = velocity[i].xyz;
    let neighbours = near_of(neighbour_count[i]);
    var sum = vec3f(0.0);
    for (var k = 0u; k < neighbours; k++) {
        let j = neighbour_list_at(k, i);
        let r = offset(x, position[j].xyz);
        let distance_squared = dot(r, r);
        // The particles have moved since the list was made.
        if j < below && distance_squared > 0.0
            && distance_squared < params.effective_radius * params.effective_radius {
            let share = select(1.0, params.wall_shear, (i < params.fluid) != (j < params.fluid));
//#if MIXED
            let q = sqrt(distance_squared) / params.effective_radius;
            let rest = 1.0 - q;
            let square = rest * rest;
            let w = rest / q + 32.0 * square * square;
//#else
            let w = params.effective_radius * inverseSqrt(distance_squared) - 1.0;
//#endif
            sum += share * w * (velocity[j].xyz - v);
        }
    }
    return params.viscosity * sum;
}

@compute @workgroup_size(WORKGROUP)
fn viscosity(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i < params.fluid {
        acceleration[i] = vec4f(shear(i, params.pressure_slots), 0.0);
    }
//#if REACTION
    else if i < params.fluid + params.reacting {
        reaction[i - params.fluid] = vec4f(params.particle_mass * shear(i, params.fluid), 0.0);
//#if RANKS
        if position[i].w == FOREIGN {
            reaction[i - params.fluid] = vec4f(0.0);
        }
//#endif
    }
//#endif
}
