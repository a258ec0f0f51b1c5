// Computes the workgroup counts of indirect dispatches over lists of tiles, one per list.
#import "shared/ssfr_tiles.wgsl"

@group(0) @binding(0) var<storage, read> tiles: array<u32>;
@group(0) @binding(1) var<storage, read_write> tile_groups: array<vec4u>;

// Largest number of workgroups along an axis that every adapter allows.
const MOST_GROUPS: u32 = 65535u;

@compute @workgroup_size(64)
fn main(@builtin(local_invocation_index) which: u32) {
    if which >= LISTS {
        return;
    }
    let count = tiles[which];
    let rows = (count + MOST_GROUPS - 1u) / MOST_GROUPS;
    tile_groups[which] = vec4u((count + max(rows, 1u) - 1u) / max(rows, 1u), rows, 1u, 0u);
}
