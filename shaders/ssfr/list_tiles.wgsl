// Lists the tiles of a part of the frame that have water, one tile per thread; with SOLIDS also
// those of the others that have opaque geometry; with SPRAY those that have spray instead.
#import "shared/camera.wgsl"
#import "shared/thread.wgsl"
#import "shared/ssfr_tiles.wgsl"

struct TileGrid {
    // First pixel of the part, and its size in pixels.
    corner: vec2u,
    size: vec2u,
    // Size of a tile in pixels.
    tile: vec2u,
    // Size of the frame in pixels.
    frame: vec2u,
}

@group(0) @binding(0) var<uniform> grid: TileGrid;
#ifdef SPRAY
@group(0) @binding(1) var<storage, read> source: array<u32>;
#else
@group(0) @binding(1) var<storage, read> source: array<f32>;
#endif
@group(0) @binding(2) var<storage, read_write> tiles: array<atomic<u32>>;
#ifdef SOLIDS
@group(0) @binding(3) var<storage, read> solid_depth: array<f32>;
#endif

// Whether there is any in the pixels from `first` up to but excluding `after`.
#ifdef SPRAY
fn is_there(first: vec2u, after: vec2u) -> bool {
    // Pixels interpolate between cells of twice their size, including those around the tile.
    let low = (max(first, vec2u(2u)) - 2u) / 2u;
    let high = min(after / 2u + 1u, (grid.frame / 2u));
    var all = 0u;
    for (var y = low.y; y < high.y; y++) {
        for (var x = low.x; x < high.x; x++) {
            all |= source[y * (grid.frame.x / 2u) + x];
        }
    }
    return all > 0u;
}
#else
fn is_there(first: vec2u, after: vec2u) -> bool {
    var nearest = FAR;
    for (var y = first.y; y < after.y; y++) {
        for (var x = first.x; x < after.x; x++) {
            nearest = min(nearest, source[y * grid.frame.x + x]);
        }
    }
    return nearest < FAR;
}
#endif

#ifdef SOLIDS
fn has_solids(first: vec2u, after: vec2u) -> bool {
    var solid = FAR;
    for (var y = first.y; y < after.y; y++) {
        for (var x = first.x; x < after.x; x++) {
            solid = min(solid, solid_depth[y * grid.frame.x + x]);
        }
    }
    return solid < FAR;
}
#endif

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let at = thread_index(group, groups, thread, 64u);
    let count = (grid.size + grid.tile - 1u) / grid.tile;
    if at >= count.x * count.y {
        return;
    }
    let tile = vec2u(at % count.x, at / count.x);
    let first = tile * grid.tile;
    let after = min(first + grid.tile, grid.size);
    let word = tile.x | (tile.y << 16u);
    var kind = BARE_TILES;
    if is_there(grid.corner + first, grid.corner + after) {
        kind = WET;
    }
#ifdef SOLIDS
    else if has_solids(grid.corner + first, grid.corner + after) {
        kind = SET_ALONE;
    }
#endif
    // The order is arbitrary: passes over the list treat pixels independently.
    let place = atomicAdd(&tiles[kind], 1u);
    atomicStore(&tiles[FIRST_TILE + kind * count.x * count.y + place], word);
}
