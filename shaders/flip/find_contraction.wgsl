// Water that strains contracts when its particles go straight on (shared/flip_minors.wgsl). The
// projection makes up for it with ∇·u = −Δt m. The velocities are the particles' before forces,
// which no pressure has balanced yet. A current adds nothing: ∇u moves with the water.
#import "shared/thread.wgsl"
#import "shared/flip_minors.wgsl"

@group(0) @binding(2) var<storage, read> density: array<f32>;
// Holds the velocity before forces here.
@group(0) @binding(4) var<storage, read> face_change: array<f32>;
@group(0) @binding(7) var<storage, read> face_open: array<f32>;
@group(0) @binding(6) var<storage, read> cell_kind: array<u32>;
// With CONTRACTION the contraction alone follows, which is no work by boundaries.
@group(0) @binding(5) var<storage, read_write> solid_flux: array<f32>;

const FLUID = 1u;

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
    let cell = vec3f(own_cell(element));
    let is_counted = cell_kind[element] == FLUID && is_whole(element, cell);
    var flux = 0.0;
    for (var once = 0; once < select(0, 1, is_counted); once++) {
        look_around_cell(element, cell);
        let lost = contraction();
        flux = straight_part(lost) * lost * params.cell_size / params.time_step;
    }
    solid_flux[element] -= flux;
#ifdef CONTRACTION
    solid_flux[params.stride + element] = -flux;
#endif
}
