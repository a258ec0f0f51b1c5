// Particle-to-grid transfer, second half: computes a face's velocity from the contributions of the
// cells around it. The old velocity is stored; the new one includes gravity, and on a closed face
// it is that of the wall or solid.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_neighborhood.wgsl"
#import "shared/flip_axis.wgsl"
#import "shared/flip_walls.wgsl"

@group(0) @binding(2) var<storage, read> momentum_before: array<f32>;
@group(0) @binding(12) var<storage, read> momentum_after: array<f32>;
@group(0) @binding(3) var<storage, read> weight_before: array<f32>;
@group(0) @binding(13) var<storage, read> weight_after: array<f32>;
@group(0) @binding(4) var<storage, read> face_open: array<f32>;
@group(0) @binding(5) var<storage, read_write> face_velocity: array<f32>;
// Holds the old velocity here, and its change from flip/find_change on.
@group(0) @binding(6) var<storage, read_write> face_change: array<f32>;
// Eight bits per component: bit 7 is set if particles gave a velocity; the lower bits hold the
// layer, see flip/extrapolate.
@group(0) @binding(9) var<storage, read_write> face_layer: array<u32>;
#ifdef MOVING_SOLIDS
@group(0) @binding(10) var<storage, read> closed_velocity: array<f32>;
#endif

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
    open_neighborhood(element);
    let to_a = turned_back(vec3i(1, 0, 0));
    let to_b = turned_back(vec3i(0, 1, 0));
    let to_c = turned_back(vec3i(0, 0, 1));
    let stride = params.partial_stride;
    let wet_end = min(params.wet_cells + CELLS, params.partial_stride);
    let last_wet = wet_end / CELLS - 1u;
    let holds_water = (slots_near - 1u < vec4u(last_wet)) | (slots_far - 1u < vec4u(last_wet));
    var momentum = 0.0;
    var weight = 0.0;
    // A loop that no lane enters costs nothing, unlike a branch: it skips cells of dry bricks far
    // from water.
    for (var c = -1; c <= select(-2, 1, any(holds_water)); c++) {
        for (var b = -1; b <= 1; b++) {
            // Partial sums of slot 0 stay zero.
            let own = element_at(b * to_b + c * to_c);
            let before = element_at(b * to_b + c * to_c - to_a);
            let plane = u32(3 * (1 - c) + 1 - b) * stride;
            let of_own = plane + select(0u, own, own < wet_end);
            let of_before = plane + select(0u, before, before < wet_end);
            momentum += momentum_before[of_own];
            weight += weight_before[of_own];
            momentum += momentum_after[of_before];
            weight += weight_after[of_before];
        }
    }
    let is_known = weight > 0.0;
    let velocity = select(0.0, momentum / max(weight, 1e-30), is_known);
    let component = axis.x;
    let face = component * params.stride + element;
    let is_closed = face_open[face] == 0.0;
#ifdef MOVING_SOLIDS
    let solid = closed_velocity[face];
#else
    let solid = wall_velocity(vec3f(own_cell(element)))[component];
#endif
    face_velocity[face] = select(velocity + params.velocity_step[component], solid, is_closed);
    face_change[face] = velocity;
    let others = select(face_layer[element], 0u, component == 0u);
    face_layer[element] = others | (u32(is_known) << (8u * component + 7u));
}
