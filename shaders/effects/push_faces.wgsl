// Accelerates face velocities by the scene's forces, as gravity does. The projection then produces
// the pressure that balances what of it water cannot follow.
#import "shared/led_faces.wgsl"
#import "shared/forces.wgsl"

fn lead(face: u32, component: u32, place: vec3f) {
    let change = params.kick * force_at(place)[component];
    face_velocity[face] += select(0.0, change, face_open[face] > 0.0);
}
