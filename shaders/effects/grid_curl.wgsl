// Vorticity ω = ∇ × u at the centres of cells with water, by differences of the mean velocities of
// neighbouring cells; one-sided if a neighbour has no water.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_neighborhood.wgsl"

@group(0) @binding(2) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(3) var<storage, read> face_velocity: array<f32>;
@group(0) @binding(4) var<storage, read_write> vorticity: array<Vector>;
@group(0) @binding(5) var<storage, read_write> vorticity_length: array<f32>;

const FLUID = 1u;

// Mean velocity of the cell at `offset`, one step along an axis, or of this cell if that one has no
// water; `w` is 1 in the former case.
fn velocity_of(offset: vec3i) -> vec4f {
    let found = element_at(offset);
    let is_water = cell_kind[found] == FLUID;
    let e = select(element_at(vec3i(0)), found, is_water);
    let kept = select(vec3i(0), offset, is_water);
    let low = vec3f(
        face_velocity[e], face_velocity[params.stride + e], face_velocity[2u * params.stride + e]);
    // A cell's upper faces are its upper neighbours' lower faces. Faces two cells away are out of
    // reach, but not needed: a curl takes no velocity component along the axis of its difference.
    let high = vec3f(
        face_velocity[element_at(clamp(kept + vec3i(1, 0, 0), vec3i(-1), vec3i(1)))],
        face_velocity[params.stride
            + element_at(clamp(kept + vec3i(0, 1, 0), vec3i(-1), vec3i(1)))],
        face_velocity[2u * params.stride
            + element_at(clamp(kept + vec3i(0, 0, 1), vec3i(-1), vec3i(1)))],
    );
    return vec4f(0.5 * (low + high), f32(is_water));
}

// Difference along one axis, 1/s.
fn slope(axis: vec3i) -> vec3f {
    let after = velocity_of(axis);
    let before = velocity_of(-axis);
    return (after.xyz - before.xyz) * params.inverse_cell_size / max(after.w + before.w, 1.0);
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
    var curl = vec3f(0.0);
    for (var once = 0; once < select(0, 1, cell_kind[element] == FLUID); once++) {
        open_neighborhood(element);
        let by_x = slope(vec3i(1, 0, 0));
        let by_y = slope(vec3i(0, 1, 0));
        let by_z = slope(vec3i(0, 0, 1));
        curl = vec3f(by_y.z - by_z.y, by_z.x - by_x.z, by_x.y - by_y.x);
    }
    vorticity[element] = packed(curl);
    vorticity_length[element] = length(curl);
}
