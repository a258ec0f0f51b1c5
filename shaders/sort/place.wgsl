// Places each element into its cell's range, in the order in which atomics assigned slots.
#import "shared/thread.wgsl"

@group(0) @binding(0) var<storage, read> cell_of: array<u32>;
@group(0) @binding(1) var<storage, read> slot_in_cell: array<u32>;
@group(0) @binding(2) var<storage, read> cell_start: array<u32>;
@group(0) @binding(3) var<storage, read_write> placed: array<u32>;
@group(0) @binding(4) var<uniform> element_count: vec4u;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i < element_count.x {
        placed[cell_start[cell_of[i]] + slot_in_cell[i]] = i;
    }
}
