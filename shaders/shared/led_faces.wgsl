// A pass over the faces of cells. The importing pass defines `lead`, which updates a
// face; its position is in metres from the grid's minimum corner.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_cell.wgsl"

@group(0) @binding(3) var<storage, read> face_open: array<f32>;
@group(0) @binding(4) var<storage, read_write> face_velocity: array<f32>;
// At this point it still holds the velocities before gravity.
@group(0) @binding(5) var<storage, read> face_change: array<f32>;

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
    let corner = vec3f(own_cell(element));
    for (var component = 0u; component < 3u; component++) {
        var place = corner + 0.5;
        place[component] = corner[component];
        lead(component * params.stride + element, component, place * params.cell_size);
    }
}
