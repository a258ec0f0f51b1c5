// Moves face velocities in a generation zone from those that particles transferred towards those of
// the waves and the current at the substep's start. Gravity's change is kept; the projection then
// produces the pressure of the waves.
#import "shared/led_faces.wgsl"
#import "shared/zone.wgsl"
#import "shared/open_waves.wgsl"

fn lead(face: u32, component: u32, place: vec3f) {
    let part = led(place, params.time_step);
    if part > 0.0 && face_open[face] > 0.0 {
        let wanted = wave_velocity(place)[component] + current()[component];
        face_velocity[face] += part * (wanted - face_change[face]);
    }
}
