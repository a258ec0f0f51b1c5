// Moves the velocity that particles transferred to faces in an absorbing zone towards that of the
// undisturbed water. Gravity's change is kept: a reduction that varies in space would act as a
// force that spins the water.
#import "shared/led_faces.wgsl"
#import "shared/zone.wgsl"

fn lead(face: u32, component: u32, place: vec3f) {
    let part = led(place, params.time_step);
    let excess = face_change[face] - current()[component];
    face_velocity[face] -= select(0.0, part * excess, face_open[face] > 0.0);
}
