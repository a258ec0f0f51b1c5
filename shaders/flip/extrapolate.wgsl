// One layer of faces gets the mean of its neighbours of the layers before. Where particles gave a velocity, it is
// the change that is carried on, so that drops near each other keep their own velocities.
//
// In place: a neighbour that this very pass fills shows either no layer or this one, and neither is taken.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_neighborhood.wgsl"

@group(0) @binding(2) var<storage, read_write> face_velocity: array<f32>;
@group(0) @binding(3) var<storage, read_write> face_change: array<f32>;
@group(0) @binding(4) var<storage, read_write> face_layer: array<u32>;
// The layer that is filled.
@group(0) @binding(5) var<uniform> layer: vec4u;

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
    var tags = face_layer[element];
    let own_layers = (vec3u(tags) >> vec3u(0u, 8u, 16u)) & vec3u(0x7fu);
    let own_layer = layer.x;
    var neighbors = array<u32, 6>();
    var wanted = vec3u(0u);
    // Loops, where branches would run for lanes that need nothing.
    for (var once = 0; once < select(0, 1, any(own_layers == vec3u(0u))); once++) {
        open_neighborhood(element);
        neighbors[0] = element_at(vec3i(-1, 0, 0));
        neighbors[1] = element_at(vec3i(1, 0, 0));
        neighbors[2] = element_at(vec3i(0, -1, 0));
        neighbors[3] = element_at(vec3i(0, 1, 0));
        neighbors[4] = element_at(vec3i(0, 0, -1));
        neighbors[5] = element_at(vec3i(0, 0, 1));
        for (var k = 0; k < 6; k++) {
            let layers = (vec3u(face_layer[neighbors[k]]) >> vec3u(0u, 8u, 16u)) & vec3u(0x7fu);
            // 0 wraps round.
            let is_older = layers - 1u < vec3u(own_layer - 1u);
            wanted |= select(vec3u(0u), vec3u(1u << u32(k)), is_older & (own_layers == vec3u(0u)));
        }
    }
    for (var component = 0u; component < 3u; component++) {
        let sources = wanted[component];
        let plane = component * params.stride;
        let is_seen = ((tags >> (8u * component + 7u)) & 1u) == 1u;
        for (var once = 0; once < select(0, 1, sources != 0u); once++) {
            var velocity = 0.0;
            var change = 0.0;
            var seen = 0.0;
            for (var k = 0; k < 6; k++) {
                let source = select(0u, neighbors[k], ((sources >> u32(k)) & 1u) == 1u);
                velocity += face_velocity[plane + source];
                let counts = ((face_layer[source] >> (8u * component + 7u)) & 1u) == 1u;
                change += select(0.0, face_change[plane + source], counts);
                seen += f32(counts);
            }
            let face = plane + element;
            let mean_change = select(params.velocity_step[component], change / seen, seen > 0.0);
            // Gravity is in it already, and in its change.
            let old = face_velocity[face] - face_change[face];
            face_velocity[face] = select(velocity / f32(countOneBits(sources)), old + mean_change, is_seen);
            face_change[face] = mean_change;
            tags |= own_layer << (8u * component);
        }
    }
    face_layer[element] = tags;
}
