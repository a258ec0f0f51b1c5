// Determines each particle's cell element, and a slot in that cell.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/bricks.wgsl"
#import "shared/flip_params.wgsl"

@group(0) @binding(1) var<storage, read> position: array<Vector>;
@group(0) @binding(2) var<storage, read> brick_slot: array<u32>;
@group(0) @binding(3) var<storage, read_write> cell_start: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read_write> cell_of: array<u32>;
@group(0) @binding(5) var<storage, read_write> slot_in_cell: array<u32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i >= params.particle_count {
        return;
    }
    let cell = cell_of_place(three(position[i]) * params.inverse_cell_size);
    let element = brick_slot[table_index(cell)] * CELLS + local_index(cell & vec3u(7u));
    cell_of[i] = element;
    slot_in_cell[i] = atomicAdd(&cell_start[element], 1u);
}
