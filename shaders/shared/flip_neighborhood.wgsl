// A cell's 3³ neighbourhood by the links of its brick.
#import "shared/flip_element.wgsl"
#import "shared/flip_cell.wgsl"

fn open_neighborhood(element: u32) {
    let slot = element / CELLS;
    own_local = vec3i(local_cell(element % CELLS));
    let side = select(vec3u(2u), vec3u(0u), own_local < vec3i(4)) * vec3u(1u, 3u, 9u);
    slots_near = vec4u(
        slot,
        bricks[slot].neighbors[side.x + 12u],
        bricks[slot].neighbors[side.y + 10u],
        bricks[slot].neighbors[side.x + side.y + 9u],
    );
    slots_far = vec4u(
        bricks[slot].neighbors[side.z + 4u],
        bricks[slot].neighbors[side.x + side.z + 3u],
        bricks[slot].neighbors[side.y + side.z + 1u],
        bricks[slot].neighbors[side.x + side.y + side.z],
    );
}
