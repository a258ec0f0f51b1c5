// Particle-to-grid transfer, first half: contributions of each cell's particles to the 2 x 3 x 3
// faces around it. Every particle is read once; flip/gather_faces sums up the contributions of a
// face (Zhu and Bridson 2005; APIC: Jiang et al. 2015).
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/bricks.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_axis.wgsl"
#import "shared/finite.wgsl"
#import "shared/counters.wgsl"

@group(0) @binding(1) var<storage, read> bricks: array<Brick>;
@group(0) @binding(2) var<storage, read> cell_start: array<u32>;
@group(0) @binding(3) var<storage, read> sorted_position: array<Vector>;
// Three floats per particle.
@group(0) @binding(4) var<storage, read> sorted_velocity: array<f32>;
// Sums for the nine faces before the cell, and for those after it.
@group(0) @binding(5) var<storage, read_write> momentum_before: array<f32>;
@group(0) @binding(10) var<storage, read_write> momentum_after: array<f32>;
@group(0) @binding(6) var<storage, read_write> weight_before: array<f32>;
@group(0) @binding(11) var<storage, read_write> weight_after: array<f32>;
#ifdef APIC
@group(0) @binding(9) var<storage, read> sorted_affine: array<f32>;
#endif
// Counts non-finite values, which the comparison of a weight would hide.
@group(0) @binding(12) var<storage, read_write> counters: Counters;

fn store_before(plane: u32, element: u32, momentum: vec3f, weight: vec3f) {
    let first = plane * params.partial_stride + element;
    for (var k = 0u; k < 3u; k++) {
        momentum_before[first + k * params.partial_stride] = momentum[k];
        weight_before[first + k * params.partial_stride] = weight[k];
    }
}

fn store_after(plane: u32, element: u32, momentum: vec3f, weight: vec3f) {
    let first = plane * params.partial_stride + element;
    for (var k = 0u; k < 3u; k++) {
        momentum_after[first + k * params.partial_stride] = momentum[k];
        weight_after[first + k * params.partial_stride] = weight[k];
    }
}

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
    let component = axis.x;
    let first = cell_start[element];
    let end = cell_start[element + 1u];
    var lower_momentum = mat3x3f();
    var upper_momentum = mat3x3f();
    var lower_weight = mat3x3f();
    var upper_weight = mat3x3f();
    for (var i = first; i < end; i++) {
        let f = turned(three(sorted_position[i]) * scale - corner);
        let v = sorted_velocity[3u * i + component];
        let a = face_weights(f.x);
        let b = center_weights(f.y);
        let c = center_weights(f.z);
        let both = outer(b, c);
        lower_weight += both * a.x;
        upper_weight += both * a.y;
#ifdef APIC
        let row = 9u * i + 3u * component;
        let slope = turned(
            vec3f(sorted_affine[row], sorted_affine[row + 1u], sorted_affine[row + 2u]))
            * params.cell_size;
        let to_centers = vec3f(-0.5, 0.5, 1.5);
        let sloped = outer(b * (to_centers - f.y), c) * slope.y
            + outer(b, c * (to_centers - f.z)) * slope.z;
        lower_momentum += (both * (v - slope.x * f.x) + sloped) * a.x;
        upper_momentum += (both * (v + slope.x * (1.0 - f.x)) + sloped) * a.y;
#else
        lower_momentum += both * (a.x * v);
        upper_momentum += both * (a.y * v);
#endif
    }
    let sums = (lower_momentum + upper_momentum) + (lower_weight + upper_weight);
    if !is_finite(sums[0] + sums[1] + sums[2]) {
        atomicAdd(&counters.not_finite, 1u);
    }
    store_before(0u, element, lower_momentum[0], lower_weight[0]);
    store_before(3u, element, lower_momentum[1], lower_weight[1]);
    store_before(6u, element, lower_momentum[2], lower_weight[2]);
    store_after(0u, element, upper_momentum[0], upper_weight[0]);
    store_after(3u, element, upper_momentum[1], upper_weight[1]);
    store_after(6u, element, upper_momentum[2], upper_weight[2]);
}
