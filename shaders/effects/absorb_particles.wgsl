// Damps the velocity of particles in an absorbing zone. Particles at rest have none, so that
// gravity, which the next step adds, and the pressure that balances it are not affected.
#import "shared/led_particles.wgsl"

fn lead(i: u32, place: vec3f, is_drop: bool) {
    let kept = 1.0 - select(led(place, params.time_step), 0.0, is_drop);
    velocity[i] = packed(kept * three(velocity[i]));
}
