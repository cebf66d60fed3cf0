// Free bodies in the pressure equation:
//   (A + kappa S M^-1 S^T) P = b - kappa S M^-1 f,
// a row of S a wall-layer particle: force and torque of one pascal on it; f what acts on the body beside the pressure.
// `prepare` makes the rows and takes the known forces off the right side; `respond` finds y = kappa M^-1 S^T z of the
// vector beside the positions, and conjugate_gradient.wgsl adds S y. One workgroup a free body, 256 rows at a time.
// Twin: src/kernels/coupling.rs

@group(0) @binding(2) var<storage, read> poses: array<Pose>;
@group(0) @binding(3) var<storage, read> wall_layer: array<WallParticle>;
@group(0) @binding(4) var<storage, read> excess: array<f32>; // of the walls' rows, the moving ones first
@group(0) @binding(5) var<storage, read> free_body: array<FreeBody>;
@group(0) @binding(6) var<storage, read_write> source_diagonal: array<vec2f>;
// Of each moving-wall slot what slots between solids bring it (of a pascal force and the part of its own area that is taken,
// torque and the link through which water seeps; force of the water's weight and that link times the pressure behind it, torque); then of each force and the place of its y, torque and what it adds to the
// diagonal; then y of each body.
@group(0) @binding(7) var<storage, read_write> coupling: array<vec4f>;
@group(0) @binding(8) var<storage, read> preconditioned: array<vec4f>;
//#if REACTION
@group(0) @binding(9) var<storage, read> reaction: array<vec4f>;
//#endif

// How a body answers: M^-1 times rho / (c l0^3), with the c by which the device's equation is divided. Arms count in spacings
// here, and so torques, turns and inertia: in metres f32 would not hold those of a body of microns.
struct FreeBody {
    moves: array<vec4f, 3>, // columns: velocity by force
    crosses: array<vec4f, 3>, // velocity by torque; turned round, turn by force
    turns: array<vec4f, 3>, // turn by torque
    force: vec4f, // beside the fluid's
    torque: vec4f,
    first: u32, // of the moving-wall slots
    count: u32,
    solid: u32,
    bodies: u32, // how many there are
}

var<workgroup> force_of: array<vec3f, 256>;
var<workgroup> torque_of: array<vec3f, 256>;
var<workgroup> force_row: array<vec3f, 16>;
var<workgroup> torque_row: array<vec3f, 16>;

// Sum over the workgroup, the same on every thread and in a fixed order.
fn workgroup_sum(value: Wrench, t: u32) -> Wrench {
    force_of[t] = value.force;
    torque_of[t] = value.torque;
    workgroupBarrier();
    if t < 16u {
        var sum = Wrench(vec3f(0.0), vec3f(0.0));
        for (var k = 0u; k < 16u; k++) {
            sum.force += force_of[k * 16u + t];
            sum.torque += torque_of[k * 16u + t];
        }
        force_row[t] = sum.force;
        torque_row[t] = sum.torque;
    }
    workgroupBarrier();
    var sum = Wrench(vec3f(0.0), vec3f(0.0));
    for (var k = 0u; k < 16u; k++) {
        sum.force += force_row[k];
        sum.torque += torque_row[k];
    }
    return sum;
}

fn respond_to(b: u32, w: Wrench) -> Wrench {
    var moved = vec3f(0.0);
    var turned = vec3f(0.0);
    for (var k = 0u; k < 3u; k++) {
        let crosses = free_body[b].crosses[k].xyz;
        moved += free_body[b].moves[k].xyz * w.force[k] + crosses * w.torque[k];
        turned += free_body[b].turns[k].xyz * w.torque[k];
        turned[k] += dot(crosses, w.force);
    }
    return Wrench(moved, turned);
}

fn product(row: Wrench, y: Wrench) -> f32 {
    return dot(row.force, y.force) + dot(row.torque, y.torque);
}

@compute @workgroup_size(WORKGROUP)
fn prepare(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32) {
    let b = group_number(group);
    if b >= free_body[0].bodies {
        return;
    }
    let pose = poses[free_body[b].solid];
    let place = word_of(coupled_row(params.moving_wall + b));
    let end = free_body[b].first + free_body[b].count;
    let per_spacing = 1.0 / params.spacing;
    var known = Wrench(vec3f(0.0), vec3f(0.0));
    for (var k = free_body[b].first + t; k < end; k += WORKGROUP) {
        let wall = wall_layer[k];
        let arm = per_spacing * rotate(pose.orientation, wall.arm.xyz);
        var row = Wrench(vec3f(0.0), vec3f(0.0));
        var force = vec3f(0.0);
        let slot = coupling[4u * k];
        let part = 1.0 - slot.w;
        if is_known_row(excess[k]) {
            let pressed = pressed_on_faces(pose, wall, part, -excess[k], 0.0);
            let at_rim = max(-excess[k], 0.0);
            known.force += pressed.force + at_rim * slot.xyz + coupling[4u * k + 2u].xyz;
            known.torque += per_spacing
                * (pressed.torque + at_rim * coupling[4u * k + 1u].xyz + coupling[4u * k + 3u].xyz);
        } else if excess[k] < DRY {
            row = pressed_evenly(pose, wall, part);
            row.torque *= per_spacing;
            let at_zero = pressed_on_faces(pose, wall, part, -excess[k], -LARGEST);
            known.force += at_zero.force;
            known.torque += per_spacing * at_zero.torque;
            force = params.dynamic_viscosity * cross(pose.angular_velocity.xyz, row.force);
            let of_torque = coupling[4u * k + 1u];
            let head = coupling[4u * k + 2u];
            row.force += slot.xyz;
            row.torque += per_spacing * of_torque.xyz;
            known.force += head.xyz;
            known.torque += per_spacing * coupling[4u * k + 3u].xyz;
            source_diagonal[params.fluid + k] += vec2f(head.w, of_torque.w);
        }
//#if REACTION
        force += reaction[k].xyz;
//#endif
        known.force += force;
        known.torque += cross(arm, force);
        coupling[coupled_row(k)] = vec4f(row.force, place);
        coupling[coupled_row(k) + 1u] = vec4f(row.torque, product(row, respond_to(b, row)));
    }
    known = workgroup_sum(known, t);
    known.force += free_body[b].force.xyz;
    known.torque += free_body[b].torque.xyz;
    let y = respond_to(b, known);
//#if RANKS
    // Of this rank's part of them; `subtract` follows when those of all ranks are added.
    if t == 0u {
        let answer = coupled_row(params.moving_wall + b);
        coupling[answer] = vec4f(y.force, 0.0);
        coupling[answer + 1u] = vec4f(y.torque, 0.0);
    }
}

@compute @workgroup_size(WORKGROUP)
fn subtract(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32) {
    let b = group_number(group);
    if b >= free_body[0].bodies {
        return;
    }
    let end = free_body[b].first + free_body[b].count;
    let place = coupled_row(params.moving_wall + b);
    let y = Wrench(coupling[place].xyz, coupling[place + 1u].xyz);
//#endif
    for (var k = free_body[b].first + t; k < end; k += WORKGROUP) {
        let row = Wrench(coupling[coupled_row(k)].xyz, coupling[coupled_row(k) + 1u].xyz);
        source_diagonal[params.fluid + k].x -= product(row, y);
    }
}

@compute @workgroup_size(WORKGROUP)
fn respond(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32) {
    let b = group_number(group);
    if b >= free_body[0].bodies {
        return;
    }
    let end = free_body[b].first + free_body[b].count;
    var sum = Wrench(vec3f(0.0), vec3f(0.0));
    for (var k = free_body[b].first + t; k < end; k += WORKGROUP) {
        let z = preconditioned[params.fluid + k].w;
        sum.force += z * coupling[coupled_row(k)].xyz;
        sum.torque += z * coupling[coupled_row(k) + 1u].xyz;
    }
    sum = workgroup_sum(sum, t);
    if t == 0u {
        let y = respond_to(b, sum);
        let place = coupled_row(params.moving_wall + b);
        coupling[place] = vec4f(y.force, 0.0);
        coupling[place + 1u] = vec4f(y.torque, 0.0);
    }
}
