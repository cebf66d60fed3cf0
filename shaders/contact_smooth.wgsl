// Contact of true surfaces: which points of one solid come near the other's box (`search`), and the normal forces of a
// pair of solids (`force`),
//   D = (sum_i w_i d_i^8)^(1/8),  f_i = s_i (K d_i - C v_i) >= 0,  s_i = w_i (d_i / D)^6,
// with C for the mass that answers the contact where it is (src/contact/smooth/answer.rs).
// Twin: src/contact/smooth/mod.rs
//
// Edges are integrated on the host. What they bring to a face is taken in as more points; where two edges cross, only
// into D and the sum of shares.
//
// One workgroup a pair, of four times as many threads where many points are near (`force_wide`).
//
// All in the frame of the pair's first solid A. The clearance of a point to a face is affine in the point. The host gives
// it in f64 where it is largest: at a corner of the bounding box of the points; from there every term only takes away.
// What is in contact has lost less than it keeps or little more, so a depth comes out to the last digits of its own size,
// wherever in the tank the solids are. Depths from positions would keep those of the position's size.

const GROUP: u32 = 64u;
const FAR: f32 = 3.0e38;

// Of a pair, for as long as its lists hold. First of two: points of A against the box of B; second: the other way.
struct SmoothPair {
    low_a: vec3f, // bounding box of the points of A, and of those of B, each in its own frame
    spring: f32,
    high_a: vec3f,
    stop: f32,
    low_b: vec3f,
    stop_depth: f32,
    high_b: vec3f,
    damping: f32,
    half_a: vec3f, // of A's box
    step: f32,
    first: vec2u, // points
    count: vec2u,
    near: vec2u,  // of them listed
    faces: vec2u, // of B's box, of A's box
    list: u32,    // place of the lists
    sum: u32,     // place of the results
    share: f32,   // of a point's weight
    skin: f32,
    open: u32, // faces with a result: bits 0 to 5 of B's box, 6 to 11 of A's
    pairs: u32, // how many there are
    mass: f32,  // that the damping is for; 0: damped as it is
    pad: u32,
}

// Where the two are now.
struct SmoothPose {
    // Rows of the turn from A's frame to B's; w: velocity of A against B at A's centre, A's frame.
    row_x: vec4f,
    row_y: vec4f,
    row_z: vec4f,
    spin: vec4f, // of A against B, A's frame
    // Largest clearances of the points of A to the lower and the upper faces of B's box, and the other way.
    below_b: vec4f,
    above_b: vec4f,
    below_a: vec4f,
    above_a: vec4f,
    // Crossings of edges, which the host keeps: their deepest depth d, sums of w (d_i / d)^8 and of w (d_i / d)^6.
    found: vec4f,
    // Of them sums of w (d_i / d)^7 n_i, and its moment about A's centre, A's frame.
    found_push: vec4f,
    found_moment: vec4f,
    // Sum of the inverse masses, inverse inertia of A and of B, A's frame: diagonal, then yz, zx and xy; w of the
    // diagonals: from B's centre to A's. Then the same with the water in their slots.
    gives: array<vec4f, 4>,
    turns_a: array<vec4f, 4>,
    turns_b: array<vec4f, 4>,
    // Contacts that the host has found on faces: first and count in `contact_given`; z: place of the states.
    given: vec4u,
}

@group(0) @binding(2) var<storage, read> contact_point: array<vec4f>; // xyz in the solid's frame, w weight
@group(0) @binding(3) var<storage, read> smooth_pair: array<SmoothPair>;
@group(0) @binding(4) var<storage, read> smooth_pose: array<SmoothPose>;
@group(0) @binding(5) var<storage, read_write> contact_list: array<u32>;
@group(0) @binding(6) var<storage, read_write> contact_count: array<vec2u>;
// Of a contact: normal, depth; arm from A's centre, separating speed; weight, face (as in `open`), force.
@group(0) @binding(7) var<storage, read_write> contact_state: array<vec4f>;
@group(0) @binding(8) var<storage, read_write> contact_sum: array<vec4f>;
@group(0) @binding(9) var<storage, read> contact_given: array<vec4f>; // as contact_state

// Clearances of a point to the lower and upper faces of a box.
struct Clearance {
    low: vec3f,
    high: vec3f,
}

// Clearance to the lower face that is `below` at its largest, among points between `low` and `high`; `row` leads to the
// upper face.
fn to_lower(p: vec3f, row: vec3f, low: vec3f, high: vec3f, below: f32) -> f32 {
    return below + dot(row, p - select(low, high, row > vec3f(0.0)));
}

fn to_upper(p: vec3f, row: vec3f, low: vec3f, high: vec3f, above: f32) -> f32 {
    return above - dot(row, p - select(high, low, row > vec3f(0.0)));
}

fn clearance_of(n: u32, side: u32, p: vec3f) -> Clearance {
    var x = smooth_pose[n].row_x.xyz;
    var y = smooth_pose[n].row_y.xyz;
    var z = smooth_pose[n].row_z.xyz;
    var low = smooth_pair[n].low_a;
    var high = smooth_pair[n].high_a;
    var below = smooth_pose[n].below_b.xyz;
    var above = smooth_pose[n].above_b.xyz;
    if side == 1u {
        let back = transpose(mat3x3f(x, y, z));
        x = back[0];
        y = back[1];
        z = back[2];
        low = smooth_pair[n].low_b;
        high = smooth_pair[n].high_b;
        below = smooth_pose[n].below_a.xyz;
        above = smooth_pose[n].above_a.xyz;
    }
    return Clearance(
        vec3f(to_lower(p, x, low, high, below.x), to_lower(p, y, low, high, below.y), to_lower(p, z, low, high, below.z)),
        vec3f(to_upper(p, x, low, high, above.x), to_upper(p, y, low, high, above.y), to_upper(p, z, low, high, above.z)),
    );
}

var<workgroup> listed: array<atomic<u32>, 2>;

// Lists the points of each side within the skin of the other's box, in their order.
@compute @workgroup_size(GROUP)
fn search(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32) {
    let n = group_number(group);
    if n >= smooth_pair[0].pairs {
        return;
    }
    let skin = smooth_pair[n].skin;
    var place = smooth_pair[n].list;
    var near = vec2u(0u);
    for (var side = 0u; side < 2u; side++) {
        let first = smooth_pair[n].first[side];
        let count = smooth_pair[n].count[side];
        for (var start = 0u; start < count; start += GROUP) {
            if t < 2u {
                atomicStore(&listed[t], 0u);
            }
            workgroupBarrier();
            let k = start + t;
            var is_near = false;
            if k < count {
                let c = clearance_of(n, side, contact_point[first + k].xyz);
                let least = min(c.low, c.high);
                is_near = -min(least.x, min(least.y, least.z)) < skin;
            }
            if is_near {
                atomicOr(&listed[t / 32u], 1u << (t % 32u));
            }
            workgroupBarrier();
            let words = vec2u(atomicLoad(&listed[0]), atomicLoad(&listed[1]));
            if is_near {
                let before = words[t / 32u] & ((1u << (t % 32u)) - 1u);
                let rank = countOneBits(before) + select(0u, countOneBits(words.x), t >= 32u);
                contact_list[place + near[side] + rank] = first + k;
            }
            near[side] += countOneBits(words.x) + countOneBits(words.y);
            workgroupBarrier();
        }
        place += count;
    }
    if t == 0u {
        contact_count[n] = near;
    }
}

// Depth (not above 0: outside), minus its gradient, and the nearest face; as `depth` in src/shape/cuboid/depth.rs.
struct Inside {
    depth: f32,
    outward: vec3f,
    face: u32,
}

// The face of an axis that a point is pushed out through; `open`: bit 0 the lower one, bit 1 the upper one.
fn nearest(axis: vec3f, number: u32, low: f32, high: f32, open: u32) -> Inside {
    let upper = select(high < low, open == 2u, open != 3u);
    let depth = select(select(low, high, upper), FAR, open == 0u);
    return Inside(depth, select(-axis, axis, upper), number + u32(upper));
}

// `found` with the next face blended in.
fn blended(found: Inside, next: Inside) -> Inside {
    let a = found.depth;
    let b = next.depth;
    if b >= 2.0 * a {
        return found;
    }
    let r = b / a;
    return Inside(
        0.2 * a + 0.8 * b - 0.2 * b * r,
        (0.2 + 0.2 * r * r) * found.outward + (0.8 - 0.4 * r) * next.outward,
        found.face,
    );
}

fn inside(c: Clearance, faces: u32) -> Inside {
    let over = min(c.low, c.high);
    if min(over.x, min(over.y, over.z)) <= 0.0 {
        return Inside(0.0, vec3f(0.0), 0u);
    }
    var first = nearest(vec3f(1.0, 0.0, 0.0), 0u, c.low.x, c.high.x, faces & 3u);
    var second = nearest(vec3f(0.0, 1.0, 0.0), 2u, c.low.y, c.high.y, (faces >> 2u) & 3u);
    var third = nearest(vec3f(0.0, 0.0, 1.0), 4u, c.low.z, c.high.z, (faces >> 4u) & 3u);
    if second.depth < first.depth {
        let other = first;
        first = second;
        second = other;
    }
    if third.depth < second.depth {
        let other = second;
        second = third;
        third = other;
    }
    if second.depth < first.depth {
        let other = first;
        first = second;
        second = other;
    }
    if first.depth == FAR {
        return Inside(0.0, vec3f(0.0), 0u);
    }
    return blended(blended(first, second), third);
}

// Share of a dashpot that a point feels which has come `depth` since it began, in sub-steps of `step`; as `felt` in
// src/contact/smooth/constants.rs.
fn felt(depth: f32, speed: f32, step: f32) -> f32 {
    let steps = depth / max(-speed * step, 1e-30);
    return select(1.0, select(max(2.0 - 0.5 * steps, 1.0), 1.5 * steps, steps < 1.0), speed < 0.0);
}

// Threads that share the sums of a face at most, for each GROUP of them that a workgroup has.
const SHARING: u32 = 16u;
// Listed points from which a pair has a workgroup of WIDE threads: with fewer most of them would have little to do. As
// MANY_POINTS in src/contact/smooth/device.rs.
const MANY_POINTS: u32 = 2048u;
const WIDE: u32 = 256u;

var<workgroup> part_x: array<vec4f, GROUP>;
var<workgroup> part_y: array<vec4f, GROUP>;
var<workgroup> part_z: array<vec4f, GROUP>;
var<workgroup> used_faces: array<u32, GROUP>;
var<workgroup> seen: vec2u;

// The sum of the turns before with the next one; `before` is nothing in the first turn.
fn joined(before: vec4f, next: vec4f, turn: u32) -> vec4f {
    if turn == 0u {
        return next;
    }
    return before + next;
}

// v M v of a symmetric matrix.
fn form(diagonal: vec4f, beside: vec4f, v: vec3f) -> f32 {
    return dot(diagonal.xyz, v * v) + 2.0 * dot(beside.xyz, v.yzx * v.zxy);
}

// Share of the mass that answers a contact, from its sums of w d^6, w d^8 and w d^7 n and the moment of that.
fn answering(n: u32, sixth: f32, eighth: f32, push: vec3f, moment: vec3f) -> f32 {
    let mass = smooth_pair[n].mass;
    let gives = smooth_pose[n].gives;
    let turns_a = smooth_pose[n].turns_a;
    let turns_b = smooth_pose[n].turns_b;
    let between = vec3f(gives[0].w, turns_a[0].w, turns_b[0].w);
    let moved = moment + cross(between, push);
    var response: array<f32, 2>;
    for (var k = 0u; k < 2u; k++) {
        response[k] = form(gives[2u * k], gives[2u * k + 1u], push) + form(turns_a[2u * k], turns_a[2u * k + 1u], moment)
            + form(turns_b[2u * k], turns_b[2u * k + 1u], moved);
    }
    if mass == 0.0 || response[1] <= 0.0 {
        return 1.0;
    }
    return min(sixth * eighth / (response[0] * mass), 1.0) * response[0] / response[1];
}

fn near_points(n: u32) -> u32 {
    return smooth_pair[n].near.x + smooth_pair[n].near.y;
}

// `press` of every pair with fewer points than MANY_POINTS, and of the others.
@compute @workgroup_size(GROUP)
fn force(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32) {
    let n = group_number(group);
    if n >= smooth_pair[0].pairs || near_points(n) >= MANY_POINTS {
        return;
    }
    press(n, t, GROUP);
}

@compute @workgroup_size(WIDE)
fn force_wide(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32) {
    let n = group_number(group);
    if n >= smooth_pair[0].pairs || near_points(n) < MANY_POINTS {
        return;
    }
    press(n, t, WIDE);
}

// Result of a pair, zeros if nothing touches but crossings: D, the deepest depth, contacts without crossings, sum of
// shares over the share of the mass that answers. Then of each face of B, and of A, that is open: force on A and sum of
// the points' forces; moment about A's centre and mean distance from the centre
// of the force; that centre, seen from A's.
//
// The threads' sums meet in GROUP places. Where there are more threads they bring them by turns, GROUP at a time: the
// order of sums is fixed, and small pairs take no more of a device's memory for workgroups than they did.
fn press(n: u32, t: u32, width: u32) {
    let turns = width / GROUP;
    let turn = t / GROUP;
    let seat = t % GROUP;
    let list = smooth_pair[n].list;
    let near = smooth_pair[n].near;
    let points = near.x + near.y;
    let given = smooth_pose[n].given;
    let total = points + given.y;
    let faces = smooth_pair[n].faces;
    let rows = mat3x3f(smooth_pose[n].row_x.xyz, smooth_pose[n].row_y.xyz, smooth_pose[n].row_z.xyz);
    let velocity = vec3f(smooth_pose[n].row_x.w, smooth_pose[n].row_y.w, smooth_pose[n].row_z.w);
    let spin = smooth_pose[n].spin.xyz;
    let sum = smooth_pair[n].sum;
    let state = given.z;
    var own_deepest = 0.0;
    var own_used = 0u;
    for (var m = t; m < total; m += width) {
        if m >= points {
            let read_at = 3u * (given.x + m - points);
            let place = state + 3u * m;
            contact_state[place] = contact_given[read_at];
            contact_state[place + 1u] = contact_given[read_at + 1u];
            contact_state[place + 2u] = contact_given[read_at + 2u];
            own_deepest = max(own_deepest, contact_given[read_at].w);
            own_used |= 1u << u32(contact_given[read_at + 2u].y);
            continue;
        }
        let side = u32(m >= near.x);
        let k = contact_list[list + select(m, smooth_pair[n].count.x + m - near.x, side == 1u)];
        let p = contact_point[k];
        let c = clearance_of(n, side, p.xyz);
        let found = inside(c, select(faces.x, faces.y, side == 1u));
        var normal = vec3f(0.0);
        var arm = p.xyz;
        if side == 0u {
            normal = rows * found.outward;
        } else {
            normal = -found.outward;
            arm = smooth_pair[n].half_a - c.high;
        }
        let speed = dot(velocity + cross(spin, arm), normal);
        let place = state + 3u * m;
        contact_state[place] = vec4f(normal, max(found.depth, 0.0));
        contact_state[place + 1u] = vec4f(arm, speed);
        contact_state[place + 2u] = vec4f(smooth_pair[n].share * p.w, f32(found.face + 6u * side), 0.0, 0.0);
        if found.depth > 0.0 {
            own_deepest = max(own_deepest, found.depth);
            own_used |= 1u << (found.face + 6u * side);
        }
    }
    for (var k = 0u; k < turns; k++) {
        if turn == k {
            part_x[seat].x = max(own_deepest, select(part_x[seat].x, 0.0, k == 0u));
            used_faces[seat] = own_used | select(used_faces[seat], 0u, k == 0u);
        }
        workgroupBarrier();
    }
    if t < 8u {
        for (var k = t + 8u; k < GROUP; k += 8u) {
            part_x[t].x = max(part_x[t].x, part_x[k].x);
            used_faces[t] |= used_faces[k];
        }
    }
    workgroupBarrier();
    if t == 0u {
        for (var k = 1u; k < 8u; k++) {
            part_x[0].x = max(part_x[0].x, part_x[k].x);
            used_faces[0] |= used_faces[k];
        }
        seen = vec2u(bitcast<u32>(part_x[0].x), used_faces[0]);
    }
    let both = workgroupUniformLoad(&seen);
    let added = smooth_pose[n].found;
    let deepest = max(bitcast<f32>(both.x), added.x);
    let used = both.y;

    let open = smooth_pair[n].open;
    for (var k = t; k < 1u + 4u * countOneBits(open); k += width) {
        contact_sum[sum + k] = vec4f(0.0);
    }
    if used == 0u {
        return;
    }

    var eighth = 0.0;
    var sixth = 0.0;
    var touching = 0.0;
    var seventh = vec3f(0.0);
    var turned = vec3f(0.0);
    for (var m = t; m < total; m += width) {
        let normal = contact_state[state + 3u * m];
        let depth = normal.w;
        if depth > 0.0 {
            let x = depth / deepest;
            let x2 = x * x;
            let share = contact_state[state + 3u * m + 2u].x * x2 * x2 * x2;
            let way = share * x * normal.xyz;
            sixth += share;
            eighth += share * x2;
            touching += 1.0;
            seventh += way;
            turned += cross(contact_state[state + 3u * m + 1u].xyz, way);
        }
    }
    for (var k = 0u; k < turns; k++) {
        if turn == k {
            part_x[seat] = joined(part_x[seat], vec4f(seventh, 0.0), k);
            part_y[seat] = joined(part_y[seat], vec4f(eighth, sixth, touching, 0.0), k);
            part_z[seat] = joined(part_z[seat], vec4f(turned, 0.0), k);
        }
        workgroupBarrier();
    }
    if t < 8u {
        for (var k = t + 8u; k < GROUP; k += 8u) {
            part_x[t] += part_x[k];
            part_y[t] += part_y[k];
            part_z[t] += part_z[k];
        }
    }
    workgroupBarrier();
    var parts = part_y[0];
    var way = part_x[0].xyz;
    var moving = part_z[0].xyz;
    for (var k = 1u; k < 8u; k++) {
        parts += part_y[k];
        way += part_x[k].xyz;
        moving += part_z[k].xyz;
    }
    let ratio = added.x / deepest;
    let sixth_power = ratio * ratio * ratio * ratio * ratio * ratio;
    parts.x += added.y * sixth_power * ratio * ratio;
    parts.y += added.z * sixth_power;
    way += sixth_power * ratio * smooth_pose[n].found_push.xyz;
    moving += sixth_power * ratio * smooth_pose[n].found_moment.xyz;
    let mean = sqrt(sqrt(sqrt(parts.x)));
    let depth = deepest * mean;
    let to_mean = 1.0 / (mean * mean * mean * mean * mean * mean);
    let shares = parts.y * to_mean / answering(n, parts.y, parts.x, way, moving);
    let spring = smooth_pair[n].spring;
    let beyond = max(depth - smooth_pair[n].stop_depth, 0.0);
    let secant = spring + (smooth_pair[n].stop - spring) * beyond / depth;
    // As `grown` in src/contact/smooth/constants.rs, over the depth.
    let past = beyond / depth;
    let more = smooth_pair[n].stop / spring - 1.0;
    let grown = (1.0 + more * past) / sqrt(1.0 + more * past * past);
    let damping = smooth_pair[n].damping * grown / sqrt(shares);
    let step = smooth_pair[n].step;
    for (var m = t; m < total; m += width) {
        let place = state + 3u * m;
        let own = contact_state[place].w;
        let speed = contact_state[place + 1u].w;
        var f = 0.0;
        if own > 0.0 {
            let x = own / deepest;
            let share = contact_state[place + 2u].x * x * x * x * x * x * x * to_mean;
            f = max(share * (secant * own - felt(own, speed, step) * damping * speed), 0.0);
        }
        contact_state[place + 2u].z = f;
    }

    // What threads have read for `way` and `moving` is written anew below, which the first barrier does not order.
    workgroupBarrier();
    storageBarrier();
    // A few threads for each face that is pressed.
    let pressed = countOneBits(used);
    let sharing = min(GROUP / pressed, SHARING * turns);
    let face = seat / sharing;
    let first = face * sharing;
    var key = 12u;
    var m_first = total;
    if face < pressed {
        var rest = used;
        for (var k = 0u; k < face; k++) {
            rest &= rest - 1u;
        }
        key = firstTrailingBit(rest);
        m_first = seat - first + sharing * turn;
    }
    var push = vec4f(0.0);
    var moment = vec3f(0.0);
    var at = vec3f(0.0);
    for (var m = m_first; m < total; m += sharing * turns) {
        let place = state + 3u * m;
        let f = contact_state[place + 2u].z;
        if f > 0.0 && u32(contact_state[place + 2u].y) == key {
            let arm = contact_state[place + 1u].xyz;
            let own = f * contact_state[place].xyz;
            push += vec4f(own, f);
            moment += cross(arm, own);
            at += f * arm;
        }
    }
    // `part_y`, read for `parts`, comes after the others: their barriers lie between.
    for (var k = 0u; k < turns; k++) {
        if turn == k {
            part_x[seat] = joined(part_x[seat], push, k);
            part_z[seat] = joined(part_z[seat], vec4f(at, 0.0), k);
        }
        workgroupBarrier();
    }
    for (var k = 0u; k < turns; k++) {
        if turn == k {
            part_y[seat] = joined(part_y[seat], vec4f(moment, 0.0), k);
        }
        if k + 1u < turns {
            workgroupBarrier();
        }
    }
    if face < pressed && t == first {
        for (var k = 1u; k < sharing; k++) {
            part_x[t] += part_x[t + k];
            part_z[t] += part_z[t + k];
        }
        part_z[t] /= max(part_x[t].w, 1e-30);
    }
    workgroupBarrier();
    // Second moments about the centre: xx, yy, zz and xy, yz, zx.
    let all = part_x[first];
    let center = part_z[first].xyz;
    var square = vec3f(0.0);
    var product = vec3f(0.0);
    if face < pressed {
        for (var m = m_first; m < total; m += sharing * turns) {
            let place = state + 3u * m;
            if u32(contact_state[place + 2u].y) == key {
                let arm = contact_state[place + 1u].xyz - center;
                let weighed = contact_state[place + 2u].z * arm;
                square += weighed * arm;
                product += weighed * arm.yzx;
            }
        }
    }
    workgroupBarrier();
    for (var k = 0u; k < turns; k++) {
        if turn == k {
            part_x[seat] = joined(part_x[seat], vec4f(square, 0.0), k);
            part_z[seat] = joined(part_z[seat], vec4f(product, 0.0), k);
        }
        workgroupBarrier();
    }
    if face < pressed && t == first {
        var turning = part_y[t];
        square = part_x[t].xyz;
        product = part_z[t].xyz;
        for (var k = 1u; k < sharing; k++) {
            turning += part_y[t + k];
            square += part_x[t + k].xyz;
            product += part_z[t + k].xyz;
        }
        let each = 1.0 / max(all.w, 1e-30);
        square *= each;
        product *= each;
        let slot = sum + 1u + 4u * countOneBits(open & ((1u << key) - 1u));
        contact_sum[slot] = all;
        contact_sum[slot + 1u] = vec4f(turning.xyz, square.x);
        contact_sum[slot + 2u] = vec4f(center, square.y);
        contact_sum[slot + 3u] = vec4f(square.z, product.y, product.z, product.x);
    }
    if t == 0u {
        contact_sum[sum] = vec4f(depth, deepest, parts.z, shares);
    }
}
