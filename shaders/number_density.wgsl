// Particle number density, Eq. (4), n_i = sum w_ij over all neighbours, and the free surface.
// Twin: src/kernels/number_density.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(4) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(5) var<storage, read_write> number_density: array<f32>;
@group(0) @binding(6) var<storage, read_write> state: array<u32>;

// Distance of the neighbours' centroid, over l0, from which a thin particle counts as surface.
const OFFSET: f32 = 0.2;

@compute @workgroup_size(WORKGROUP)
fn number_density_main(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i >= params.pressure_slots {
        return;
    }
    let me = position[i];
    let count = neighbour_count[i];
    let near = near_of(count);
    let dummies = dummies_of(count);
    var n = 0.0;
    var centroid = vec3f(0.0);
    var wet = i < params.fluid && is_water(me.w);
    for (var k = 0u; k < near; k++) {
        let j = neighbour_list_at(k, i);
        let r = offset(me.xyz, position[j].xyz);
        let w = weight(dot(r, r));
        n += w;
        centroid += w * r;
        wet = wet || (j < params.fluid && w > 0.0);
    }
    for (var k = 0u; k < dummies; k++) {
        let r = offset(me.xyz, position[neighbour_list_at(dummy_plane(k), i)].xyz);
        let w = weight(dot(r, r));
        n += w;
        centroid += w * r;
    }
//#if RANKS
    // Walls of other ranks take no part; of their water they tell.
    wet = wet && me.w != FOREIGN;
//#endif
//#if THRESHOLD_OFFSET
    let surface = n < 0.8 * params.surface_below
        || (n < params.surface_below && length(centroid) > OFFSET * params.spacing * n);
//#else
    let surface = n < params.surface_below;
//#endif
    number_density[i] = n;
    state[i] = select(INACTIVE, select(INNER, SURFACE, surface), wet);
}
