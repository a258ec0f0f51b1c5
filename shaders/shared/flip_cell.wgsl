// Position of a cell.
#import "shared/bricks.wgsl"

@group(0) @binding(1) var<storage, read> bricks: array<Brick>;

// Cell coordinates from the domain's minimum corner.
fn own_cell(element: u32) -> vec3u {
    let slot = element / CELLS;
    let brick = vec3u(
        bricks[slot].coordinate[0], bricks[slot].coordinate[1], bricks[slot].coordinate[2]);
    return 8u * brick + local_cell(element % CELLS);
}
