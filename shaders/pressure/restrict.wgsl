// Sums the residuals of the finer level into a level, and smooths that from a correction of 0
// (shared/pressure_cycle.wgsl).
#import "shared/pressure_cycle.wgsl"
#import "shared/bricks.wgsl"

@group(0) @binding(7) var<storage, read> bricks: array<Brick>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let group = thread_index(workgroup, workgroups, 0u, 1u);
    let slot = brick_slot(group, phase.level);
    // Eight threads for each brick below; each takes 2³ of its blocks.
    let child = bricks[slot].children[local >> 3u];
    let last = last_slot(phase.level - 1u);
    let bit = vec3u(local & 1u, (local >> 1u) & 1u, (local >> 2u) & 1u);
    let first = dot(bit, vec3u(2u, 8u, 32u));
    let far = bricks_beside(child, first, last);
    let own = pressure_bricks[child].above + above_offset(first);
    // Of the eight blocks, those with an even sum of coordinates have the first colour. Without a
    // brick the residual stays 0.
    for (var k = select(4u, 0u, child != 0u); k < 4u; k++) {
        let c = 2u * k + (countOneBits(k) & 1u);
        let d = 7u - c;
        let even = first + (c & 1u) + 4u * ((c >> 1u) & 1u) + 16u * (c >> 2u);
        let odd = first + (d & 1u) + 4u * ((d >> 1u) & 1u) + 16u * (d >> 2u);
        pressure_residual[own + 64u * c] = passed_by_first(site_beside(child, even, far));
        pressure_residual[own + 64u * d] = passed_by_second(site_beside(child, odd, far));
    }
    storageBarrier();
    let colour = local >> 5u;
    let s = site_at(slot, coloured_block(local & 31u, colour), last_slot(phase.level));
    smooth_brick(s, colour, residual_at(s), slot != 0u);
}
