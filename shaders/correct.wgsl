// Correction: v = v* + dt a with a of wall friction, of collisions or of the pressure gradient. Where r* is the end of the step it
// moves the particle as well, r = r* + dt^2 a; where it is the middle, the second half is gone with the new velocity, r = r* + dt v / 2.
// Twin: src/kernels/correct.rs

@group(0) @binding(2) var<storage, read_write> position: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> acceleration: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> counters: array<atomic<u32>>;

// `last`: the particle goes what is left of its way.
fn change(i: u32, x: vec4f, old: vec4f, a: vec3f, last: bool) {
    let asked = now.dt * a;
    let most = DISPLACEMENT_MAX * params.spacing / now.dt;
    var clamped = longer(asked, most);
    let change = shortened(asked, most);
    let v = old.xyz + change;
    if !finite_vector(v) {
        atomicMin(&counters[NON_FINITE], number_of(old.w));
    }
    velocity[i] = vec4f(v, old.w);
    acceleration[i] = vec4f(0.0);
    let rest = now.dt - now.ahead;
    if rest == 0.0 {
        position[i] = moved(x, now.dt * change);
    } else if last {
        let way = rest * v;
        clamped = clamped || longer(way, longest_way(rest));
        position[i] = moved(x, shortened(way, longest_way(rest)));
    }
    if clamped {
        atomicAdd(&counters[DISPLACEMENT_CLAMPS], 1u);
    }
}

// What comes before the last change of a step.
@compute @workgroup_size(WORKGROUP)
fn kick(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i >= params.fluid {
        return;
    }
    let a = acceleration[i].xyz;
    let old = velocity[i];
    // Most particles collide with none.
    if all(a == vec3f(0.0)) && finite_vector(old.xyz) {
        return;
    }
    let x = position[i];
    if is_water(x.w) {
        change(i, x, old, a, false);
    }
}

@compute @workgroup_size(WORKGROUP)
fn correct(@builtin(global_invocation_id) id: vec3u) {
    let i = thread(id);
    if i >= params.fluid {
        return;
    }
    let x = position[i];
    if is_water(x.w) {
        change(i, x, velocity[i], acceleration[i].xyz, true);
    }
}
