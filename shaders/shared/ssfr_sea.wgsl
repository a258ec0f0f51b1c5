// The sea in screen-space rendering. The importing shader must bind `camera`, `sea` and
// `sea_values`.
#import "shared/sea.wgsl"

struct SeaSeen {
    // Distance from the eye; FAR without a hit.
    distance: f32,
    // Upward normal, and the mean square slope of the waves that a pixel there cannot resolve.
    normal: vec3f,
    variance: f32,
}

// Intersection with the sea of a ray from an eye in air, up to `bound` metres.
fn sea_from_eye(direction: vec3f, bound: f32) -> SeaSeen {
    let origin = camera.position;
    let span = span_of(sea.size, origin, direction);
    let start = max(span.x, 0.0);
    let misses = span.y <= start;
    let limit = min(bound, sea_end());
    var distance = sea_crossing(origin, direction, 0.0, min(select(start, limit, misses), limit),
        false, 0.0).after;
    if distance >= FAR && !misses {
        distance = sea_crossing(origin, direction, span.y + sea.hair, limit, false, 0.0).after;
    }
    var seen = SeaSeen(distance, vec3f(0.0), 0.0);
    if distance < FAR {
        let at = (origin + direction * distance).xz;
        let footprint = distance / camera.focal;
        seen.normal = sea_normal(at, footprint);
        seen.variance = sea_variance(at, footprint);
    }
    return seen;
}

// Metres of the sea's water on a line of sight that passes through the simulated water and leaves
// the box.
fn sea_behind(direction: vec3f) -> f32 {
    let span = span_of(sea.size, camera.position, direction);
    let p = camera.position + direction * (span.y + sea.hair);
    if span.y <= max(span.x, 0.0) || p.y < sea.hair || !is_sea_water(p, 0.0) {
        return 0.0;
    }
    return p.y / max(-direction.y, 1e-3);
}
