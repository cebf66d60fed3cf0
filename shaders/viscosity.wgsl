// Viscous acceleration, Eqs. (2) and (6), a_i = nu 2 d / (sum w r^2) sum w_ij (v_j - v_i), and its reaction on
// walls. w is that of Eq. (3) in the paper's scheme, else 1 / q - 1 + 32 (1 - q)^4. Pairs of fluid and wall weigh params.wall_shear. Positions and neighbours are those of the last step.
// In thick water with a free surface the whole stress acts on it.
// Twin: src/kernels/viscosity.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(5) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(6) var<storage, read_write> acceleration: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> reaction: array<vec4f>;

// Weight of a pair in the viscous sum; the particles have moved since the list was made.
fn pair_weight(distance_squared: f32) -> f32 {
    if distance_squared <= 0.0 || distance_squared >= params.effective_radius * params.effective_radius {
        return 0.0;
    }
//#if MIXED
    let q = sqrt(distance_squared) / params.effective_radius;
    let rest = 1.0 - q;
    let square = rest * rest;
    return rest / q + 32.0 * square * square;
//#else
    return params.effective_radius * inverseSqrt(distance_squared) - 1.0;
//#endif
}

fn shear(i: u32, below: u32) -> vec3f {
    let x = position[i].xyz;
    let v = velocity[i].xyz;
    let neighbours = near_of(neighbour_count[i]);
    var sum = vec3f(0.0);
    for (var k = 0u; k < neighbours; k++) {
        let j = neighbour_list_at(k, i);
        let r = offset(x, position[j].xyz);
        if j < below {
            let share = select(1.0, params.wall_shear, (i < params.fluid) != (j < params.fluid));
            sum += share * pair_weight(dot(r, r)) * (velocity[j].xyz - v);
        }
    }
    return params.viscosity * sum;
}

//#if STRESS
const FIT_MIN: f32 = 0.17;

// nu A^T Q, A the gradient of the water's velocity and Q = 2 d / (sum w r^2) sum w r over all neighbours.
fn surface_stress(i: u32) -> vec3f {
    let x = position[i].xyz;
    let v = velocity[i].xyz;
    let count = neighbour_count[i];
    let all = all_of(count);
    var lopsided = vec3f(0.0);
    var moment = Moment(vec3f(0.0), vec3f(0.0));
    // w r (v_j - v_i)^T, column c with component c of the velocity.
    var rate = mat3x3f(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (var k = 0u; k < all; k++) {
        let j = neighbour_list_at(all_plane(k, count), i);
        let r = offset(x, position[j].xyz);
        let e = pair_weight(dot(r, r)) * r;
        lopsided += e;
        if j < params.fluid {
            let change = velocity[j].xyz - v;
            moment = add_moment(moment, e, r);
            rate += mat3x3f(e * change.x, e * change.y, e * change.z);
        }
    }
    let inverse = inverse_above(FIT_MIN, moment, params.shear_scale, 0.0);
    return params.viscosity * params.shear_scale * (inverse * (rate * lopsided));
}
//#endif

@compute @workgroup_size(WORKGROUP)
fn viscosity(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i < params.fluid {
        var sum = shear(i, params.pressure_slots);
//#if STRESS
        sum += surface_stress(i);
//#endif
        acceleration[i] = vec4f(sum, 0.0);
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
