// Work by moving walls and solids on the water in a substep, over Δx² Δt, per workgroup: −p times
// the flux that they push through the closed parts of a cell's faces. It equals their contribution
// to the energy in the projection. The flux of closing gaps (flip/close_gaps) is not work.
#import "shared/thread.wgsl"
#import "shared/sum_of_group.wgsl"
#import "shared/flip_cell.wgsl"
#import "shared/flip_buried.wgsl"

@group(0) @binding(5) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(2) var<storage, read> solid_flux: array<f32>;
@group(0) @binding(3) var<storage, read> pressure: array<f32>;
@group(0) @binding(4) var<storage, read_write> boundary_work: array<f32>;
@group(0) @binding(6) var<storage, read> density: array<f32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    let is_inside = thread < params.wet_cells;
    let element = select(0u, thread + CELLS, is_inside);
    let is_thin = density[element] < 0.5 && !is_buried(element, vec3f(own_cell(element)));
    let is_water = cell_kind[element] == 1u && !is_thin;
    let work = select(0.0, -pressure[element] * solid_flux[element], is_water && is_inside);
    let sum = sum_of_group(local, work);
    if local == 0u && is_inside {
        boundary_work[thread / 64u] = sum;
    }
}
