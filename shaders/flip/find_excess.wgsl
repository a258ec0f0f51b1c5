// Excess of density, or deficit inside the water, as a fraction of a cell: the source of the
// density correction (Kugelstadt et al. 2019).
#import "shared/thread.wgsl"
#import "shared/flip_neighborhood.wgsl"
#import "shared/flip_buried.wgsl"

@group(0) @binding(2) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(3) var<storage, read> density: array<f32>;
@group(0) @binding(4) var<storage, read_write> density_excess: array<f32>;

const AIR = 0u;
const FLUID = 1u;

// Bound on the excess that a substep corrects, in both directions: it keeps displacements well
// below a cell.
const MOST_EXCESS = 0.5;

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
    let own = vec3f(own_cell(element));
    let is_water = cell_kind[element] == FLUID;
    var touches_air = false;
    for (var once = 0; once < select(0, 1, is_water); once++) {
        open_neighborhood(element);
        for (var k = 0; k < 27; k++) {
            let offset = vec3i(k % 3, k / 3 % 3, k / 9) - 1;
            let found = element_at(offset);
            // Beyond the domain there is neither a cell nor air. A gap filled by close_gaps still
            // counts as air.
            let is_air = cell_kind[found] == AIR
                || (density[found] < 0.5 && !is_buried(found, own + vec3f(offset)));
            touches_air |= is_air && found >= CELLS;
        }
    }
#ifdef SOLIDS
    let volume = open_volume[element];
#else
    let extent = open_extent(own);
    let volume = extent.x * extent.y * extent.z;
#endif
    let least = select(-MOST_EXCESS, 0.0, touches_air);
    let excess = clamp(density[element] - 1.0, least, MOST_EXCESS);
    density_excess[element] = select(0.0, excess * volume, is_water);
}
