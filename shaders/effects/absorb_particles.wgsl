// Moves the velocity of particles in an absorbing zone towards that of the undisturbed water.
// Gravity, which the next step adds, and the pressure that balances it are not affected.
#import "shared/led_particles.wgsl"

fn lead(i: u32, place: vec3f, is_drop: bool) {
    let part = select(led(place, params.time_step), 0.0, is_drop);
    velocity[i] = packed((1.0 - part) * three(velocity[i]) + part * current());
}
