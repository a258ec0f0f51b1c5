// Extrapolates velocities by one layer: a face gets the mean of its neighbours in earlier layers.
// On faces with a velocity from particles only the change is extrapolated, so that droplets near
// each other keep their own velocities.
//
// Works in place: a neighbour that this pass itself fills has either no layer or the current one,
// and neither is used. Loops that run at most once replace branches, which would run for lanes that
// do not need them.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_beside.wgsl"

@group(0) @binding(2) var<storage, read_write> face_velocity: array<f32>;
@group(0) @binding(3) var<storage, read_write> face_change: array<f32>;
@group(0) @binding(4) var<storage, read_write> face_layer: array<u32>;
// Index of the layer that is filled.
@group(0) @binding(5) var<uniform> layer: vec4u;

// Elements of the cells before and after along each axis.
var<private> before: vec3u;
var<private> after: vec3u;

fn find_beside(element: u32) {
    open_beside(element);
    before = vec3u(
        element_beside(vec3i(-1, 0, 0)),
        element_beside(vec3i(0, -1, 0)),
        element_beside(vec3i(0, 0, -1)),
    );
    after = vec3u(
        element_beside(vec3i(1, 0, 0)),
        element_beside(vec3i(0, 1, 0)),
        element_beside(vec3i(0, 0, 1)),
    );
}

// Indices of the six faces in a plane; element 0, which is 0, if a face's bit is not set.
fn chosen(plane: u32, sources: u32, elements: vec3u, bits: vec3u) -> vec3u {
    return select(vec3u(0u), elements + plane, (vec3u(sources) & bits) != vec3u(0u));
}

const BEFORE = vec3u(1u, 4u, 16u);
const AFTER = vec3u(2u, 8u, 32u);

// Sum of a field over those of the six faces whose bits are set.
fn sum_velocity(plane: u32, sources: u32) -> f32 {
    let low = chosen(plane, sources, before, BEFORE);
    let high = chosen(plane, sources, after, AFTER);
    return face_velocity[low.x] + face_velocity[high.x] + face_velocity[low.y]
        + face_velocity[high.y]
        + face_velocity[low.z] + face_velocity[high.z];
}

fn sum_change(plane: u32, sources: u32) -> f32 {
    let low = chosen(plane, sources, before, BEFORE);
    let high = chosen(plane, sources, after, AFTER);
    return face_change[low.x] + face_change[high.x] + face_change[low.y] + face_change[high.y]
        + face_change[low.z] + face_change[high.z];
}

// Bit masks of the six faces, by component: faces of an earlier layer, and those with a velocity
// from particles.
var<private> sources: vec3u;
var<private> seen: vec3u;

fn note(tags: u32, bit: u32) {
    let other = vec3u(tags) >> vec3u(0u, 8u, 16u);
    // Layer 0 wraps around to the largest value.
    let is_older = (other & vec3u(0x7fu)) - 1u < vec3u(layer.x - 1u);
    sources |= select(vec3u(0u), vec3u(bit), is_older);
    seen |= select(vec3u(0u), vec3u(bit), (other & vec3u(0x80u)) != vec3u(0u));
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
    let shifts = vec3u(0u, 8u, 16u);
    let own_layer = layer.x;
    var tags = face_layer[element];
    let is_open = ((vec3u(tags) >> shifts) & vec3u(0x7fu)) == vec3u(0u);
    sources = vec3u(0u);
    seen = vec3u(0u);
    for (var once = 0; once < select(0, 1, any(is_open)); once++) {
        find_beside(element);
        note(face_layer[before.x], BEFORE.x);
        note(face_layer[after.x], AFTER.x);
        note(face_layer[before.y], BEFORE.y);
        note(face_layer[after.y], AFTER.y);
        note(face_layer[before.z], BEFORE.z);
        note(face_layer[after.z], AFTER.z);
        sources = select(vec3u(0u), sources, is_open);
        seen &= sources;
    }
    for (var once = 0; once < select(0, 1, any(sources != vec3u(0u))); once++) {
        for (var component = 0u; component < 3u; component++) {
            let plane = component * params.stride;
            let face = plane + element;
            let is_found = sources[component] != 0u;
            let is_seen = is_found && ((tags >> (8u * component)) & 0x80u) != 0u;
            for (var fresh = 0; fresh < select(0, 1, is_found && !is_seen); fresh++) {
                let sum = sum_velocity(plane, sources[component]);
                face_velocity[face] = sum / f32(countOneBits(sources[component]));
            }
            for (var known = 0; known < select(0, 1, is_seen); known++) {
                let count = countOneBits(seen[component]);
                let mean = sum_change(plane, seen[component]) / f32(max(count, 1u));
                let change = select(params.velocity_step[component], mean, count > 0u);
                // Gravity's change is included in both.
                face_velocity[face] += change - face_change[face];
                face_change[face] = change;
            }
            tags |= select(0u, own_layer << (8u * component), is_found);
        }
        face_layer[element] = tags;
    }
}
