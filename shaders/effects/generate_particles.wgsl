// Particles in a generation zone go a part of the way to the velocity of the waves at the substep's end. Drops, which a projection
// on a grid tells from water, fall as they do elsewhere.
#import "shared/thread.wgsl"
#import "shared/phase.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/zone.wgsl"
#import "shared/open_waves.wgsl"

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
    let x = position[i].xyz;
    let part = led(x, params.time_step);
    let is_drop = velocity[i].w > 0.0;
    if part > 0.0 && !is_drop {
        let v = velocity[i].xyz;
        velocity[i] = vec4f(v + part * (wave_velocity(x) - v), velocity[i].w);
    }
}
