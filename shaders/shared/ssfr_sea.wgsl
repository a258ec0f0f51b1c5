// The sea in a picture of splats. Needs the bindings `camera`, `sea` and `sea_values` of whoever imports it.
#import "shared/sea.wgsl"

struct SeaSeen {
    // Distance from the eye; FAR where there is none.
    distance: f32,
    // Upward, and the mean square slope of the waves that a pixel there cannot hold.
    normal: vec3f,
    variance: f32,
}

// The sea along a ray from the eye, which stands in air, before something `bound` metres away.
fn sea_from_eye(direction: vec3f, bound: f32) -> SeaSeen {
    let origin = camera.position;
    let span = span_of(sea.size, origin, direction);
    let start = max(span.x, 0.0);
    let misses = span.y <= start;
    let limit = min(bound, sea_end());
    var distance = sea_crossing(origin, direction, 0.0, min(select(start, limit, misses), limit), false, 0.0).after;
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

// Metres of the sea's water on a line of sight that comes through the simulated water and out of the box.
fn sea_behind(direction: vec3f) -> f32 {
    let span = span_of(sea.size, camera.position, direction);
    let p = camera.position + direction * (span.y + sea.hair);
    if span.y <= max(span.x, 0.0) || p.y < sea.hair || !is_sea_water(p, 0.0) {
        return 0.0;
    }
    return p.y / max(-direction.y, 1e-3);
}
