// Which tiles of a part of the frame have water, a thread a tile.
#import "shared/camera.wgsl"
#import "shared/thread.wgsl"

struct TileGrid {
    // First pixel of the part, and its size in pixels.
    corner: vec2u,
    size: vec2u,
    // Pixels of a tile.
    tile: vec2u,
    // Pixels of a row of what they stand in.
    stride: u32,
    pad0: u32,
}

@group(0) @binding(0) var<uniform> grid: TileGrid;
@group(0) @binding(1) var<storage, read> source: array<f32>;
@group(0) @binding(2) var<storage, read_write> tiles: array<atomic<u32>>;

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
    var nearest = FAR;
    for (var y = first.y; y < after.y; y++) {
        for (var x = first.x; x < after.x; x++) {
            let pixel = grid.corner + vec2u(x, y);
            nearest = min(nearest, source[pixel.y * grid.stride + pixel.x]);
        }
    }
    let word = tile.x | (tile.y << 16u);
    // In any order: what a pass over the list does at a pixel has nothing to do with the others.
    if nearest < FAR {
        let place = atomicAdd(&tiles[0], 1u);
        atomicStore(&tiles[2u + place], word);
    } else {
        let place = atomicAdd(&tiles[1], 1u);
        atomicStore(&tiles[1u + count.x * count.y - place], word);
    }
}
