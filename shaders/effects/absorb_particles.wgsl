// Particles in an absorbing zone lose a part of their velocity. At rest in the water they have none, so that gravity, which
// the next step adds, and the pressure that holds it are left alone. Drops, which a projection on a grid tells from water, fall as
// they do elsewhere.
#import "shared/thread.wgsl"
#import "shared/phase.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/zone.wgsl"

@group(0) @binding(10) var<storage, read> position: array<vec4f>;
@group(0) @binding(11) var<storage, read_write> velocity: array<vec4f>;

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
    let is_drop = velocity[i].w > 0.0;
    let kept = 1.0 - select(led(position[i].xyz, params.time_step), 0.0, is_drop);
    velocity[i] = vec4f(kept * velocity[i].xyz, velocity[i].w);
}
