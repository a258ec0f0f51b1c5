// Explicit step of the external forces (Macklin and Müller 2013, algorithm 1, lines 1–4), into the
// second half of `predicted`; the sort moves it to the first.
#import "shared/thread.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/confine.wgsl"

@group(0) @binding(1) var<storage, read_write> predicted: array<vec4f>;
@group(0) @binding(10) var<storage, read> position: array<vec4f>;
@group(0) @binding(11) var<storage, read> velocity: array<vec4f>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.particle_count {
        return;
    }
    let step = params.time_step * (velocity[thread].xyz + params.velocity_step);
    let shorten = min(1.0, params.max_displacement / max(length(step), 1e-30));
    let x = confine(position[thread].xyz + shorten * step);
    predicted[params.particle_count + thread] = vec4f(x, 0.0);
}
