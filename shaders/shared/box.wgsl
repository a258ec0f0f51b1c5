// Intersection of rays with an axis-aligned box that begins at the origin.

fn safe_inverse(d: vec3f) -> vec3f {
    return 1.0 / select(d, vec3f(1e-9), abs(d) < vec3f(1e-9));
}

// Distances at which a ray enters and leaves a box of `size`; the second is less than the first
// where the ray misses.
fn span_of(size: vec3f, origin: vec3f, direction: vec3f) -> vec2f {
    let inverse = safe_inverse(direction);
    let a = -origin * inverse;
    let b = (size - origin) * inverse;
    let low = min(a, b);
    let high = max(a, b);
    return vec2f(max(low.x, max(low.y, low.z)), min(high.x, min(high.y, high.z)));
}
