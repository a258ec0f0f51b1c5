// Faces in a generation zone go a part of the way from the velocity that particles gave them to that of the waves at the
// substep's start. What gravity added stays, and the pressure makes of it what it makes of waves.
#import "shared/led_faces.wgsl"
#import "shared/open_waves.wgsl"

fn lead(face: u32, component: u32, place: vec3f) {
    let part = led(place, params.time_step);
    if part > 0.0 && face_open[face] > 0.0 {
        let wanted = wave_velocity(place)[component];
        face_velocity[face] += part * (wanted - face_change[face]);
    }
}
