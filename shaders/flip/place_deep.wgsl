// Narrow-band FLIP (Ferstl et al. 2016): faces in the depth take the velocity that has moved with
// the water on the grid, and forces act on it as on that of particles. A face is deep if both of
// its cells are, to one cell less than the band: up there particles and grid overlap.
//
// Values come from the bricks of the substep before, those of a state from the bricks around it.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_beside.wgsl"

// By brick with water: three planes of velocities on lower faces, m/s, and depths, cells.
@group(0) @binding(2) var<storage, read> deep: array<f32>;
// Slot in `deep` of each brick.
@group(0) @binding(3) var<storage, read> deep_slot: array<u32>;
@group(0) @binding(4) var<storage, read_write> deep_depth: array<f32>;
@group(0) @binding(5) var<storage, read> face_open: array<f32>;
@group(0) @binding(6) var<storage, read_write> face_velocity: array<f32>;
// Holds the velocity before forces here.
@group(0) @binding(7) var<storage, read_write> face_change: array<f32>;
// Bits as in flip/gather_faces: a deep face counts as one to which particles gave a velocity.
@group(0) @binding(8) var<storage, read_write> face_layer: array<u32>;

// Values of a cell in `deep`, and the plane of depths.
const VALUES = 4u;
const DEPTH = 3u;

const OVERLAP = 1.0;

fn value_of(element: u32, plane: u32) -> f32 {
    let slot = deep_slot[element / CELLS];
    let found = deep[(VALUES * slot + plane) * CELLS + element % CELLS];
    return select(found, 0.0, slot == 0u);
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
    let own = value_of(element, DEPTH);
    deep_depth[element] = own;
    let least = params.band - OVERLAP;
    for (var once = 0; once < select(0, 1, own >= least); once++) {
        open_beside(element);
        let before = vec3u(element_beside(vec3i(-1, 0, 0)), element_beside(vec3i(0, -1, 0)),
            element_beside(vec3i(0, 0, -1)));
        var tags = face_layer[element];
        for (var component = 0u; component < 3u; component++) {
            let face = component * params.stride + element;
            let is_deep = value_of(before[component], DEPTH) >= least && face_open[face] > 0.0;
            let velocity = value_of(element, component);
            face_velocity[face] = select(
                face_velocity[face], velocity + params.velocity_step[component], is_deep);
            face_change[face] = select(face_change[face], velocity, is_deep);
            tags |= u32(is_deep) << (8u * component + 7u);
        }
        face_layer[element] = tags;
    }
}
