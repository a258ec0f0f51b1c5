// What a ray meets first: the water's surface, something opaque, or the sky.
#import "shared/rays_water.wgsl"
#import "shared/rays_set.wgsl"

// Lengths below this are the same place.
fn hair() -> f32 {
    return 1e-3 * rays.voxel;
}

// A side of the box that water stands at: a pane that is not there, or the wall behind it, or the ground.
fn at_side(p: vec3f, t: f32) -> Found {
    let side = side_of(p);
    let normal = side_normal(side);
    if side.x == 1u && side.y == 0u {
        return met(OPAQUE, t, vec3f(0.0, 1.0, 0.0), 2u);
    }
    if (rays.walls >> (2u * side.x + side.y) & 1u) == 1u {
        return met(OPAQUE, t, -normal, 1u);
    }
    return Found(WATER, t, t - hair(), t + hair(), normal, 0u);
}

// `inside` says whether the ray begins in the water.
fn trace(origin: vec3f, direction: vec3f, inside: bool) -> Found {
    let opaque_one = opaque_along(origin, direction);
    let span = box_span(origin, direction);
    let start = max(span.x, 0.0);
    if span.y <= start || start >= opaque_one.t {
        return opaque_one;
    }
    if !inside && span.x > 0.0 && field(origin + direction * (start + hair())) > 0.0 {
        let normal = side_normal(side_of(origin + direction * start));
        return Found(WATER, start, start - hair(), start + hair(), normal, 0u);
    }
    let end = min(span.y, opaque_one.t);
    let surface = crossing(origin, direction, start, end, inside);
    if surface.after < FAR {
        let p = origin + direction * surface.after;
        let towards = select(-direction, direction, inside);
        return Found(
            WATER, surface.after, surface.before, surface.after, field_normal(p, towards), 0u);
    }
    if inside && span.y < opaque_one.t {
        return at_side(origin + direction * span.y, span.y);
    }
    return opaque_one;
}

// Whether a point is in the water.
fn is_wet(p: vec3f) -> bool {
    return all(p >= vec3f(0.0)) && all(p <= rays.size) && field(p) > 0.0;
}
