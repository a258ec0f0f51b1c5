// Sum m of the second minors ∂_i u_i ∂_j u_j − ∂_i u_j ∂_j u_i of the velocity's gradient ∇u in a
// cell: straight paths x + Δt u multiply volumes by 1 + Δt ∇·u + Δt² m + …. The shader that imports
// this defines `at_face`, the velocity on a face.
//
// m is a divergence, and so is this sum on the staggered grid, with products of slopes in the
// middle of cells and of those at edges: over water without a border it is 0, whatever the noise.
// It only has slopes, so that a current adds nothing. The faces through which it flows have
// ½ Σ_j (u_i ∂_j u_j − u_j ∂_j u_i); in cells that solids cut, and where paths are straight only in
// part, m is the sum of these, times the faces' open and straight parts: nothing flows into solids.
#import "shared/flip_neighborhood.wgsl"
#import "shared/flip_buried.wgsl"

// Walls and solids cut a cell that they leave less of.
const WHOLE = 0.999;
const FLUID = 1u;

fn unit(axis: u32) -> vec3i {
    return select(vec3i(0), vec3i(1), vec3u(axis) == vec3u(0u, 1u, 2u));
}

fn is_whole(element: u32, cell: vec3f) -> bool {
#ifdef SOLIDS
    let volume = open_volume[element];
#else
    let extent = open_extent(cell);
    let volume = extent.x * extent.y * extent.z;
#endif
    return volume >= WHOLE;
}

fn is_full_of_water(element: u32) -> bool {
    return cell_kind[element] == FLUID && density[element] >= 0.5;
}

fn is_full(offset: vec3i) -> bool {
    return is_full_of_water(element_at(offset));
}

// Whether any face of the cell is closed.
fn is_bounded() -> bool {
    var bounded = false;
    for (var a = 0u; a < 3u; a++) {
        bounded |= is_shut(a, vec3i(0)) || is_shut(a, unit(a));
    }
    return bounded;
}

// Index of the lower face of the cell at `offset`.
fn face_at(component: u32, offset: vec3i) -> u32 {
    return component * params.stride + element_at(offset);
}

fn component_at(component: u32, offset: vec3i) -> f32 {
    return at_face(face_at(component, offset));
}

fn is_shut(component: u32, offset: vec3i) -> bool {
    return face_open[face_at(component, offset)] == 0.0;
}

// Slope of each component along its own axis in a cell, per cell. Of a closed face the particles
// near it only know the side that they are on: there the slope follows from the other two.
fn slopes_along(offset: vec3i) -> vec3f {
    var along = vec3f(0.0);
    var is_closed = vec3<bool>(false);
    for (var a = 0u; a < 3u; a++) {
        let upper = offset + unit(a);
        along[a] = component_at(a, upper) - component_at(a, offset);
        is_closed[a] = is_shut(a, offset) || is_shut(a, upper);
    }
    let is_alone = u32(is_closed.x) + u32(is_closed.y) + u32(is_closed.z) == 1u;
    return select(along, -(along.yzx + along.zxy), is_closed & vec3<bool>(is_alone));
}

// Mean over the cell's edges across two axes of the product of the slopes there. On closed faces it
// is 0, because water that slides along them has the same velocity into them everywhere; of the
// others only those count whose other cells along the axes are full.
fn product_at_edges(a: u32, b: u32) -> f32 {
    var sum = 0.0;
    var count = 0u;
    for (var k = 0u; k < 4u; k++) {
        let is_far_a = (k & 1u) != 0u;
        let is_far_b = (k & 2u) != 0u;
        let to_a = select(-unit(a), unit(a), is_far_a);
        let to_b = select(-unit(b), unit(b), is_far_b);
        let face_a = max(to_a, vec3i(0));
        let face_b = max(to_b, vec3i(0));
        let is_closed = is_shut(a, face_a) || is_shut(b, face_b) || is_shut(a, face_a + to_b)
            || is_shut(b, face_b + to_a);
        let is_inner = !is_closed && is_full(to_a) && is_full(to_b);
        let across_b = component_at(a, face_a + to_b) - component_at(a, face_a);
        let across_a = component_at(b, face_b + to_a) - component_at(b, face_b);
        sum += select(0.0, select(-1.0, 1.0, is_far_a == is_far_b) * across_a * across_b, is_inner);
        count += u32(is_inner || is_closed);
    }
    return sum / f32(max(count, 1u));
}

// Sum of the second minors in a cell that nothing cuts, over the square of a cell, (m/s)².
fn sum_of_minors() -> f32 {
    let along = slopes_along(vec3i(0));
    var sum = 0.0;
    for (var a = 0u; a < 3u; a++) {
        let b = (a + 1u) % 3u;
        sum += along[a] * along[b] - product_at_edges(a, b);
    }
    return sum;
}

// At the edge between the lower face of `axis` of the cell at `at` and the one at `at + to`: the
// mean of a component times the slope there of the face's own component; and whether it counts.
fn carried_at_edge(axis: u32, component: u32, at: vec3i, to: vec3i) -> vec2f {
    let back = at - unit(axis);
    let edge = max(to, vec3i(0));
    let is_near = vec2<bool>(is_full(back + to), is_full(at + to));
    let is_known = is_near | vec2<bool>(is_full(back), is_full(at));
    let is_closed = is_shut(axis, at + to) || is_shut(component, at + edge)
        || is_shut(component, back + edge);
    let both = vec2f(component_at(component, back + edge), component_at(component, at + edge));
    let mean = dot(both, vec2f(is_known)) / max(f32(is_known.x) + f32(is_known.y), 1.0);
    let slope = component_at(axis, at + to) - component_at(axis, at);
    let counts = is_closed || any(is_near);
    let product = select(-1.0, 1.0, any(to > vec3i(0))) * mean * slope;
    return vec2f(select(0.0, product, counts && !is_closed), f32(counts));
}

// What flows through the lower face of `axis` of the cell at `at`, (m/s)². Its divergence is the
// sum of minors.
fn through_lower(axis: u32, at: vec3i) -> f32 {
    let back = at - unit(axis);
    let is_water = vec2f(vec2<bool>(is_full(back), is_full(at)));
    let both = is_water.x * slopes_along(back) + is_water.y * slopes_along(at);
    let slopes = both / max(is_water.x + is_water.y, 1.0);
    let own = component_at(axis, at);
    var sum = 0.0;
    for (var k = 1u; k < 3u; k++) {
        let component = (axis + k) % 3u;
        let edges = carried_at_edge(axis, component, at, -unit(component))
            + carried_at_edge(axis, component, at, unit(component));
        sum += own * slopes[component] - edges.x / max(edges.y, 1.0);
    }
    return select(0.5 * sum, 0.0, is_shut(axis, at));
}

// Contraction in a substep up to which paths are straight; from twice as much they are not.
const MOST = 0.05;

// Part of the midpoint rule in the paths of water of which a substep contracts an unknown part.
fn bend_of(part: f32) -> f32 {
    return clamp(abs(part) / MOST - 1.0, 0.0, 1.0);
}

// A contraction in a substep, as a part of the volume.
fn part_of(minors: f32) -> f32 {
    let rate = params.time_step * params.inverse_cell_size;
    return -rate * rate * minors;
}
