// Faces in an absorbing zone lose a part of the velocity that particles gave them. What gravity added stays: less of it in
// one place than in another would be a force that turns the water.
#import "shared/led_faces.wgsl"

fn lead(face: u32, component: u32, place: vec3f) {
    let part = led(place, params.time_step);
    face_velocity[face] -= select(0.0, part * face_change[face], face_open[face] > 0.0);
}
