// Waves finer than the particles, as normals: a world-anchored sum of sines with ω² = g k.
#import "shared/angle.wgsl"
#import "shared/ssfr_noise.wgsl"
#import "shared/ssfr_optics.wgsl"

struct Ripple {
    // d(height)/d(x, z).
    slope: vec2f,
    // Mean square slope of the waves that a pixel cannot resolve.
    lost: f32,
}

fn ripple_at(p: vec2f, seconds: f32, wavelength: f32, slope: f32, footprint: f32) -> Ripple {
    var out = Ripple(vec2f(0.0), 0.0);
    // Slowly varying gusts hide the repetition of the pattern.
    let gust = 0.45 + 1.1 * value_noise(p / (5.0 * wavelength));
    let share = slope * gust / sqrt(7.0);
    // Bends crests by more than a wavelength over a few of them; straight ones would form a visible
    // grid.
    let bend = vec2f(
        value_noise(p * (0.6 / wavelength)) - 0.5,
        value_noise(p * (1.4 / wavelength) + 17.0) - 0.5,
    ) * 11.0;
    for (var i = 0; i < 7; i++) {
        let f = f32(i);
        let k = 2.0 * PI / (wavelength * pow(0.74, f));
        // Golden-angle spread over a fan of ±80° around +x.
        let turn = (fract(f * 0.618034 + 0.31) - 0.5) * 2.8;
        let direction = vec2f(cos(turn), sin(turn));
        let phase = k * dot(direction, p) - sqrt(9.81 * k) * seconds + f * 2.4
            + select(bend.x, bend.y, i > 2);
        let angle = angle_of(phase / (2.0 * PI));
        let wide = 0.5 * k * footprint;
        let kept = exp(-0.5 * wide * wide);
        out.slope += direction * (share * 1.41421356 * kept * cos(angle));
        out.lost += share * share * (1.0 - kept * kept);
    }
    return out;
}
