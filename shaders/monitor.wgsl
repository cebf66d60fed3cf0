// Sums over the live fluid for the monitors: one row of partial sums a workgroup, finished by the host in f64, and a
// histogram of speeds in whole numbers. Positions are relative to the middle of the domain.
// Twin: src/kernels/monitor.rs

@group(0) @binding(2) var<storage, read> position: array<vec4f>;
@group(0) @binding(3) var<storage, read> velocity: array<vec4f>;
@group(0) @binding(4) var<storage, read> number_density: array<f32>;
@group(0) @binding(5) var<storage, read> state: array<u32>;
@group(0) @binding(6) var<storage, read_write> monitor_sum: array<MonitorSum>;
@group(0) @binding(7) var<storage, read_write> speed_bin: array<atomic<u32>>;

// As crate::backend::gpu::layout::MonitorSum.
struct MonitorSum {
    momentum: vec3f,
    kinetic: f32,
    position: vec3f,
    density_error: f32,
    extent_max: vec3f,
    density_error_max: f32,
    particles: u32,
    inner: u32,
    speed_squared_max: f32,
    pad: u32,
}

// As crate::monitor::SPEED_BINS.
const SPEED_BINS: u32 = 256u;

// Half the usual width: the sums of a full workgroup would not fit the workgroup memory that every device has.
const WIDTH: u32 = 128u;

var<workgroup> sums: array<MonitorSum, WIDTH>;
var<workgroup> bins: array<atomic<u32>, SPEED_BINS>;

fn add(a: MonitorSum, b: MonitorSum) -> MonitorSum {
    return MonitorSum(
        a.momentum + b.momentum,
        a.kinetic + b.kinetic,
        a.position + b.position,
        a.density_error + b.density_error,
        max(a.extent_max, b.extent_max),
        max(a.density_error_max, b.density_error_max),
        a.particles + b.particles,
        a.inner + b.inner,
        max(a.speed_squared_max, b.speed_squared_max),
        0u,
    );
}

@compute @workgroup_size(WIDTH)
fn monitor(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) t: u32,
           @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    atomicStore(&bins[t], 0u);
    atomicStore(&bins[t + WIDTH], 0u);
    workgroupBarrier();
    var sum: MonitorSum;
    sum.extent_max = vec3f(-3.4e38);
    for (var i = id.x; i < params.fluid; i += groups.x * WIDTH) {
        let x = position[i];
        if is_water(x.w) {
            let v = velocity[i].xyz;
            let squared = dot(v, v);
            sum.momentum += v;
            sum.kinetic += 0.5 * squared;
            let place = wrapped(x.xyz);
            sum.position += place;
            sum.extent_max = max(sum.extent_max, place);
            sum.particles += 1u;
            sum.speed_squared_max = max(sum.speed_squared_max, squared);
            atomicAdd(&bins[min(u32(sqrt(squared) / now.speed_per_bin), SPEED_BINS - 1u)], 1u);
            if state[i] == INNER {
                let error = number_density[i] / params.number_density - 1.0;
                sum.density_error += error;
                sum.density_error_max = max(sum.density_error_max, abs(error));
                sum.inner += 1u;
            }
        }
    }
    sums[t] = sum;
    workgroupBarrier();
    if t < 16u {
        for (var k = 1u; k < WIDTH / 16u; k++) {
            sum = add(sum, sums[k * 16u + t]);
        }
        sums[t] = sum;
    }
    workgroupBarrier();
    if t == 0u {
        for (var k = 1u; k < 16u; k++) {
            sum = add(sum, sums[k]);
        }
        monitor_sum[group.x] = sum;
    }
    for (var k = t; k < SPEED_BINS; k += WIDTH) {
        let bin = atomicLoad(&bins[k]);
        if bin > 0u {
            atomicAdd(&speed_bin[k], bin);
        }
    }
}
