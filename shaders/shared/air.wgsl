// Air drag on water droplets; same formulas as `domain::air`.
override AIR_DENSITY: f32;
override AIR_VISCOSITY: f32;
override DROP_RADIUS: f32;
override WIND_X: f32;
override WIND_Y: f32;
override WIND_Z: f32;

fn wind() -> vec3f {
    return vec3f(WIND_X, WIND_Y, WIND_Z);
}

// Rate at which drag reduces a droplet's speed relative to the air, 1/s: Schiller and Naumann 1933.
fn air_drag(speed: f32) -> f32 {
    let reynolds = 2.0 * DROP_RADIUS * speed / AIR_VISCOSITY;
    // Drag coefficient over Stokes' value. The argument of pow is bounded below: log2(0) may be
    // anything.
    let over_stokes = max(1.0 + 0.15 * pow(max(reynolds, 1e-12), 0.687), 0.44 / 24.0 * reynolds);
    return 4.5 * AIR_VISCOSITY * AIR_DENSITY / (DROP_RADIUS * DROP_RADIUS) * over_stokes;
}
