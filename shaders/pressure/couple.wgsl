// Adds the bodies' part to the system's product with a direction, or takes that of the solution
// from the residual, in the bricks that they may touch; renews these bricks' sums.
#import "shared/body_flux.wgsl"
#import "shared/pressure_control.wgsl"
#import "shared/pressure_direction.wgsl"
#import "shared/pressure_sum.wgsl"

alias Terms = vec3r;

@group(0) @binding(4) var<storage, read_write> pressure_correction: array<real>;
// The last direction.
@group(0) @binding(5) var<storage, read> pressure_direction: array<real>;
@group(0) @binding(6) var<storage, read_write> pressure_residual: array<real>;
@group(0) @binding(7) var<storage, read> pressure_control: PressureControl;

const OF_DIRECTION = 0u;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let brick = thread_index(workgroup, workgroups, 0u, 1u);
    let found = body_bricks[min(brick, arrayLength(&body_bricks) - 1u)];
    let is_due = brick < phase.body_bricks;
    let is_product = phase.step == OF_DIRECTION;
    var sums = vec3r(0.0);
    for (var inner = local; inner < select(0u, CELLS, is_due); inner += 64u) {
        let e = blocked_cell(found.x, inner);
        let added = select(0.0, body_flux(found.y, found.z, inner, 0u), has_row(e));
        if is_product {
            let p = next_direction(
                pressure_correction[e], pressure_direction[e], pressure_control.beta);
            let product = pressure_correction[phase.stride + e] + added;
            pressure_correction[phase.stride + e] = product;
            sums += vec3r(p * product, pressure_residual[e] * product, product * product);
        } else {
            let r = pressure_residual[e] - added;
            pressure_residual[e] = r;
            sums.x += r * r;
        }
    }
    let sum = sum_workgroup(sums, local);
    if local == 0u && is_due {
        let group = found.x - phase.levels[0].x;
        if is_product {
            pressure_sums[4u * group + STEEPNESS] = sum.x;
            pressure_sums[4u * group + OVERLAP] = sum.y;
            pressure_sums[4u * group + PRODUCT_SQUARE] = sum.z;
        } else {
            pressure_sums[4u * group + SQUARE] = sum.x;
        }
    }
}
