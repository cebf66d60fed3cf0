// The paper's contact law, Eqs. (10) to (14): which particles of two solids come near each other (`count`, `fill`), and
// the sums over their pairs (`force`),
//   f = [(K (d - d_c) e + C v) . N] N + eta (v - (v . e) e)  for d < d_c,  r = r_j - r_i, e = r / d, v = v_j - v_i.
// The host divides by n_c.
// Twin: src/contact/paper/mod.rs
//
// A workgroup has a block: of the search 64 particles of A and all of B that may be near, of the forces a part of a
// pair's candidates. A pair has one block or few, and two large bodies keep the whole of a device busy. The host leaves
// out what cannot be near, places the blocks' candidates one behind the other, and adds up what the blocks find.
//
// All in the frame of the first solid A. Coordinates are two numbers: `high` of at most 12 bits and the rest, `low`.
// Products of two high parts and their sums have at most 24 bits: they are exact, in any order and with or without fused
// operations, and only low parts get rounded. A position so keeps what f32 loses, and the square of a distance, split in
// the same way, gives d_c - d to some 1e-12 m for a body of 5 cm.

const GROUP: u32 = 64u;

// Of a pair, for as long as its lists hold.
struct PaperPair {
    first: vec2u, // particles of A, and of B or of the walls, three words each in `contact_layer`
    near: u32,    // place in `contact_near` of the particles of B that may be near A; not used for walls
    count: u32,   // of B's or the walls' that may be near
}

// What a workgroup does.
struct PaperBlock {
    pair: u32,
    first: u32,  // search: place of its particles of A in `contact_near`; forces: place of its candidates
    count: u32,  // of these
    list: u32,   // search: place of the candidates it finds
    blocks: u32, // how many there are
}

// Where the two are now: B's frame in A's, in two parts.
struct PaperPose {
    // Columns of the turn from B's frame to A's; w: of the origin of B's points in A's frame.
    high_x: vec4f,
    high_y: vec4f,
    high_z: vec4f,
    low_x: vec4f,
    low_y: vec4f,
    low_z: vec4f,
    velocity: vec4f, // of A against B at A's centre
    spin: vec4f,     // of A against B; w: reach of the search
    spin_b: vec4f,   // of B; w: 0.0, which no compiler knows: see `as_rounded`
}

struct PaperLaw {
    spring: f32,
    damping: f32,
    viscous_friction: f32,
    distance: f32,   // d_c
    scale: f32,      // power of two that makes d_c a number of 11 bits
    whole: f32,      // (d_c scale)^2: the whole number in it and the rest
    fraction: f32,
    pad: f32,
}

// Of a particle: high part, low part, and how it faces: a normal and 0, or the vector part of a box's turn and the faces of it that
// it is of, a bit for each; in its solid's frame.
@group(0) @binding(2) var<storage, read> contact_layer: array<vec4f>;
@group(0) @binding(3) var<storage, read> contact_wall: array<vec4f>;
@group(0) @binding(4) var<storage, read> paper_pair: array<PaperPair>;
@group(0) @binding(5) var<storage, read> paper_pose: array<PaperPose>;
@group(0) @binding(6) var<storage, read> paper_law: array<PaperLaw>;
@group(0) @binding(7) var<storage, read_write> contact_row: array<u32>;
@group(0) @binding(8) var<storage, read_write> contact_list: array<vec2u>;
@group(0) @binding(9) var<storage, read_write> contact_sum: array<vec4f>;
@group(0) @binding(10) var<storage, read> paper_block: array<PaperBlock>;
@group(0) @binding(11) var<storage, read> contact_near: array<u32>;

// Set in `first.y` where B is the walls.
const ON_WALL: u32 = 0x80000000u;

// x as it was rounded. A compiler for a device may be free to reckon with sums as if they were exact: to add what was
// meant to be taken apart, and so to lose the second number of a coordinate. What has passed through here it knows
// nothing of.
fn as_rounded(n: u32, x: vec3f) -> vec3f {
    return bitcast<vec3f>(bitcast<vec3u>(x) ^ vec3u(bitcast<u32>(paper_pose[n].spin_b.w)));
}

fn of_b(n: u32, j: u32, word: u32) -> vec4f {
    let first = paper_pair[n].first.y;
    if (first & ON_WALL) != 0u {
        return contact_wall[3u * ((first & ~ON_WALL) + j) + word];
    }
    return contact_layer[3u * (first + j) + word];
}

// v turned by the unit quaternion of vector part q and scalar w.
fn turned(q: vec3f, w: f32, v: vec3f) -> vec3f {
    let t = 2.0 * cross(q, v);
    return v + w * t + cross(q, t);
}

// How far towards another particle a face of a later axis has to look more than one of an earlier axis.
const MORE: f32 = 0.001;

// N of particle j of B towards a particle that lies along the unit vector `away` of it: the one of its faces that looks most there.
fn normal_of(n: u32, j: u32, away: vec3f) -> vec3f {
    let facing = of_b(n, j, 2u);
    let faces = u32(facing.w);
    if faces == 0u {
        return facing.xyz;
    }
    let w = sqrt(max(1.0 - dot(facing.xyz, facing.xyz), 0.0));
    let own = turned(-facing.xyz, w, away);
    var best = -2.0;
    var chosen = vec3f(0.0);
    for (var k = 0u; k < 6u; k++) {
        let axis = k / 2u;
        let side = select(-1.0, 1.0, (k & 1u) == 1u);
        if ((faces >> k) & 1u) == 1u && side * own[axis] > best + MORE {
            best = side * own[axis];
            chosen = vec3f(0.0);
            chosen[axis] = side;
        }
    }
    return turned(facing.xyz, w, chosen);
}

struct Split {
    high: vec3f,
    low: vec3f,
}

// r_j - r_i in A's frame.
fn apart(n: u32, i: u32, j: u32) -> Split {
    let a = 3u * (paper_pair[n].first.x + i);
    let high = of_b(n, j, 0u).xyz;
    let low = of_b(n, j, 1u).xyz;
    let th = mat3x3f(paper_pose[n].high_x.xyz, paper_pose[n].high_y.xyz, paper_pose[n].high_z.xyz);
    let tl = mat3x3f(paper_pose[n].low_x.xyz, paper_pose[n].low_y.xyz, paper_pose[n].low_z.xyz);
    let sh = vec3f(paper_pose[n].high_x.w, paper_pose[n].high_y.w, paper_pose[n].high_z.w);
    let sl = vec3f(paper_pose[n].low_x.w, paper_pose[n].low_y.w, paper_pose[n].low_z.w);
    var r: Split;
    r.high = as_rounded(n, th * high + sh - contact_layer[a].xyz);
    r.low = tl * (high + low) + th * low + sl - contact_layer[a + 1u].xyz;
    return r;
}

fn is_near(n: u32, i: u32, j: u32) -> bool {
    let r = apart(n, i, j);
    let reach = paper_pose[n].spin.w;
    let whole = r.high + r.low;
    return dot(whole, whole) < reach * reach;
}

// The k-th of B's particles, or of the walls', that may be near A.
fn number_in_b(n: u32, k: u32) -> u32 {
    if (paper_pair[n].first.y & ON_WALL) != 0u {
        return k;
    }
    return contact_near[paper_pair[n].near + k];
}

var<workgroup> scan: array<u32, GROUP>;

// Candidates of each block at the start of `contact_row`, and of each of its particles of A behind them.
@compute @workgroup_size(GROUP)
fn count(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32) {
    let number = group_number(group);
    if number >= paper_block[0].blocks {
        return;
    }
    let block = paper_block[number];
    let n = block.pair;
    var found = 0u;
    if t < block.count {
        let i = contact_near[block.first + t];
        for (var k = 0u; k < paper_pair[n].count; k++) {
            found += u32(is_near(n, i, number_in_b(n, k)));
        }
    }
    contact_row[block.blocks + GROUP * number + t] = found;
    scan[t] = found;
    for (var s = GROUP / 2u; s > 0u; s /= 2u) {
        workgroupBarrier();
        if t < s {
            scan[t] += scan[t + s];
        }
    }
    if t == 0u {
        contact_row[number] = scan[0];
    }
}

// The candidates, ordered by i and j.
@compute @workgroup_size(GROUP)
fn fill(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32) {
    let number = group_number(group);
    if number >= paper_block[0].blocks {
        return;
    }
    let block = paper_block[number];
    let n = block.pair;
    let own = contact_row[block.blocks + GROUP * number + t];
    scan[t] = own;
    for (var s = 1u; s < GROUP; s *= 2u) {
        workgroupBarrier();
        let before = select(0u, scan[max(t, s) - s], t >= s);
        workgroupBarrier();
        scan[t] += before;
    }
    if own == 0u {
        return;
    }
    var next = block.list + scan[t] - own;
    let i = contact_near[block.first + t];
    for (var k = 0u; k < paper_pair[n].count; k++) {
        let j = number_in_b(n, k);
        if is_near(n, i, j) {
            contact_list[next] = vec2u(i, j);
            next += 1u;
        }
    }
}

var<workgroup> part_x: array<vec4f, GROUP>;
var<workgroup> part_y: array<vec4f, GROUP>;
var<workgroup> part_z: array<vec4f, GROUP>;

// Of each block: sum of forces on A and of those along the normals; sum of moments about A's centre and energy; pairs
// and largest d_c - d.
@compute @workgroup_size(GROUP)
fn force(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) t: u32) {
    let number = group_number(group);
    if number >= paper_block[0].blocks {
        return;
    }
    let block = paper_block[number];
    let n = block.pair;
    let law = paper_law[0];
    let turn = mat3x3f(
        paper_pose[n].high_x.xyz + paper_pose[n].low_x.xyz,
        paper_pose[n].high_y.xyz + paper_pose[n].low_y.xyz,
        paper_pose[n].high_z.xyz + paper_pose[n].low_z.xyz,
    );
    var push = vec4f(0.0);
    var moment = vec4f(0.0);
    var pairs = 0.0;
    var deepest = 0.0;
    for (var m = t; m < block.count; m += GROUP) {
        let at = contact_list[block.first + m];
        let r = apart(n, at.x, at.y);
        let whole = r.high + r.low;
        let high = as_rounded(n, round(whole * law.scale));
        let low = as_rounded(n, r.high * law.scale - high) + r.low * law.scale;
        // (d_c^2 - d^2) scale^2: the first bracket is a whole number.
        let parts = vec3f(law.whole - dot(high, high), law.fraction - 2.0 * dot(high, low) - dot(low, low), 0.0);
        let exact = as_rounded(n, parts);
        let gap = exact.x + exact.y;
        let squared = dot(whole, whole);
        if gap <= 0.0 || squared == 0.0 {
            continue;
        }
        let d = sqrt(squared);
        let depth = gap / (law.scale * law.scale * (law.distance + d));
        let e = whole / d;
        let a = 3u * (paper_pair[n].first.x + at.x);
        let arm = contact_layer[a].xyz + contact_layer[a + 1u].xyz;
        let normal = turn * normal_of(n, at.y, -(transpose(turn) * e));
        let v = cross(paper_pose[n].spin_b.xyz, whole) - paper_pose[n].velocity.xyz - cross(paper_pose[n].spin.xyz, arm);
        let along = dot(law.damping * v - law.spring * depth * e, normal);
        let f = along * normal + law.viscous_friction * (v - dot(v, e) * e);
        push += vec4f(f, along);
        moment += vec4f(cross(arm, f), 0.5 * law.spring * depth * depth);
        pairs += 1.0;
        deepest = max(deepest, depth);
    }
    part_x[t] = push;
    part_y[t] = moment;
    part_z[t] = vec4f(pairs, deepest, 0.0, 0.0);
    for (var s = GROUP / 2u; s > 0u; s /= 2u) {
        workgroupBarrier();
        if t < s {
            part_x[t] += part_x[t + s];
            part_y[t] += part_y[t + s];
            part_z[t] = vec4f(part_z[t].x + part_z[t + s].x, max(part_z[t].y, part_z[t + s].y), 0.0, 0.0);
        }
    }
    if t == 0u {
        contact_sum[3u * number] = part_x[0];
        contact_sum[3u * number + 1u] = part_y[0];
        contact_sum[3u * number + 2u] = part_z[0];
    }
}
