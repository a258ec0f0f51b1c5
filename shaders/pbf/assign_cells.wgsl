// Determines the cell of each predicted position, and a slot in that cell.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/pbf_params.wgsl"

@group(0) @binding(1) var<storage, read> corrected: array<Vector>;
@group(0) @binding(2) var<storage, read_write> cell_start: array<atomic<u32>>;
@group(0) @binding(10) var<storage, read_write> cell_of: array<u32>;
@group(0) @binding(11) var<storage, read_write> slot_in_cell: array<u32>;

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
    let cell = cell_index(cell_coordinate(three(corrected[thread])));
    cell_of[thread] = cell;
    slot_in_cell[thread] = atomicAdd(&cell_start[cell], 1u);
}
