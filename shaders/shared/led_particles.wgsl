// A pass over the particles in a zone. The importing pass defines `lead`, which updates a particle
// at a position. Isolated droplets, which the grid projection tells from water, fall as outside the
// zone.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/phase.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/zone.wgsl"

@group(0) @binding(10) var<storage, read> position: array<Vector>;
@group(0) @binding(11) var<storage, read_write> velocity: array<Vector>;
#ifdef PROJECTED
@group(0) @binding(12) var<storage, read> is_drop: array<f32>;
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
#ifdef PROJECTED
    lead(i, three(position[i]), is_drop[i] > 0.0);
#else
    lead(i, three(position[i]), false);
#endif
}
