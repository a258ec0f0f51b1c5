// Slots around a cell, looked up in the brick table: for positions that may lie outside bricks with
// water.
#import "shared/flip_element.wgsl"
#import "shared/flip_params.wgsl"
#ifdef PERIODIC
#import "shared/flip_periodic.wgsl"
#endif

@group(0) @binding(1) var<storage, read> brick_slot: array<u32>;

fn slot_at(brick: vec3i) -> u32 {
    let dims = vec3i(params.table_dims);
#ifdef PERIODIC
    let at = wrapped_cell(brick, dims);
#else
    let at = brick;
#endif
    let is_inside = all(at >= vec3i(0)) && all(at < dims);
    let kept = clamp(at, vec3i(0), dims - 1);
    return select(0u, brick_slot[(kept.z * dims.y + kept.y) * dims.x + kept.x], is_inside);
}

fn find_slots(cell: vec3i) {
    own_local = cell & vec3i(7);
    let brick = cell >> vec3u(3u);
    let side = brick + select(vec3i(1), vec3i(-1), own_local < vec3i(4));
    slots_near = vec4u(
        slot_at(brick),
        slot_at(vec3i(side.x, brick.yz)),
        slot_at(vec3i(brick.x, side.y, brick.z)),
        slot_at(vec3i(side.xy, brick.z)),
    );
    slots_far = vec4u(
        slot_at(vec3i(brick.xy, side.z)),
        slot_at(vec3i(side.x, brick.y, side.z)),
        slot_at(vec3i(brick.x, side.yz)),
        slot_at(side),
    );
}
