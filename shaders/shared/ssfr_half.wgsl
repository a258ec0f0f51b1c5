// Interpolated lookup of half-resolution sums. The importing shader must bind `camera`.
#import "shared/ssfr_splat.wgsl"

fn half_load(words: ptr<function, vec4u>, part: vec2f) -> f32 {
    let v = vec4f(*words) / THICKNESS_SCALE;
    return mix(mix(v.x, v.y, part.x), mix(v.z, v.w, part.x), part.y);
}

struct HalfTap {
    at: vec4u,
    part: vec2f,
}

// The four half-resolution cells around a padded pixel position.
fn half_tap(position: vec2f) -> HalfTap {
    let size = vec2i(camera.size / 2u);
    let p = position * 0.5 - 0.5;
    let base = vec2i(floor(p));
    let a = clamp(base, vec2i(0), size - 1);
    let b = clamp(base + 1, vec2i(0), size - 1);
    let at = vec4u(
        vec4i(a.y * size.x + a.x, a.y * size.x + b.x, b.y * size.x + a.x, b.y * size.x + b.x));
    return HalfTap(at, p - floor(p));
}
