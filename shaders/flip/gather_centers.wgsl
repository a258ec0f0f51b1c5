// The water's density at cell centres over what a full cell has there, the solids' part left out of it: 1 at rest,
// from what the cells about it gave. What follows from it: the excess that the density correction (Kugelstadt et
// al. 2019) takes away, and the distance of the surface.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_neighborhood.wgsl"
#import "shared/flip_walls.wgsl"

@group(0) @binding(2) var<storage, read> partial_weight: array<f32>;
@group(0) @binding(3) var<storage, read> cell_kind: array<u32>;
// 0 where there is no water.
@group(0) @binding(4) var<storage, read_write> density: array<f32>;
#ifdef CORRECTION
@group(0) @binding(5) var<storage, read_write> density_excess: array<f32>;
#endif
#ifdef GHOST_FLUID
@group(0) @binding(6) var<storage, read_write> liquid_distance: array<f32>;
#endif
#ifdef SOLIDS
@group(0) @binding(9) var<storage, read> open_volume: array<f32>;
#endif

// Of a cell's excess a substep corrects at most this much either way: displacements stay well below a cell.
const MOST_EXCESS = 0.5;

// Integral of the hat from minus infinity to t.
fn hat_below(t: vec3f) -> vec3f {
    let s = 1.0 - min(abs(t), vec3f(1.0));
    return select(1.0 - 0.5 * s * s, 0.5 * s * s, t < vec3f(0.0));
}

// Mean of a hat over the cell of its centre, and over the ones beside it.
const OWN_SHARE = 0.75;
const OTHER_SHARE = 0.125;

// A surface cell of water has its surface at least so far outside of its centre, in cells, and one of air inside.
const LEAST_DISTANCE = 0.05;

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
    open_neighborhood(element);
    let stride = params.partial_stride;
    let wet_end = params.wet_cells + CELLS;
    let last_wet = params.wet_cells / CELLS;
    let holds_water = (slots_near - 1u < vec4u(last_wet)) | (slots_far - 1u < vec4u(last_wet));
    var sum = 0.0;
    var room = 0.0;
    var touches_air = false;
    for (var z = -1; z <= select(-2, 1, any(holds_water)); z++) {
        for (var y = -1; y <= 1; y++) {
            for (var x = -1; x <= 1; x++) {
                let found = element_at(vec3i(x, y, z));
                let source = select(0u, found, found < wet_end);
                let plane = u32(9 * (1 - z) + 3 * (1 - y) + 1 - x);
                sum += partial_weight[plane * stride + source];
#ifdef CORRECTION
                // Beyond the domain there is no cell and no air.
                touches_air |= cell_kind[found] == 0u && found >= CELLS;
#endif
#ifdef SOLIDS
                let share = select(vec3f(OTHER_SHARE), vec3f(OWN_SHARE), vec3i(x, y, z) == vec3i(0));
                room += share.x * share.y * share.z * open_volume[found];
#endif
            }
        }
    }
    // What the walls leave of the hats, exactly; meshes take their part of it cell by cell.
    let cell = vec3f(own_cell(element));
    let center = cell + 0.5;
    let along = hat_below(params.cut_max - center) - hat_below(params.cut_min - center);
    let of_walls = along.x * along.y * along.z;
    var volume = 0.0;
#ifdef SOLIDS
    let cells = OWN_SHARE * open_extent(cell) + OTHER_SHARE * (open_extent(cell - 1.0) + open_extent(cell + 1.0));
    room *= of_walls / max(cells.x * cells.y * cells.z, 1e-6);
    volume = open_volume[element];
#else
    room = of_walls;
    let extent = open_extent(cell);
    volume = extent.x * extent.y * extent.z;
#endif
    let is_water = cell_kind[element] == 1u;
    let relative = sum * params.particle_share / max(room, 0.02);
    density[element] = select(0.0, relative, is_water);
#ifdef CORRECTION
    let excess = clamp(relative - 1.0, select(-MOST_EXCESS, 0.0, touches_air), MOST_EXCESS);
    density_excess[element] = select(0.0, excess * volume, is_water);
#endif
#ifdef GHOST_FLUID
    // Across a flat surface the hats' sum is 1/2 at it and falls as s - s²/2 with the distance s in cells.
    let off = clamp(relative, 0.0, 1.0) - 0.5;
    let inside = sign(off) * (1.0 - sqrt(max(1.0 - 2.0 * abs(off), 0.0)));
    let kept = select(min(inside, -LEAST_DISTANCE), max(inside, LEAST_DISTANCE), is_water);
    liquid_distance[element] = -kept * params.cell_size;
#endif
}
