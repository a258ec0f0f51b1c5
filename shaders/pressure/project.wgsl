// Subtracts the pressure gradient from the face velocities, and writes the pressure.
#import "shared/pressure_gradient.wgsl"

@group(0) @binding(6) var<storage, read_write> face_velocity: array<f32>;
@group(0) @binding(7) var<storage, read_write> pressure: array<f32>;

#ifdef BODIES
// The projection that follows contacts of bodies adds to the pressure of the one before it.
const AFTER_CONTACTS = 2u;

#endif
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
            let change = select(0.0, face.difference, face.is_open);
            face_velocity[face.element] = f32(real(face_velocity[face.element]) - change);
        }
        let own = natural(s.slot, s.block) + (c & 1u) + 8u * ((c >> 1u) & 1u) + 64u * (c >> 2u);
        let q = q_element(s.slot, s.block, c);
        var value = pressure_solution[q];
#ifdef TWO_WORDS
        // The large word by itself is accurate to 12 bits only.
        value += pressure_solution[phase.stride + q];
#endif
        var before = 0.0;
#ifdef BODIES
        before = select(0.0, pressure[own], phase.step == AFTER_CONTACTS);
#endif
        pressure[own] = before + phase.pressure_scale * f32(value);
    }
}
