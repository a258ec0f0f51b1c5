// Particles in an absorbing zone lose a part of their velocity. At rest in the water they have none, so that gravity, which
// the next step adds, and the pressure that holds it are left alone.
#import "shared/led_particles.wgsl"

fn lead(i: u32, place: vec3f, is_drop: bool) {
    let kept = 1.0 - select(led(place, params.time_step), 0.0, is_drop);
    velocity[i] = packed(kept * three(velocity[i]));
}
