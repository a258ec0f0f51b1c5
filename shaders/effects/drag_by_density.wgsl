// Air drag on flying water: it grows as the water fraction around a particle, given by its density,
// falls.
#import "shared/thread.wgsl"
#import "shared/predicted.wgsl"
#import "shared/vector.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/phase.wgsl"
#import "shared/neighbors.wgsl"
#import "shared/walls.wgsl"
#import "shared/drag.wgsl"

override GRAVITY_X: f32;
override GRAVITY_Y: f32;
override GRAVITY_Z: f32;

@group(0) @binding(10) var<storage, read> position: array<Vector>;
@group(0) @binding(11) var<storage, read_write> velocity: array<Vector>;

var<private> own_position: vec3f;
var<private> kernel_sum: f32;

fn visit(i: u32, j: u32) {
    let other = predicted_at(j);
    let d = between(own_position, other.xyz);
    let p = max(1.0 - dot(d, d) * inverse_h * inverse_h, 0.0);
    kernel_sum += weight(other.w) * p * p * p;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= phase.count {
        return;
    }
    let i = phase_particle(thread);
    own_position = three(position[i]);
    kernel_sum = 0.0;
    begin_phase();
    for_each_neighbor(own_position, i);
    // Density without the particle itself, over that of a full neighbourhood without it.
    let others = params.density_scale * kernel_sum + wall_term(own_position).density;
    let share = others / (1.0 - params.density_scale);
    // The velocity already includes gravity's change in this step.
    let fall = params.time_step * vec3f(GRAVITY_X, GRAVITY_Y, GRAVITY_Z);
    let before = three(velocity[i]);
    let after = blown(before - fall, fall, share, params.time_step);
    velocity[i] = packed(select(before, after, is_exposed(share)));
}
