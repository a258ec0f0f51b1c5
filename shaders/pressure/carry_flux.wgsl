// Adds to the solids' flux out of each cell that of the bodies' changes of velocity: before the
// solve by what flip/couple_bodies found, after it by the pressure.
#import "shared/pressure_bodies.wgsl"
#import "shared/thread.wgsl"

@group(0) @binding(4) var<storage, read> body_pairs: array<BodyPair>;
@group(0) @binding(5) var<storage, read> body_change: array<real>;
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
        var sum = real(0.0);
        for (var pair = found.y; pair < found.z; pair++) {
            let body = body_pairs[pair].body;
            for (var k = 0u; k < 6u; k++) {
                sum += real(body_coupling[CELLS * (6u * pair + k) + inner])
                    * body_change[changes + 6u * body + k];
            }
        }
        solid_flux[CELLS * found.x + inner] += f32(sum);
    }
}
