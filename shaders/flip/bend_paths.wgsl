// Where paths are not straight: flip/find_contraction only knows the velocities of the substep
// before. Where the projected ones contract the water by much more or less than the projection has
// made up for, as where it lands, and in cells of which nothing is known, particles go by the
// midpoint rule.
#import "shared/thread.wgsl"
#import "shared/flip_minors.wgsl"

@group(0) @binding(2) var<storage, read> density: array<f32>;
@group(0) @binding(3) var<storage, read> face_velocity: array<f32>;
// Holds the velocity before forces here.
@group(0) @binding(4) var<storage, read> face_change: array<f32>;
@group(0) @binding(7) var<storage, read> face_open: array<f32>;
@group(0) @binding(6) var<storage, read> cell_kind: array<u32>;
// Part of the midpoint rule in the paths of a cell's particles.
@group(0) @binding(5) var<storage, read_write> path_bend: array<f32>;

const FLUID = 1u;

var<private> is_after: bool;

fn at_face(face: u32) -> f32 {
    return select(face_change[face], face_velocity[face], is_after);
}

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
    let cell = vec3f(own_cell(element));
    let is_counted = cell_kind[element] == FLUID && is_whole(element, cell);
    var bend = select(1.0, 0.0, is_counted);
    for (var once = 0; once < select(0, 1, is_counted); once++) {
        look_around_cell(element, cell);
        is_after = false;
        let before = contraction();
        is_after = true;
        let lost = contraction();
        bend = 1.0 - straight_part(lost - straight_part(before) * before);
    }
    path_bend[element] = bend;
}
