// Pressure gradient against the smallest pressure in the neighbourhood, Eq. (9), as an acceleration:
// a_i = -1 / rho d / n0 sum w_ij (P_j - P_min) r_ij / r_ij^2 over neighbours that carry pressure.
// Twin: src/kernels/pressure_gradient.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> pressure: array<f32>;
@group(0) @binding(4) var<storage, read> state: array<u32>;
@group(0) @binding(5) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(6) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(7) var<storage, read_write> acceleration: array<vec4f>;

//#if CORRECTED
// Smallest determinant of the moment matrix at which its inverse is used.
const DETERMINANT_MIN: f32 = 0.05;

// w / r^2 of a pair, 0 for a coincident one.
fn over_square(distance_squared: f32) -> f32 {
    return select(weight(distance_squared) / distance_squared, 0.0, distance_squared == 0.0);
}

//#endif
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
    // Moment matrix: diagonal, and yz, xz, xy.
    var diagonal = vec3f(0.0);
    var mixed = vec3f(0.0);
//#endif
    for (var k = 0u; k < near; k++) {
        let j = neighbour_list[near_place(i, k)];
        let r = position[j].xyz - x.xyz;
        let distance_squared = dot(r, r);
        if distance_squared > 0.0 {
            let s = weight(distance_squared) / distance_squared;
            sum += (pressure[j] - minimum) * s * r;
//#if CORRECTED
            diagonal += s * r * r;
            mixed += s * r.yxx * r.zzy;
//#endif
        }
    }
    var gradient = params.gradient_scale * sum;
//#if CORRECTED
//#if CORRECTED_SURFACE
    {
//#else
    if state[i] == INNER {
//#endif
        let dummies = dummies_of(count);
        for (var k = 0u; k < dummies; k++) {
            let r = position[neighbour_list[dummy_place(i, k)]].xyz - x.xyz;
            let s = over_square(dot(r, r));
            diagonal += s * r * r;
            mixed += s * r.yxx * r.zzy;
        }
        diagonal *= params.gradient_scale;
        mixed *= params.gradient_scale;
//#if TWO_DIMENSIONS
        diagonal.y = 1.0;
//#endif
        // M is symmetric: its inverse is the matrix of cofactors over the determinant.
        let cofactor = diagonal.yxx * diagonal.zzy - mixed * mixed;
        let across = mixed.yxx * mixed.zzy - diagonal * mixed;
        let determinant = diagonal.x * cofactor.x + mixed.z * across.z + mixed.y * across.y;
        if determinant > DETERMINANT_MIN {
            gradient = vec3f(
                cofactor.x * gradient.x + across.z * gradient.y + across.y * gradient.z,
                across.z * gradient.x + cofactor.y * gradient.y + across.x * gradient.z,
                across.y * gradient.x + across.x * gradient.y + cofactor.z * gradient.z,
            ) / determinant;
        }
    }
//#endif
    acceleration[i] = vec4f(-gradient / params.density, 0.0);
}
