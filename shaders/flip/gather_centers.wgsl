// Relative density at cell centres, 1 in still water, 0.5 on its surface: sums the contributions of
// the cells around. With a density correction particles are mirrored at walls. The volume of solids
// is excluded, and that of walls where nothing is mirrored.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_neighborhood.wgsl"

// Partial sums, stored as in flip/spread_centers.
@group(0) @binding(2) var<storage, read> weight_before: array<f32>;
@group(0) @binding(4) var<storage, read> weight_after: array<f32>;
@group(0) @binding(5) var<storage, read> momentum_before: array<f32>;
@group(0) @binding(3) var<storage, read_write> density: array<f32>;
#ifdef SOLIDS
@group(0) @binding(9) var<storage, read> open_hats: array<f32>;
#endif
#ifdef BAND
@group(0) @binding(6) var<storage, read> deep_depth: array<f32>;

// As in domain/band.rs.
const SEAM = 2.0;
#endif

// Integral of the hat function from minus infinity to t.
fn hat_below(t: vec3f) -> vec3f {
    let s = 1.0 - min(abs(t), vec3f(1.0));
    return select(1.0 - 0.5 * s * s, 0.5 * s * s, t < vec3f(0.0));
}

// Lower bound for a cell's open fraction of the hat function.
const LEAST_ROOM = 0.02;

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
    let wet_end = min(params.wet_cells + CELLS, params.partial_stride);
    let last_wet = wet_end / CELLS - 1u;
    let holds_water = (slots_near - 1u < vec4u(last_wet)) | (slots_far - 1u < vec4u(last_wet));
    var sum = 0.0;
    // Layer by layer: cells in the layer before contribute by their sums for the layer after
    // theirs.
    for (var k = 0; k < select(0, 9, any(holds_water)); k++) {
        let found = element_at(vec3i(k % 3, k / 3, 0) - 1);
        sum += momentum_before[u32(8 - k) * stride + select(0u, found, found < wet_end)];
    }
    for (var k = 0; k < select(0, 9, any(holds_water)); k++) {
        let found = element_at(vec3i(k % 3, k / 3, 1) - 1);
        sum += weight_after[u32(8 - k) * stride + select(0u, found, found < wet_end)];
    }
    for (var k = 0; k < select(0, 9, any(holds_water)); k++) {
        let found = element_at(vec3i(k % 3, k / 3, 2) - 1);
        sum += weight_before[u32(8 - k) * stride + select(0u, found, found < wet_end)];
    }
    // The part of the hat function that walls leave open, exactly, times the part of it that solids
    // leave open.
    let center = vec3f(own_cell(element)) + 0.5;
    let along = hat_below(params.cut_max - center) - hat_below(params.cut_min - center);
#ifdef CORRECTION
    let is_open = (center >= params.cut_min) & (center <= params.cut_max);
    let parts = select(along, vec3f(1.0), is_open);
#else
    let parts = along;
#endif
    var room = max(parts.x * parts.y * parts.z, LEAST_ROOM);
#ifdef SOLIDS
    // A smaller open volume counts as that of one particle.
    room *= max(open_hats[element], params.particle_share);
#endif
    let relative = sum * params.particle_share / room;
#ifdef BAND
    // At the band's end and below it the water is full, whatever particles are in it: errors of
    // density there would be sources of volume in step with the waves above.
    density[element] = select(relative, 1.0, deep_depth[element] >= params.band - SEAM);
#else
    density[element] = relative;
#endif
}
