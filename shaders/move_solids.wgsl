// Particles of moving solids follow the pose of their solid: r = r_c + R o, v = v_c + w x R o. Those of the wall layer
// carry the direction outwards beside their velocity.
// Twin: src/kernels/move_solids.rs

@group(0) @binding(2) var<storage, read> solid_offset: array<vec4f>; // xyz in the solid's frame, w its number
@group(0) @binding(3) var<storage, read> poses: array<Pose>;
@group(0) @binding(4) var<storage, read_write> position: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> velocity: array<vec4f>;
//#if MIXED
@group(0) @binding(6) var<storage, read> facing: array<f32>; // the same in the solid's frame
//#endif
//#if TURNING
@group(0) @binding(7) var<storage, read> to_surface: array<vec4f>; // from particles of the wall layer, in the solid's frame
//#endif

@compute @workgroup_size(WORKGROUP)
fn move_solids(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k >= params.moving {
        return;
    }
    let offset = solid_offset[k];
    let pose = poses[u32(offset.w)];
    let arm = rotate(pose.orientation, offset.xyz);
    let i = moving_slot_of(k);
    position[i] = vec4f(pose.position.xyz + arm, position[i].w);
    var outward = 0.0;
//#if MIXED
    if k < params.moving_wall {
        outward = direction_word(rotate(pose.orientation, direction_of(facing[k])));
    }
//#endif
    velocity[i] = vec4f(pose.velocity.xyz + cross(pose.angular_velocity.xyz, arm), outward);
}

//#if TURNING
// Velocity of what lies at `place` in the frame of the solid of wall-layer particle k, for that particle.
fn moves_as(k: u32, place: vec3f) {
    let pose = poses[u32(solid_offset[k].w)];
    let i = moving_slot_of(k);
    let spin = cross(pose.angular_velocity.xyz, rotate(pose.orientation, place));
    velocity[i] = vec4f(pose.velocity.xyz + spin, velocity[i].w);
}

// Viscosity and friction act on the surface of a solid, which moves otherwise than the particles below it where the solid turns.
@compute @workgroup_size(WORKGROUP)
fn on_surface(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < params.moving_wall {
        moves_as(k, solid_offset[k].xyz + to_surface[k].xyz);
    }
}

// After `on_surface`.
@compute @workgroup_size(WORKGROUP)
fn at_centre(@builtin(global_invocation_id) id: vec3u) {
    let k = thread(id);
    if k < params.moving_wall {
        moves_as(k, solid_offset[k].xyz);
    }
}
//#endif
