// Sum m of the second minors ∂_i u_i ∂_j u_j − ∂_i u_j ∂_j u_i of the velocity's gradient ∇u in a
// cell: straight paths x + Δt u multiply volumes by 1 + Δt ∇·u + Δt² m + …. The shader that imports
// this defines `at_face`, the velocity on a face.
//
// m is a divergence, and so is this sum on the staggered grid, with products of slopes in the
// middle of cells and of those at edges: over water without a border it is 0, whatever the noise.
// Cells that walls or solids cut have none, because their closed faces do not have the velocity of
// the water that slides along them.
#import "shared/flip_neighborhood.wgsl"
#import "shared/flip_buried.wgsl"

// Walls and solids cut a cell that they leave less of.
const WHOLE = 0.999;

fn unit(axis: u32) -> vec3i {
    return select(vec3i(0), vec3i(1), vec3u(axis) == vec3u(0u, 1u, 2u));
}

// Whether a cell is full of water that nothing cuts.
fn is_whole(element: u32, cell: vec3f) -> bool {
#ifdef SOLIDS
    let volume = open_volume[element];
#else
    let extent = open_extent(cell);
    let volume = extent.x * extent.y * extent.z;
#endif
    return density[element] >= 0.5 && volume >= WHOLE;
}

// Whether the cells before and after along each axis are whole, and whether the faces to them are
// closed.
var<private> is_low: vec3<bool>;
var<private> is_high: vec3<bool>;
var<private> is_low_shut: vec3<bool>;
var<private> is_high_shut: vec3<bool>;

// Index of the lower face of the cell at `offset`.
fn face_at(component: u32, offset: vec3i) -> u32 {
    return component * params.stride + element_at(offset);
}

// Slope of a component across `axis`, per cell, between its face at `offset` and the one at `to`.
fn slope(component: u32, offset: vec3i, to: vec3i) -> f32 {
    return at_face(face_at(component, offset + to)) - at_face(face_at(component, offset));
}

// Slope of each component along its own axis, per cell. Of a closed face the particles near it only
// know the side that they are on: there the slope follows from the other two.
fn slopes_along() -> vec3f {
    var along = vec3f(0.0);
    for (var a = 0u; a < 3u; a++) {
        along[a] = slope(a, vec3i(0), unit(a));
    }
    let is_shut = is_low_shut | is_high_shut;
    let is_alone = u32(is_shut.x) + u32(is_shut.y) + u32(is_shut.z) == 1u;
    return select(along, -(along.yzx + along.zxy), is_shut & vec3<bool>(is_alone));
}

// Mean over the cell's edges across two axes of the product of the slopes there. On closed faces it
// is 0, because water that slides along them has the same velocity into them everywhere; of the
// others only those count whose other cells along the axes are whole.
fn product_at_edges(a: u32, b: u32) -> f32 {
    var sum = 0.0;
    var count = 0u;
    for (var k = 0u; k < 4u; k++) {
        let is_far_a = (k & 1u) != 0u;
        let is_far_b = (k & 2u) != 0u;
        let is_shut = select(is_low_shut[a], is_high_shut[a], is_far_a)
            || select(is_low_shut[b], is_high_shut[b], is_far_b);
        let is_inner = !is_shut && select(is_low[a], is_high[a], is_far_a)
            && select(is_low[b], is_high[b], is_far_b);
        let to_a = select(-unit(a), unit(a), is_far_a);
        let to_b = select(-unit(b), unit(b), is_far_b);
        let across_b = slope(a, max(to_a, vec3i(0)), to_b);
        let across_a = slope(b, max(to_b, vec3i(0)), to_a);
        sum += select(0.0, select(-1.0, 1.0, is_far_a == is_far_b) * across_a * across_b, is_inner);
        count += u32(is_inner || is_shut);
    }
    return sum / f32(max(count, 1u));
}

// Sum of the second minors of the velocity's gradient, over the square of a cell, (m/s)².
fn sum_of_minors() -> f32 {
    let along = slopes_along();
    var sum = 0.0;
    for (var a = 0u; a < 3u; a++) {
        let b = (a + 1u) % 3u;
        sum += along[a] * along[b] - product_at_edges(a, b);
    }
    return sum;
}

// Looks around a cell of water, `cell` from the domain's corner, before `sum_of_minors`.
fn look_around_cell(element: u32, cell: vec3f) {
    open_neighborhood(element);
    for (var axis = 0u; axis < 3u; axis++) {
        let step = unit(axis);
        is_low[axis] = is_whole(element_at(-step), cell - vec3f(step));
        is_high[axis] = is_whole(element_at(step), cell + vec3f(step));
        is_low_shut[axis] = face_open[face_at(axis, vec3i(0))] == 0.0;
        is_high_shut[axis] = face_open[face_at(axis, step)] == 0.0;
    }
}

// Contraction in a substep up to which paths are straight; from twice as much they are not.
const MOST = 0.01;

fn straight_part(contraction: f32) -> f32 {
    return clamp(2.0 - abs(contraction) / MOST, 0.0, 1.0);
}

// What straight paths contract by in a substep, as a part of the volume.
fn contraction() -> f32 {
    let rate = params.time_step * params.inverse_cell_size;
    return -rate * rate * sum_of_minors();
}
