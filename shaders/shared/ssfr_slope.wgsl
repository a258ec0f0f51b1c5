// Slopes of per-pixel quantities, averaged over two spacings because spheres have slopes of their
// own. Needs the bindings `camera` and `shading`.

// Particle spacing in pixels at depth `z`, at least two; rounded to 1/64, so that adding it to a
// pixel's position is exact wherever the frame begins.
fn spacing_in_pixels(z: f32) -> f32 {
    return max(round(64.0 * shading.spacing * camera.focal / z) / 64.0, 2.0);
}

// Slope to the right and down at depth `z`, metres per metre, from values `h` pixels right and down
// of a pixel, right and up, left and down, left and up.
fn slope_between(a: f32, b: f32, c: f32, d: f32, h: f32, z: f32) -> vec2f {
    return vec2f(a + b - c - d, a + c - b - d) * camera.focal / (4.0 * h * z);
}
