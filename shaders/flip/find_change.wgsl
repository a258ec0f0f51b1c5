// After the projection: marks the faces to which it gave a velocity (layer 1), and stores the
// change of velocity. Closed faces away from water have the velocity of their wall or solid, but it
// is not extrapolated: half of it would slow water that falls towards a floor a cell ahead of it.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_beside.wgsl"

@group(0) @binding(2) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(3) var<storage, read> face_open: array<f32>;
@group(0) @binding(4) var<storage, read> face_velocity: array<f32>;
@group(0) @binding(5) var<storage, read_write> face_change: array<f32>;
@group(0) @binding(6) var<storage, read_write> face_layer: array<u32>;

const FLUID = 1u;
const SOLID = 2u;

// Layer of closed faces away from water, later than all that are extrapolated.
const CLOSED = 0x7fu;

// Tags of cells beyond the stored layer of the upper walls, whose faces are never used.
const NO_NEED = 0x7f7f7fu;

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
    open_beside(element);
    let before = vec3u(element_beside(vec3i(-1, 0, 0)), element_beside(vec3i(0, -1, 0)),
        element_beside(vec3i(0, 0, -1)));
    let own = cell_kind[element];
    let brick = vec3u(bricks[own_slot].coordinate[0], bricks[own_slot].coordinate[1],
        bricks[own_slot].coordinate[2]);
    let own_cell = 8u * brick + vec3u(own_local);
    var tags = face_layer[element];
    for (var component = 0u; component < 3u; component++) {
        let face = component * params.stride + element;
        let other = before[component];
        let kind = cell_kind[other];
        let is_closed = face_open[face] == 0.0;
        // A closed face between two solid cells has no velocity of its own; slot 0 lies beyond the
        // domain.
        let is_buried = own == SOLID && (kind == SOLID || other < CELLS);
        let is_beside = own == FLUID || kind == FLUID;
        let layer = select(select(0u, CLOSED, is_closed && !is_buried), 1u, is_beside);
        face_change[face] = face_velocity[face] - face_change[face];
        tags |= layer << (8u * component);
    }
    face_layer[element] = select(tags, NO_NEED, any(own_cell > params.cells));
}
