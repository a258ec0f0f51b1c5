// Where water strains so much that paths are not straight: straight ones would contract it by more
// than flip/find_contraction makes up for, which only knows the velocities before forces. Near
// there particles go by the midpoint rule.
#import "shared/thread.wgsl"
#import "shared/flip_minors.wgsl"
#import "shared/flip_spread_bend.wgsl"

@group(0) @binding(2) var<storage, read> density: array<f32>;
// Holds the velocity before forces here.
@group(0) @binding(4) var<storage, read> face_change: array<f32>;
@group(0) @binding(6) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(7) var<storage, read> face_open: array<f32>;
// The flux that makes up for contraction follows that of the solids: here as if all paths were
// straight, and nothing cut a cell.
@group(0) @binding(5) var<storage, read_write> solid_flux: array<f32>;
// Weight of the midpoint rule in bricks.
@group(0) @binding(12) var<storage, read_write> strain_bend: array<atomic<u32>>;

fn at_face(face: u32) -> f32 {
    return face_change[face];
}

fn raise(slot: u32, bits: u32) {
    atomicMax(&strain_bend[slot], bits);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    let is_inside = thread < params.active_cells;
    let element = select(0u, thread + CELLS, is_inside);
    let cell = vec3f(own_cell(element));
    let counts = is_inside && is_full_of_water(element) && is_whole(element, cell);
    var part = 0.0;
    for (var once = 0; once < select(0, 1, counts); once++) {
        open_neighborhood(element);
        part = part_of(sum_of_minors());
    }
    let bend = bend_of(part);
    if is_inside {
        solid_flux[params.stride + element] = part * params.cell_size / params.time_step;
    }
    spread_bend(bend, element, local);
}
