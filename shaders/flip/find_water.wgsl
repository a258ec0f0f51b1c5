// Which cells are water: those at whose centre the density is at least half of the water's, as at a surface that stands
// there; and how far the surface is. Whether a cell has particles does not count: a full one may have none for a moment, as
// beside a wall that comes or goes, and were it air, all of the water's pressure would leak there; and drops in the air
// have no pressure.
//
// A cell whose centre lies within a wall or a solid is what the water before it is. With a density correction a cell that a
// solid cuts is more than that where it holds more itself, and all of it where the solid reaches just to its centre: of water
// that runs up a slope the edge lies in such cells, and below the centres of those before them. Were it air, nothing would
// hold it up or apart, and it gathered there to five times what there was room for. PBF's projection goes without, as in
// flip/spread_centers.
#import "shared/thread.wgsl"
#import "shared/flip_neighborhood.wgsl"
#import "shared/flip_buried.wgsl"

@group(0) @binding(2) var<storage, read> density: array<f32>;
@group(0) @binding(3) var<storage, read> face_open: array<f32>;
@group(0) @binding(4) var<storage, read_write> cell_kind: array<u32>;
#ifdef GHOST_FLUID
// Metres, negative in water.
@group(0) @binding(5) var<storage, read_write> liquid_distance: array<f32>;
#endif

const AIR = 0u;
const FLUID = 1u;
const SOLID = 2u;

// Least distance of the surface from the centre of a cell of water, in cells. The pressure there is by it alone, and every
// way to the air from there has to know of the same one: with a least θ of each way in its place, water whose surface passes
// a centre was pushed sideways by up to half of gravity.
const LEAST_DEPTH = 0.02;

// Density before the walls and solids that a cell's centre lies in: in the cell inward of the walls, and where that is
// buried too, the mean over the faces that lead out of it, by how far they are open.
fn density_before(element: u32, cell: vec3f) -> f32 {
    let is_thin = open_extent(cell) < vec3f(HALF);
    let inward = select(vec3i(0), select(vec3i(-1), vec3i(1), !is_plane_open(cell)), is_thin);
    let there = element_at(inward);
    if any(is_thin) && !is_buried(there, cell + vec3f(inward)) {
        return density[there];
    }
    var sum = 0.0;
    var weights = 0.0;
    for (var k = 0u; k < 6u; k++) {
        let axis = k >> 1u;
        var step = vec3i(0);
        step[axis] = 2 * i32(k & 1u) - 1;
        let other = element_at(step);
        let open = face_open[axis * params.stride + select(element, other, (k & 1u) == 1u)];
        let weight = select(open, 0.0, other < CELLS || is_buried(other, cell + vec3f(step)));
        sum += weight * density[other];
        weights += weight;
    }
    return select(density[element], sum / weights, weights > 0.0);
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
    var relative = density[element];
    for (var once = 0; once < select(0, 1, is_buried(element, cell)); once++) {
        open_neighborhood(element);
        relative = density_before(element, cell);
#ifdef SOLIDS
#ifdef CORRECTION
        relative += min(2.0 * open_volume[element], 1.0) * max(density[element] - relative, 0.0);
#endif
#endif
    }
    // Water lies in bricks that hold particles, or a wall beside them.
    let is_water = relative >= 0.5 && thread < params.wet_cells;
    let is_open = cell_kind[element] != SOLID;
    cell_kind[element] = select(SOLID, select(AIR, FLUID, is_water), is_open);
#ifdef GHOST_FLUID
    // Across a flat surface the density is 1/2 at it, and falls as s - s²/2 with the distance s in cells.
    let off = clamp(relative, 0.0, 1.0) - 0.5;
    let inside = sign(off) * (1.0 - sqrt(max(1.0 - 2.0 * abs(off), 0.0)));
    let depth = select(inside, max(inside, LEAST_DEPTH), is_water);
    liquid_distance[element] = -depth * params.cell_size;
#endif
}
