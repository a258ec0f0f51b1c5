// Moves velocities of particles in a generation zone towards those of the waves and the current at
// the substep's end.
#import "shared/led_particles.wgsl"
#import "shared/open_waves.wgsl"

fn lead(i: u32, place: vec3f, is_drop: bool) {
    let part = led(place, params.time_step);
    if part > 0.0 && !is_drop {
        let v = three(velocity[i]);
        velocity[i] = packed(v + part * (wave_velocity(place) + current() - v));
    }
}
