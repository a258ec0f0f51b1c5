// Changes of the bodies' velocities by the summed pressures, one workgroup for each body; or by the
// sums of flip/couple_bodies, which follow those by pressures.
#import "shared/pressure_phase.wgsl"
#import "shared/pressure_real.wgsl"
#import "shared/bodies.wgsl"

@group(0) @binding(1) var<storage, read> body_states: array<DeviceBody>;
@group(0) @binding(2) var<storage, read> body_order: array<u32>;
@group(0) @binding(3) var<storage, read> body_sums: array<real>;
@group(0) @binding(4) var<storage, read_write> body_change: array<real>;

// What the sums are: those of flip/couple_bodies, or none.
const OF_WEIGHT = 2u;
const OF_NOTHING = 3u;

var<workgroup> terms: array<array<real, 6>, 64>;
var<workgroup> sums: array<real, 6>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let body = thread_index(workgroup, workgroups, 0u, 1u);
    let count = arrayLength(&body_change) / 12u;
    let last = count - 1u;
    let own = min(body, last);
    var sum = array<real, 6>(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let end = body_states[own].end;
    for (var k = body_states[own].first + local; k < end; k += 64u) {
        let pair = body_order[k];
        for (var i = 0u; i < 6u; i++) {
            sum[i] += body_sums[6u * pair + i];
        }
    }
    terms[local] = sum;
    workgroupBarrier();
    if local < 6u {
        var all = real(0.0);
        for (var k = 0u; k < 64u; k++) {
            all += terms[k][local];
        }
        sums[local] = all;
    }
    workgroupBarrier();
    if local < 6u && body <= last {
        var change = real(0.0);
        for (var k = 0u; k < 6u; k++) {
            let place = 6u * local + k;
            let response = body_states[own].response[place / 4u][place % 4u];
            change += real(response) * sums[k];
        }
        let first = select(0u, 6u * count, phase.step >= OF_WEIGHT);
        body_change[first + 6u * own + local] = select(change, 0.0, phase.step == OF_NOTHING);
    }
}
