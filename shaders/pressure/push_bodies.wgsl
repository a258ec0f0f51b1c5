// Sums of each brick's pressures over the bodies that it may touch, six for each: of the next
// search direction, or of the solution.
#import "shared/pressure_bodies.wgsl"
#import "shared/pressure_control.wgsl"
#import "shared/pressure_direction.wgsl"

@group(0) @binding(4) var<storage, read> pressure_correction: array<real>;
// The last direction.
@group(0) @binding(5) var<storage, read> pressure_direction: array<real>;
@group(0) @binding(6) var<storage, read> pressure_solution: array<real>;
@group(0) @binding(7) var<storage, read> pressure_control: PressureControl;
@group(0) @binding(8) var<storage, read_write> body_sums: array<real>;

// What is summed.
const OF_DIRECTION = 0u;

var<workgroup> terms: array<array<real, 6>, 64>;

fn value_at(e: u32) -> real {
    if phase.step == OF_DIRECTION {
        return next_direction(
            pressure_correction[e], pressure_direction[e], pressure_control.beta);
    }
#ifdef TWO_WORDS
    return pressure_solution[e] + pressure_solution[phase.stride + e];
#else
    return pressure_solution[e];
#endif
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let brick = thread_index(workgroup, workgroups, 0u, 1u);
    let found = body_bricks[min(brick, arrayLength(&body_bricks) - 1u)];
    let is_due = brick < phase.body_bricks;
    for (var pair = found.y; pair < select(found.y, found.z, is_due); pair++) {
        var sums = array<real, 6>(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for (var inner = local; inner < CELLS; inner += 64u) {
            let e = blocked_cell(found.x, inner);
            let value = select(0.0, value_at(e), has_row(e));
            for (var k = 0u; k < 6u; k++) {
                sums[k] += real(body_coupling[CELLS * (6u * pair + k) + inner]) * value;
            }
        }
        terms[local] = sums;
        workgroupBarrier();
        if local < 6u {
            var sum = real(0.0);
            for (var k = 0u; k < 64u; k++) {
                sum += terms[k][local];
            }
            body_sums[6u * pair + local] = sum;
        }
        workgroupBarrier();
    }
}
