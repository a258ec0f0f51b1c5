// Lists of a picture's tiles: those in which there is water, those in which there are only solids, and the others. Adapters that run both
// sides of a branch would do for each pixel what water costs; a pass over one of the lists does it where there is some.
//
// Words: how many tiles each of the three has; then room for all tiles, thrice, each as its column in the lower 16 bits and its row in the
// upper ones. The first list stands at FIRST_TILE.
const WET: u32 = 0u;
const SET_ALONE: u32 = 1u;
const BARE_TILES: u32 = 2u;
const LISTS: u32 = 3u;
const FIRST_TILE: u32 = LISTS;

// Pixels of a tile of the picture, a thread each of a workgroup of the passes over lists; and cells of one of the flow, a thread for two
// by two.
const TILE: vec2u = vec2u(16u, 4u);
const FLOW_TILE: vec2u = vec2u(32u, 8u);

fn column_and_row(word: u32) -> vec2u {
    return vec2u(word & 0xffffu, word >> 16u);
}

// The pixel that a thread stands for in the tile of that word, counted from where a picture begins in the frame. Tiles begin at multiples of
// their size in the frame, so that neither a crop nor a band puts a pixel into the other list; pixels before the picture wrap beyond it.
fn pixel_of_tile(word: u32, thread: vec3u, picture: vec2u) -> vec2u {
    return column_and_row(word) * TILE + thread.xy - (picture & (TILE - 1u));
}

// The first of the flow's cells that a thread has.
fn cells_of_tile(word: u32, thread: vec3u) -> vec2u {
    return column_and_row(word) * FLOW_TILE + 2u * thread.xy;
}
