// Where paths are not straight: where the water strained before forces (flip/find_strain), and
// where the projected velocities contract it by much more or less than the projection has made up
// for, as where it lands.
#import "shared/thread.wgsl"
#import "shared/flip_contraction.wgsl"
#import "shared/flip_spread_bend.wgsl"

@group(0) @binding(2) var<storage, read> density: array<f32>;
@group(0) @binding(3) var<storage, read> face_velocity: array<f32>;
// The flux that makes up for contraction follows that of the solids.
@group(0) @binding(4) var<storage, read> solid_flux: array<f32>;
@group(0) @binding(6) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(7) var<storage, read> face_open: array<f32>;
// Behind the table of slots, the weight of the midpoint rule in them.
@group(0) @binding(5) var<storage, read_write> brick_slot: array<atomic<u32>>;

fn at_face(face: u32) -> f32 {
    return face_velocity[face];
}

fn raise(slot: u32, bits: u32) {
    atomicMax(&brick_slot[path_bend_at(slot)], bits);
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
    var bend = 0.0;
    for (var once = 0; once < select(0, 1, counts); once++) {
        open_neighborhood(element);
        find_bends();
        let flux = solid_flux[params.stride + element];
        let made_up = flux * params.time_step * params.inverse_cell_size;
        bend = bend_of(contraction_in(element, cell) - made_up);
    }
    spread_bend(bend, element, local);
}
