// Takes over the corrected positions: all corrections of a dispatch read the positions from before
// it. For the Chebyshev semi-iteration it also keeps the previous positions.
#import "shared/thread.wgsl"
#import "shared/predicted_written.wgsl"
#import "shared/vector.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/phase.wgsl"

#ifdef CHEBYSHEV
@group(0) @binding(10) var<storage, read_write> corrected: array<Vector>;
#else
@group(0) @binding(10) var<storage, read> corrected: array<Vector>;
#endif

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
    let before = predicted_at(i);
    set_predicted(i, vec4f(three(corrected[i]), before.w));
#ifdef CHEBYSHEV
    corrected[i] = packed(before.xyz);
#endif
}
