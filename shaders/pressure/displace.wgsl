// Displacements of the density correction at the faces, metres, behind the faces' velocities.
#import "shared/pressure_gradient.wgsl"

@group(0) @binding(6) var<storage, read_write> face_velocity: array<f32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let range = phase.levels[0];
    if i / 64u >= range.z {
        return;
    }
    let s = site_at(range.x + i / 64u, i & 63u, range.z);
    for (var c = 0u; c < 8u; c++) {
        for (var axis = 0u; axis < 3u; axis++) {
            let face = face_at(s, c, axis);
            let displacement = f32(select(0.0, -face.difference, face.is_open));
            face_velocity[3u * phase.stride + face.element] = displacement;
        }
    }
}
