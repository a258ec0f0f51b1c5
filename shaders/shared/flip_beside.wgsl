// The six face neighbours of a cell: along each axis at most one of them lies in another brick.
#import "shared/bricks.wgsl"

@group(0) @binding(1) var<storage, read> bricks: array<Brick>;

var<private> own_slot: u32;
var<private> own_local: vec3i;
// For each axis, the neighbouring brick on the side that the cell is closer to.
var<private> slots_beside: vec3u;

fn open_beside(element: u32) {
    own_slot = element / CELLS;
    own_local = vec3i(local_cell(element % CELLS));
    let side = select(vec3u(14u, 16u, 22u), vec3u(12u, 10u, 4u), own_local < vec3i(4));
    slots_beside = vec3u(
        bricks[own_slot].neighbors[side.x],
        bricks[own_slot].neighbors[side.y],
        bricks[own_slot].neighbors[side.z],
    );
}

// Element of the cell at `offset`, one step along one axis; in slot 0 if that brick is absent.
fn element_beside(offset: vec3i) -> u32 {
    let cell = own_local + offset;
    // -1 and 8 have bit 3 set, 0 to 7 do not.
    let is_beyond = (cell & vec3i(8)) != vec3i(0);
    let crossed = select(
        select(slots_beside.x, slots_beside.y, is_beyond.y), slots_beside.z, is_beyond.z);
    return select(own_slot, crossed, any(is_beyond)) * CELLS + local_index(vec3u(cell & vec3i(7)));
}
