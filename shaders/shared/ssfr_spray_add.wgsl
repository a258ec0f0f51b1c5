// Accumulation of spray sums. The importing shader must bind `camera`, `spray_params` and `spray`.
#import "shared/ssfr_spray.wgsl"

// Fraction of a sphere at depth `z` in front of `edge`, so that spheres fade where they intersect a
// surface.
fn before(edge: f32, z: f32, radius: f32) -> f32 {
    return clamp((edge - z) / (2.0 * radius) + 0.5, 0.0, 1.0);
}

// Adds `amount` metres of optical length at a depth, with a world-space velocity.
fn add_spray(pixel: vec2u, amount: f32, z: f32, velocity: vec3f) {
    let half_size = camera.size / 2u;
    let scaled = amount * SPRAY_SCALE;
    let whole = u32(scaled + 0.5);
    if whole == 0u {
        return;
    }
    let at = pixel.y * half_size.x + pixel.x;
    let plane = half_size.x * half_size.y;
    atomicAdd(&spray[at], whole);
    atomicAdd(&spray[at + plane], u32(scaled * clamp(z / spray_params.range, 0.0, 1.0) + 0.5));
#ifdef MOTION
    let part = clamp(velocity / spray_params.speed, vec3f(-1.0), vec3f(1.0));
    // Two's complement: wrapped sums of both signs are correct.
    let words = bitcast<vec3u>(vec3i(round(scaled * part)));
    atomicAdd(&spray[at + 2u * plane], words.x);
    atomicAdd(&spray[at + 3u * plane], words.y);
    atomicAdd(&spray[at + 4u * plane], words.z);
#endif
}

#ifdef FOAM
// Adds the part of `amount` that is foam to a separate plane.
fn add_foam(pixel: vec2u, amount: f32) {
    let half_size = camera.size / 2u;
    let plane = half_size.x * half_size.y;
    atomicAdd(
        &spray[pixel.y * half_size.x + pixel.x + 2u * plane], u32(amount * SPRAY_SCALE + 0.5));
}
#endif
