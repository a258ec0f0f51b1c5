// Lists of a picture's tiles: with water, with solids only, and all others. Adapters that execute
// both sides of a branch would spend the cost of water on every pixel; a pass over a list only
// processes its tiles.
//
// Layout in words: the number of tiles of each list, then space for all tiles three times, each
// with its column in the lower 16 bits and its row in the upper ones. The first list begins at
// FIRST_TILE.
const WET: u32 = 0u;
const SET_ALONE: u32 = 1u;
const BARE_TILES: u32 = 2u;
const LISTS: u32 = 3u;
const FIRST_TILE: u32 = LISTS;

// Pixels of a tile of the picture, one thread of a workgroup each; and cells of a tile of the flow,
// two by two per thread.
const TILE: vec2u = vec2u(16u, 4u);
const FLOW_TILE: vec2u = vec2u(32u, 8u);

fn column_and_row(word: u32) -> vec2u {
    return vec2u(word & 0xffffu, word >> 16u);
}

// Pixel of a thread in a tile, relative to the picture's origin in the frame. Tiles begin at
// multiples of their size in the frame, so that neither a crop nor a band moves a pixel to another
// list; pixels before the picture wrap beyond it.
fn pixel_of_tile(word: u32, thread: vec3u, picture: vec2u) -> vec2u {
    return column_and_row(word) * TILE + thread.xy - (picture & (TILE - 1u));
}

// First of the flow's cells that a thread processes.
fn cells_of_tile(word: u32, thread: vec3u) -> vec2u {
    return column_and_row(word) * FLOW_TILE + 2u * thread.xy;
}
