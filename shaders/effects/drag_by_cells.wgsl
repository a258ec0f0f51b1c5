// Air drag on flying water: it grows as the number of particles in the 27 cells around a particle's
// cell falls, walls and solids excluded. The transfer to the grid uses the resulting velocity.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_neighborhood.wgsl"
#import "shared/drag.wgsl"
#ifdef PERIODIC
#import "shared/flip_periodic.wgsl"
#endif

@group(0) @binding(2) var<storage, read> cell_start: array<u32>;
@group(0) @binding(3) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(4) var<storage, read_write> sorted_velocity: array<Vector>;

const SOLID = 2u;

// Water fraction around a particle of a cell: the other particles over what the open ones of the 27
// cells hold.
fn share_about(element: u32) -> f32 {
    open_neighborhood(element);
    let cell = vec3i(own_cell(element));
    let wet_end = params.wet_cells + CELLS;
    var particles = 0u;
    var open = 0u;
    for (var k = 0; k < 27; k++) {
        let step = vec3i(k % 3, k / 3 % 3, k / 9) - 1;
        let there = cell + step;
        var is_beyond = (there < vec3i(0)) | (there >= vec3i(params.cells));
#ifdef PERIODIC
        is_beyond &= !is_periodic();
#endif
        let other = element_at(step);
        let is_open = !any(is_beyond) && (other < CELLS || cell_kind[other] != SOLID);
        open += u32(is_open);
        if other < wet_end {
            particles += select(0u, cell_start[other + 1u] - cell_start[other], is_open);
        }
    }
    return (f32(max(particles, 1u)) - 1.0) * params.particle_share / f32(max(open, 1u));
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.wet_cells {
        return;
    }
    let element = thread + CELLS;
    let first = cell_start[element];
    let end = cell_start[element + 1u];
    var share = 0.0;
    // Only cells with particles enter the loop.
    for (var once = 0; once < select(0, 1, end > first); once++) {
        share = share_about(element);
    }
    for (var i = first; i < end; i++) {
        let before = three(sorted_velocity[i]);
        // The grid adds gravity later.
        let after = blown(before, params.velocity_step, share, params.kick) - params.velocity_step;
        sorted_velocity[i] = packed(select(before, after, is_exposed(share)));
    }
}
