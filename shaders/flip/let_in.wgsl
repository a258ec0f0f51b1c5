// Makes room for water that enters where water already is: the projection lets the excess of such
// cells flow out by the end of the frame. So entering water pushes the water in front of it, even
// where no surface is near.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_cell.wgsl"
#import "shared/flip_walls.wgsl"
#import "shared/inlets.wgsl"

@group(0) @binding(2) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(3) var<storage, read> density: array<f32>;
#ifdef CORRECTION
@group(0) @binding(4) var<storage, read_write> density_excess: array<f32>;
#endif
@group(0) @binding(5) var<storage, read_write> solid_flux: array<f32>;
#ifdef SOLIDS
@group(0) @binding(9) var<storage, read> open_volume: array<f32>;
#endif

const FLUID = 1u;

// Largest excess, in units of the cell's open volume: a flow into a full cell at most doubles its
// water.
const MOST_OVER = 1.0;

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
    let cell = own_cell(element);
    let rate = rate_in_inlet(cell);
    if cell_kind[element] != FLUID || rate == 0.0 {
        return;
    }
#ifdef SOLIDS
    let volume = open_volume[element];
#else
    let extent = open_extent(vec3f(cell));
    let volume = extent.x * extent.y * extent.z;
#endif
    let over = clamp(density[element] - 1.0, 0.0, MOST_OVER);
    solid_flux[element] -= over * volume * params.cell_size * rate;
#ifdef CORRECTION
    // The density correction would move the excess at once, without giving it a velocity.
    density_excess[element] = min(density_excess[element], 0.0);
#endif
}
