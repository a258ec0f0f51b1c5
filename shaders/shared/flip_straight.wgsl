// How straight paths are: linear between the middles of bricks. The shader that imports this
// defines `bend_in`, the weight of the midpoint rule in a slot.
#import "shared/flip_element.wgsl"
#import "shared/flip_params.wgsl"

// Where the weight of the midpoint rule in the paths of a slot is in `brick_slot`, as a float's
// bits: behind the table of slots.
fn path_bend_at(slot: u32) -> u32 {
    return params.table_dims.x * params.table_dims.y * params.table_dims.z + slot;
}

// Weights of the midpoint rule in the slots around a cell, and whether there are bricks.
var<private> bends_near: vec4f;
var<private> bends_far: vec4f;
var<private> present_near: vec4f;
var<private> present_far: vec4f;

// Looks up the slots' weights, once the slots are known.
fn find_bends() {
    bends_near = vec4f(
        bend_in(slots_near.x), bend_in(slots_near.y), bend_in(slots_near.z), bend_in(slots_near.w));
    bends_far = vec4f(
        bend_in(slots_far.x), bend_in(slots_far.y), bend_in(slots_far.z), bend_in(slots_far.w));
    present_near = select(vec4f(0.0), vec4f(1.0), slots_near > vec4u(0u));
    present_far = select(vec4f(0.0), vec4f(1.0), slots_far > vec4u(0u));
}

// Whether all paths in the cell are straight.
fn is_straight() -> bool {
    return dot(bends_near, present_near) + dot(bends_far, present_far) == 0.0;
}

// At a position in cells from the own brick's corner, on the own cell's side of the brick's middle.
// Absent bricks do not count.
fn straight_at(position: vec3f) -> f32 {
    let beside = abs(position - 4.0) / 8.0;
    let of_x = vec2f(1.0 - beside.x, beside.x);
    let in_plane = vec4f((1.0 - beside.y) * of_x, beside.y * of_x);
    let near = (1.0 - beside.z) * in_plane * present_near;
    let far = beside.z * in_plane * present_far;
    let sum = dot(near, bends_near) + dot(far, bends_far);
    return 1.0 - sum / max(dot(near + far, vec4f(1.0)), 1e-6);
}
