// Adds up the pressures of the substep's two projections, before and after the viscous solve.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/bricks.wgsl"

@group(0) @binding(1) var<storage, read> viscous_pressure: array<f32>;
@group(0) @binding(2) var<storage, read_write> pressure: array<f32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.active_cells {
        return;
    }
    let element = thread + CELLS;
    pressure[element] += viscous_pressure[element];
}
