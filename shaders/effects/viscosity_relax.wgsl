// One iteration of the viscous solve (M + κ K) u = M u*: second-order Richardson (Golub and Varga
// 1961) with a diagonal preconditioner and the coefficients of `domain::relaxation`. Velocities
// alternate between two arrays.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_neighborhood.wgsl"
#import "shared/unit.wgsl"
#import "shared/viscous_word.wgsl"

@group(0) @binding(2) var<storage, read> viscous_word: array<u32>;
@group(0) @binding(3) var<storage, read> viscous_start: array<f32>;
@group(0) @binding(4) var<storage, read> viscous_from: array<f32>;
@group(0) @binding(5) var<storage, read_write> viscous_to: array<f32>;
// Change of the previous iteration, m/s.
@group(0) @binding(6) var<storage, read_write> viscous_change: array<f32>;
// κ, gain, momentum.
@group(0) @binding(7) var<uniform> viscous_gain: vec4f;

fn velocity(axis: u32, element: u32) -> f32 {
    return viscous_from[axis * params.stride + element];
}

// Contribution to K u and to K's diagonal by the edge along `along` through the minimum corner of
// the cell at `offset`, for the face on its upper side along `other`.
fn stress(offset: vec3i, axis: u32, other: u32, along: u32) -> vec2f {
    let element = element_at(offset);
    let edge = edge_of(viscous_word[element], along);
    let weight = select(edge.weight.yx, edge.weight, axis == (along + 1u) % 3u);
    let own = velocity(axis, element) - velocity(axis, element_at(offset - unit(other)));
    let across = velocity(other, element) - velocity(other, element_at(offset - unit(axis)));
    let share = edge.part * weight.x;
    return vec2f(share * (weight.x * own + weight.y * across), share * weight.x);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.active_cells {
        return;
    }
    let element = thread + CELLS;
    let word = viscous_word[element];
    for (var axis = 0u; axis < 3u; axis++) {
        let face = axis * params.stride + element;
        viscous_to[face] = viscous_from[face];
    }
    let moves_any = ((word >> MOVED) & 7u) != 0u;
    // Clears leftovers of an earlier substep in cells where nothing moves.
    for (var axis = 0u; axis < select(3u, 0u, moves_any); axis++) {
        viscous_change[axis * params.stride + element] = 0.0;
    }
    for (var once = 0; once < select(0, 1, moves_any); once++) {
        open_neighborhood(element);
        for (var axis = 0u; axis < 3u; axis++) {
            let face = axis * params.stride + element;
            let own = viscous_from[face];
            let before = element_at(-unit(axis));
            let water = 2.0 * vec2f(f32(viscous_word[before] & WATER), f32(word & WATER));
            let stretch = vec2f(
                own - velocity(axis, before), own - velocity(axis, element_at(unit(axis))));
            var sum = vec2f(dot(water, stretch), water.x + water.y);
            for (var turn = 1u; turn < 3u; turn++) {
                let other = (axis + turn) % 3u;
                let along = 3u - axis - other;
                let lower = stress(vec3i(0), axis, other, along);
                let upper = stress(unit(other), axis, other, along);
                sum += vec2f(lower.x - upper.x, lower.y + upper.y);
            }
            let mass = select(0.5, 1.0, ((word >> (WHOLE + axis)) & 1u) == 1u);
            let diagonal = mass + viscous_gain.x * sum.y;
            let residual = (mass * (viscous_start[face] - own) - viscous_gain.x * sum.x) / diagonal;
            let kept = select(viscous_gain.z * viscous_change[face], 0.0, viscous_gain.z == 0.0);
            let change = kept + viscous_gain.y * residual;
            let moves = ((word >> (MOVED + axis)) & 1u) == 1u;
            viscous_change[face] = select(0.0, change, moves);
            viscous_to[face] = select(own, own + change, moves);
        }
    }
}
