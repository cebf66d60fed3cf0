// What the pressure of a wall's row is above that on the wall's surface, half way to the water before it, but for the weight of the
// water between.
// Twin: src/kernels/wall_excess.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> pressure: array<f32>;
@group(0) @binding(4) var<storage, read> neighbour_list: array<u32>;
@group(0) @binding(5) var<storage, read> neighbour_count: array<u32>;
@group(0) @binding(6) var<storage, read_write> excess: array<f32>; // of the walls' rows

@compute @workgroup_size(WORKGROUP)
fn wall_excess(@builtin(global_invocation_id) id: vec3u) {
    let i = params.fluid + id.x;
    if i >= params.pressure_slots {
        return;
    }
    let x = position[i].xyz;
    let own = pressure[i];
    let near = near_of(neighbour_count[i]);
    var links = 0.0;
    var sum = 0.0;
    for (var k = 0u; k < near; k++) {
        let j = neighbour_list[near_place(i, k)];
        let r = offset(x, position[j].xyz);
        let w = weight(dot(r, r));
        links += w;
        sum += w * (own - pressure[j] + params.density * dot(params.gravity, r));
    }
    excess[id.x] = select(0.0, 0.5 * sum / links, links > 0.0);
}
