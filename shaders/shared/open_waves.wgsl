#import "shared/angle.wgsl"

override WAVE_COUNT: u32;
// Height of still water above the domain's floor, and its depth, metres.
override WAVE_LEVEL: f32;
override WAVE_DEPTH: f32;

// Two vectors per wave. First: turns per metre along x and z, phase at the substep's time in turns,
// and wave number k, rad/m. Second: velocity amplitudes along x and z, and upwards, m/s, over cosh
// ky / cosh kh and sinh ky / cosh kh.
@group(0) @binding(20) var<storage, read> open_waves: array<vec4f>;

// Water velocity of the waves at x, m/s; x in metres from the domain's minimum corner. Above the
// still-water level it is that at the level.
fn wave_velocity(x: vec3f) -> vec3f {
    let below = clamp(x.y, 0.0, WAVE_LEVEL) - WAVE_LEVEL;
    var sum = vec3f(0.0);
    for (var i = 0u; i < WAVE_COUNT; i++) {
        let wave = open_waves[2u * i];
        let speed = open_waves[2u * i + 1u];
        let angle = angle_of(dot(wave.xy, x.xz) + wave.z);
        let up = exp(wave.w * below);
        let down = exp(-wave.w * (below + 2.0 * WAVE_DEPTH));
        let along = (up + down) * cos(angle);
        sum += vec3f(speed.x * along, speed.z * (up - down) * sin(angle), speed.y * along);
    }
    return sum;
}
