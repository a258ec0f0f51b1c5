// Cells whose centre lies inside a wall or solid.
#import "shared/flip_params.wgsl"
#import "shared/flip_walls.wgsl"

#ifdef SOLIDS
@group(0) @binding(9) var<storage, read> open_volume: array<f32>;
#endif

// A cell with a smaller open extent has its centre inside a wall or solid. A wall through the
// centre does not count.
const HALF = 0.5 - ON_FACE;

fn is_buried(element: u32, cell: vec3f) -> bool {
    let extent = open_extent(cell);
    var part = 1.0;
#ifdef SOLIDS
    part = open_volume[element] / max(extent.x * extent.y * extent.z, 1e-6);
#endif
    return any(extent < vec3f(HALF)) || part < HALF;
}
