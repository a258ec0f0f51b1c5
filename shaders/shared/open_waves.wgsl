override WAVE_COUNT: u32;
// Of the water at rest, metres.
override WAVE_DEPTH: f32;

// Of each wave two: turns a metre along x and z, turns of its phase at the substep's time, and its number k, rad/m; then what
// its speed is along x and z and upwards, over cosh ky / cosh kh and sinh ky / cosh kh, m/s.
@group(0) @binding(20) var<storage, read> open_waves: array<vec4f>;

// Where the waves have water at x go, metres from the domain's least corner, m/s; above the still level as at it.
fn wave_velocity(x: vec3f) -> vec3f {
    let y = clamp(x.y, 0.0, WAVE_DEPTH);
    var sum = vec3f(0.0);
    for (var i = 0u; i < WAVE_COUNT; i++) {
        let wave = open_waves[2u * i];
        let speed = open_waves[2u * i + 1u];
        let turns = dot(wave.xy, x.xz) + wave.z;
        // Sines are good to 2⁻¹¹ within half a turn, and to nothing beyond.
        let angle = 6.2831853 * (turns - round(turns));
        let up = exp(wave.w * (y - WAVE_DEPTH));
        let down = exp(-wave.w * (y + WAVE_DEPTH));
        let along = (up + down) * cos(angle);
        sum += vec3f(speed.x * along, speed.z * (up - down) * sin(angle), speed.y * along);
    }
    return sum;
}
