// How the pressure of each cell pushes a body: the area of its surface in the cell, as a vector and
// as a moment about the centre of mass (Batty et al. 2007). By symmetry the same six numbers times
// the body's velocity are its flux out of the cell.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_cell.wgsl"
#import "shared/flip_faces.wgsl"
#import "shared/bodies.wgsl"

@group(0) @binding(2) var<storage, read> body_pairs: array<BodyPair>;
@group(0) @binding(3) var<storage, read> body_states: DeviceBodies;
// For each pair six arrays of 512 cells: area over Δx², then moment over Δx², metres.
@group(0) @binding(4) var<storage, read_write> body_coupling: array<f32>;

// Area of the body in a face, over Δx²; 0 where another solid is nearer.
fn share(of_walls: vec3f, open: vec3f, nearest: vec3u, solid: u32) -> vec3f {
    return select(vec3f(0.0), of_walls - open, nearest == vec3u(solid));
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let pair = thread_index(workgroup, workgroups, 0u, 1u);
    if pair >= body_states.pairs {
        return;
    }
    let body = body_pairs[pair].body;
    let solid = body_states.first_solid + body;
    let centre = body_states.bodies[body].centre;
    for (var inner = local; inner < CELLS; inner += 64u) {
        let cell = vec3f(own_cell(CELLS * body_pairs[pair].slot + inner));
        let extent = open_extent(cell);
        let cut = cut_faces(cell, extent.yzx * extent.zxy);
        let low = share(cut.lower_of_walls, cut.lower, cut.lower_solid, solid);
        let high = share(cut.upper_of_walls, cut.upper, cut.upper_solid, solid);
        let area = high - low;
        // Moments of the faces' middles.
        let arm = (cell + 0.5) * params.cell_size - centre;
        let way = cross(arm, area);
        let first = 6u * CELLS * pair + inner;
        for (var k = 0u; k < 3u; k++) {
            body_coupling[first + CELLS * k] = area[k];
            body_coupling[first + CELLS * (k + 3u)] = way[k];
        }
    }
}
