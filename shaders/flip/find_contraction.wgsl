// Water that strains contracts when its particles go straight on (shared/flip_minors.wgsl). The
// projection makes up for it with ∇·u = −Δt m. The velocities are the particles' before forces,
// which no pressure has balanced yet. A current adds nothing: ∇u moves with the water.
#import "shared/thread.wgsl"
#import "shared/flip_contraction.wgsl"

@group(0) @binding(2) var<storage, read> density: array<f32>;
// Holds the velocity before forces here.
@group(0) @binding(4) var<storage, read> face_change: array<f32>;
@group(0) @binding(6) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(7) var<storage, read> face_open: array<f32>;
// The flux that makes up for contraction follows that of the solids.
@group(0) @binding(5) var<storage, read_write> solid_flux: array<f32>;
// Takes the strain's weight of the midpoint rule behind the table of slots.
@group(0) @binding(3) var<storage, read_write> brick_slot: array<u32>;

fn at_face(face: u32) -> f32 {
    return face_change[face];
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
    let is_full = is_full_of_water(element);
    let is_cut = !is_whole(element, vec3f(own_cell(element)));
    for (var once = 0; once < select(0, 1, is_full); once++) {
        open_neighborhood(element);
        find_bends();
        let is_due = is_cut || !is_straight() || is_bounded();
        for (var again = 0; again < select(0, 1, is_due); again++) {
            let part = part_of(sum_through_faces());
            solid_flux[params.stride + element] = part * params.cell_size / params.time_step;
        }
    }
    if local == 0u {
        let slot = element / CELLS;
        brick_slot[path_bend_at(slot)] = strain_bend[slot];
    }
}
