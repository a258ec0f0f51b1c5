// Sorts the members of each cell by id, which makes the order deterministic after the atomics.
#import "shared/thread.wgsl"

@group(0) @binding(0) var<storage, read> cell_of: array<u32>;
@group(0) @binding(1) var<storage, read> cell_start: array<u32>;
@group(0) @binding(2) var<storage, read> placed: array<u32>;
@group(0) @binding(3) var<storage, read> id: array<u32>;
@group(0) @binding(4) var<storage, read_write> order: array<u32>;
@group(0) @binding(5) var<uniform> element_count: vec4u;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i >= element_count.x {
        return;
    }
    let element = placed[i];
    let cell = cell_of[element];
    let first = cell_start[cell];
    let end = cell_start[cell + 1u];
    let own = id[element];
    var rank = 0u;
    for (var k = first; k < end; k++) {
        rank += u32(id[placed[k]] < own);
    }
    order[first + rank] = element;
}
