// Force and torque of the fluid on a moving solid: F = sum (-P A + reaction), T = sum arm x F over its wall layer. P is
// the pressure on the true surface, half a spacing outside of the particles' centres: without the excess of the particle's row
// (wall_excess.wgsl), with the weight of the water between; beside it the viscous stress on a solid that turns, -rho nu omega x A. A workgroup sums up to 256 particles of one solid; the host finishes in f64.
// Twin: src/kernels/body_force.rs

@group(0) @binding(2) var<storage, read> pressure: array<f32>;
@group(0) @binding(3) var<storage, read> reaction: array<vec4f>;
//#if MIXED
@group(0) @binding(4) var<storage, read> excess: array<f32>; // of the walls' rows, the moving ones first
//#else
@group(0) @binding(4) var<storage, read> state: array<u32>;
//#endif
@group(0) @binding(5) var<storage, read> wall_layer: array<WallParticle>;
@group(0) @binding(6) var<storage, read> poses: array<Pose>;
@group(0) @binding(7) var<storage, read> force_chunk: array<vec4u>; // first of the moving-wall slots, how many, solid
@group(0) @binding(8) var<storage, read_write> wrench: array<vec4f>; // force and torque of each chunk
//#if COUPLED
@group(0) @binding(9) var<storage, read> coupling: array<vec4f>; // as in shaders/coupling.wgsl
//#endif

var<workgroup> force_of: array<vec3f, 256>;
var<workgroup> torque_of: array<vec3f, 256>;
var<workgroup> force_row: array<vec3f, 16>;
var<workgroup> torque_row: array<vec3f, 16>;

@compute @workgroup_size(WORKGROUP)
fn body_force(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32) {
    let number = group_number(group);
    if number >= arrayLength(&force_chunk) {
        return;
    }
    let chunk = force_chunk[number];
    var force = vec3f(0.0);
    var torque = vec3f(0.0);
    if t < chunk.y {
        let k = chunk.x + t;
        let pose = poses[chunk.z];
        let wall = wall_layer[k];
        let p = pressure[params.fluid + k];
//#if MIXED
        let under_water = excess[k] < DRY && !is_known_row(excess[k]);
        let on_surface = p - excess[k];
        let least = -LARGEST;
//#else
        let under_water = state[params.fluid + k] == INNER;
        let on_surface = p;
        let least = 0.0;
//#endif
        var pressed = Wrench(vec3f(0.0), vec3f(0.0));
        // Whether the slots before it pass its pressure on, and which.
        var passes = under_water;
        var at_rim = p;
        var part = 1.0;
//#if COUPLED
        part -= coupling[4u * k].w;
//#endif
        if under_water {
            pressed = pressed_on_faces(pose, wall, part, on_surface, least);
            let area = rotate(pose.orientation, wall.area.xyz);
            force = -part * params.dynamic_viscosity * cross(pose.angular_velocity.xyz, area);
        }
//#if MIXED
        if is_known_row(excess[k]) {
            pressed = pressed_on_faces(pose, wall, part, -excess[k], 0.0);
            passes = true;
            at_rim = max(-excess[k], 0.0);
        }
//#endif
//#if REACTION
        force += reaction[k].xyz;
//#endif
        torque = cross(rotate(pose.orientation, wall.arm.xyz), force) + pressed.torque;
        force += pressed.force;
//#if COUPLED
        if passes {
            force += at_rim * coupling[4u * k].xyz + coupling[4u * k + 2u].xyz;
            torque += at_rim * coupling[4u * k + 1u].xyz + coupling[4u * k + 3u].xyz;
        }
//#endif
    }
    force_of[t] = force;
    torque_of[t] = torque;
    workgroupBarrier();
    if t < 16u {
        force = vec3f(0.0);
        torque = vec3f(0.0);
        for (var k = 0u; k < 16u; k++) {
            force += force_of[k * 16u + t];
            torque += torque_of[k * 16u + t];
        }
        force_row[t] = force;
        torque_row[t] = torque;
    }
    workgroupBarrier();
    if t == 0u {
        force = vec3f(0.0);
        torque = vec3f(0.0);
        for (var k = 0u; k < 16u; k++) {
            force += force_row[k];
            torque += torque_row[k];
        }
        wrench[2u * number] = vec4f(force, 0.0);
        wrench[2u * number + 1u] = vec4f(torque, 0.0);
    }
}
