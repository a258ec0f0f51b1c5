// After the projection: which faces have a velocity (layer 1), and what of that is change. Those of drops have one that
// no water is near: their change is gravity's.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_neighborhood.wgsl"

@group(0) @binding(2) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(3) var<storage, read> face_open: array<f32>;
@group(0) @binding(4) var<storage, read> face_velocity: array<f32>;
@group(0) @binding(5) var<storage, read_write> face_change: array<f32>;
@group(0) @binding(6) var<storage, read_write> face_layer: array<u32>;

const FLUID = 1u;
const SOLID = 2u;

// Beyond the stored layer of the upper walls: never asked for.
const NO_NEED = 0x7f7f7fu;

// Whether particles gave a face of the component a velocity.
const KNOWN = 0x80u;

// A bit for each component: whether one of the 18 cells about its face is water.
fn water_about() -> u32 {
    var near = 0u;
    for (var k = 0; k < 27; k++) {
        let offset = vec3i(k % 3, k / 3 % 3, k / 9) - 1;
        let bits = select(0u, 1u, offset.x < 1) | select(0u, 2u, offset.y < 1) | select(0u, 4u, offset.z < 1);
        near |= select(0u, bits, cell_kind[element_at(offset)] == FLUID);
    }
    return near;
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
    open_neighborhood(element);
    let before = vec3u(element_at(vec3i(-1, 0, 0)), element_at(vec3i(0, -1, 0)), element_at(vec3i(0, 0, -1)));
    let own = cell_kind[element];
    var tags = face_layer[element];
    var near = 7u;
    for (var once = 0; once < select(0, 1, own != FLUID && (tags & 0x808080u) != 0u); once++) {
        near = water_about();
    }
    for (var component = 0u; component < 3u; component++) {
        let face = component * params.stride + element;
        let other = before[component];
        let kind = cell_kind[other];
        let is_closed = face_open[face] == 0.0;
        // A closed face between solids has no velocity of its own; slot 0 is what lies beyond the domain.
        let is_buried = own == SOLID && (kind == SOLID || other < CELLS);
        let is_drop = ((near >> component) & 1u) == 0u && (tags & (KNOWN << (8u * component))) != 0u;
        let is_found = own == FLUID || kind == FLUID || (is_closed && !is_buried) || is_drop;
        face_change[face] = face_velocity[face] - face_change[face];
        tags |= u32(is_found) << (8u * component);
    }
    face_layer[element] = select(tags, NO_NEED, any(own_cell(element) > params.cells));
}
