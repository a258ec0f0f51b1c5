// Adds to the solids' flux out of each cell that of the bodies' changes of velocity: before the
// solve by what flip/couple_bodies found, after it by the pressure.
#import "shared/body_flux.wgsl"

@group(0) @binding(6) var<storage, read_write> solid_flux: array<f32>;

const OF_WEIGHT = 2u;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let brick = thread_index(workgroup, workgroups, 0u, 1u);
    if brick >= phase.body_bricks {
        return;
    }
    let found = body_bricks[brick];
    let changes = select(0u, arrayLength(&body_change) / 2u, phase.step >= OF_WEIGHT);
    for (var inner = local; inner < CELLS; inner += 64u) {
        let sum = body_flux(found.y, found.z, inner, changes);
        solid_flux[CELLS * found.x + inner] += f32(sum);
    }
}
