// Contributions of each cell's particles to the density at the 3 x 3 x 3 cell centres around it, in
// particles. For a density correction, water continues behind a wall as its mirror image: a hat
// function cut by a wall sees fewer of the particles that keep off the wall, and the correction
// would thin the water. PBF's projection does not mirror: it only needs to know which cells are
// water, and with images a film of one particle on the floor would count, which splashes up where
// it runs into an obstacle.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/bricks.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_axis.wgsl"

@group(0) @binding(1) var<storage, read> bricks: array<Brick>;
@group(0) @binding(2) var<storage, read> cell_start: array<u32>;
@group(0) @binding(3) var<storage, read> sorted_position: array<Vector>;
// Sums for the nine centres in the layer before the cell, in its own layer, and in the layer after
// it. The arrays are free again, since the faces have been gathered.
@group(0) @binding(4) var<storage, read_write> weight_before: array<f32>;
@group(0) @binding(5) var<storage, read_write> weight_after: array<f32>;
@group(0) @binding(6) var<storage, read_write> momentum_before: array<f32>;

fn store(plane: u32, element: u32, before: vec3f, own: vec3f, after: vec3f) {
    let first = plane * params.partial_stride + element;
    for (var k = 0u; k < 3u; k++) {
        weight_before[first + k * params.partial_stride] = before[k];
        weight_after[first + k * params.partial_stride] = own[k];
        momentum_before[first + k * params.partial_stride] = after[k];
    }
}

#ifdef CORRECTION
fn hat(t: vec3f) -> vec3f {
    return max(1.0 - abs(t), vec3f(0.0));
}

// Hat functions as in center_weights, plus those of the position's mirror images at the walls `low`
// and `high` if a centre lies inside the box.
fn mirrored_weights(f: f32, low: f32, high: f32) -> vec3f {
    let centers = vec3f(-0.5, 0.5, 1.5);
    let images = hat(2.0 * low - f - centers) + hat(2.0 * high - f - centers);
    let is_open = (centers >= vec3f(low)) & (centers <= vec3f(high));
    return center_weights(f) + select(vec3f(0.0), images, is_open);
}
#else
fn mirrored_weights(f: f32, low: f32, high: f32) -> vec3f {
    return center_weights(f);
}
#endif

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    let element = thread + CELLS;
    // Bricks with particles come first, and others have no sums.
    if thread >= params.wet_cells || element >= params.partial_stride {
        return;
    }
    let slot = element / CELLS;
    let brick = vec3u(
        bricks[slot].coordinate[0], bricks[slot].coordinate[1], bricks[slot].coordinate[2]);
    let corner = vec3f(8u * brick + local_cell(element % CELLS));
    let scale = params.inverse_cell_size;
    let low = params.cut_min - corner;
    let high = params.cut_max - corner;
    let first = cell_start[element];
    let end = cell_start[element + 1u];
    var before = mat3x3f();
    var own = mat3x3f();
    var after = mat3x3f();
    for (var i = first; i < end; i++) {
        let f = three(sorted_position[i]) * scale - corner;
        let layer = outer(
            mirrored_weights(f.x, low.x, high.x), mirrored_weights(f.y, low.y, high.y));
        let z = mirrored_weights(f.z, low.z, high.z);
        before += layer * z.x;
        own += layer * z.y;
        after += layer * z.z;
    }
    store(0u, element, before[0], own[0], after[0]);
    store(3u, element, before[1], own[1], after[1]);
    store(6u, element, before[2], own[2], after[2]);
}
