// One layer of faces gets the mean of its neighbours of the layers before. Where particles gave a velocity, it is
// the change that is carried on, so that drops near each other keep their own velocities.
//
// In place: a neighbour that this very pass fills shows either no layer or this one, and neither is taken. Loops
// that run once stand where branches would run for lanes that need nothing.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_beside.wgsl"

@group(0) @binding(2) var<storage, read_write> face_velocity: array<f32>;
@group(0) @binding(3) var<storage, read_write> face_change: array<f32>;
@group(0) @binding(4) var<storage, read_write> face_layer: array<u32>;
// The layer that is filled.
@group(0) @binding(5) var<uniform> layer: vec4u;

var<private> beside: array<u32, 6>;

fn find_beside(element: u32) {
    open_beside(element);
    beside[0] = element_beside(vec3i(-1, 0, 0));
    beside[1] = element_beside(vec3i(1, 0, 0));
    beside[2] = element_beside(vec3i(0, -1, 0));
    beside[3] = element_beside(vec3i(0, 1, 0));
    beside[4] = element_beside(vec3i(0, 0, -1));
    beside[5] = element_beside(vec3i(0, 0, 1));
}

// Sum of a field over those of the six faces whose bit is set.
fn sum_velocity(plane: u32, sources: u32) -> f32 {
    var sum = 0.0;
    for (var k = 0u; k < 6u; k++) {
        sum += face_velocity[select(0u, plane + beside[k], ((sources >> k) & 1u) == 1u)];
    }
    return sum;
}

fn sum_change(plane: u32, sources: u32) -> f32 {
    var sum = 0.0;
    for (var k = 0u; k < 6u; k++) {
        sum += face_change[select(0u, plane + beside[k], ((sources >> k) & 1u) == 1u)];
    }
    return sum;
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
    // A bit for each of the six: of an older layer, and seen by particles as well.
    var sources = vec3u(0u);
    var seen = vec3u(0u);
    for (var once = 0; once < select(0, 1, any(is_open)); once++) {
        find_beside(element);
        for (var k = 0u; k < 6u; k++) {
            let other = vec3u(face_layer[beside[k]]) >> shifts;
            // 0 wraps round.
            let is_source = is_open & ((other & vec3u(0x7fu)) - 1u < vec3u(own_layer - 1u));
            sources |= select(vec3u(0u), vec3u(1u << k), is_source);
            seen |= select(vec3u(0u), vec3u(1u << k), is_source & ((other & vec3u(0x80u)) != vec3u(0u)));
        }
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
                // What gravity changed is in both.
                face_velocity[face] += change - face_change[face];
                face_change[face] = change;
            }
            tags |= select(0u, own_layer << (8u * component), is_found);
        }
        face_layer[element] = tags;
    }
}
