// Shift: a particle whose neighbours lie more to one side moves a little to the other, without a change of velocity:
// x_i -= 0.3 dt (sqrt(g l0) + |v_i|) l0 d / n0 sum w_ij r_ij / r_ij^2, by l0 / 20 at most.
// pressure_gradient.wgsl sums the imbalance, which is zero on the free surface.
// Twin: src/kernels/shift.rs

@group(0) @binding(2) var<storage, read_write> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read> imbalance: array<vec4f>;

@compute @workgroup_size(WORKGROUP)
fn shift(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i >= params.fluid {
        return;
    }
    let sum = imbalance[i].xyz;
    if all(sum == vec3f(0.0)) {
        return;
    }
    let x = position[i];
    position[i] = moved(x, shift_way(sum, velocity[i].xyz));
}
