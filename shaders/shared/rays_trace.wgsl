// First hit of a ray: the water's surface, opaque geometry, or the sky.
#import "shared/rays_water.wgsl"
#import "shared/rays_set.wgsl"
#ifdef SEA
#import "shared/sea.wgsl"
#endif

// Lengths below this count as zero, metres.
fn hair() -> f32 {
    return 1e-3 * rays.voxel;
}

fn pane(t: f32, normal: vec3f) -> Found {
    return Found(WATER, t, t - hair(), t + hair(), normal, 0u, 0.0, NO_TRIANGLE);
}

// Hit at a side of the box where water is cut off: an invisible pane, the wall behind it, or the
// ground.
fn at_side(p: vec3f, t: f32) -> Found {
    let side = side_of(p);
    let normal = side_normal(side);
    if side.x == 1u && side.y == 0u {
        return met(OPAQUE, t, vec3f(0.0, 1.0, 0.0), 2u);
    }
    if (rays.walls >> (2u * side.x + side.y) & 1u) == 1u {
        return met(OPAQUE, t, -normal, 1u);
    }
    return pane(t, normal);
}

#ifdef SEA
// Hit of a ray with the sea's surface between two distances beyond the box; the sky where it
// misses.
fn sea_along(origin: vec3f, direction: vec3f, span: vec2f, inside: bool, travelled: f32) -> Found {
    let surface = sea_crossing(
        origin, direction, span.x, min(span.y, sea_end()), inside, travelled);
    if surface.after >= FAR {
        return met(SKY, FAR, vec3f(0.0), 3u);
    }
    let at = (origin + direction * surface.after).xz;
    let footprint = (travelled + surface.after) / camera.focal;
    return Found(
        WATER, surface.after, surface.before, surface.after, sea_normal(at, footprint), 0u,
        sea_variance(at, footprint), NO_TRIANGLE);
}

// Hit of a ray beyond the box, which it leaves at `from_t`.
fn beyond(
    origin: vec3f, direction: vec3f, from_t: f32, inside: bool, travelled: f32, opaque_one: Found,
) -> Found {
    let at = from_t + hair();
    let p = origin + direction * at;
    if inside && !is_sea(p.xz) {
        return at_side(p, from_t);
    }
    // Heights within the box and beyond agree up to a voxel's interpolation.
    if is_sea_water(p, (travelled + at) / camera.focal) != inside {
        return pane(at, vec3f(0.0, 1.0, 0.0));
    }
    let found = sea_along(origin, direction, vec2f(at, opaque_one.t), inside, travelled);
    if found.kind == WATER {
        return found;
    }
    return opaque_one;
}
#endif

// First hit of a ray. `inside` states whether the ray begins in water, and `travelled` is the
// distance from the eye to its origin, metres. Hits in the box or with opaque geometry are only
// searched up to `reach`.
fn trace(origin: vec3f, direction: vec3f, inside: bool, travelled: f32, reach: f32) -> Found {
    let opaque_one = opaque_along(origin, direction, reach);
    let span = box_span(origin, direction);
    let start = max(span.x, 0.0);
    let misses = span.y <= start;
#ifdef SEA
    let before = select(start - hair(), FAR, misses);
    if before > 0.0 {
        let found = sea_along(
            origin, direction, vec2f(0.0, min(before, opaque_one.t)), inside, travelled);
        if found.kind == WATER {
            return found;
        }
    }
#endif
    if misses || start >= min(opaque_one.t, reach) {
        return opaque_one;
    }
#ifdef SEA
    if span.x > 0.0 && (field(origin + direction * (start + hair())) > 0.0) != inside {
        return pane(start, vec3f(0.0, 1.0, 0.0));
    }
#else
    if !inside && span.x > 0.0 && field(origin + direction * (start + hair())) > 0.0 {
        return pane(start, side_normal(side_of(origin + direction * start)));
    }
#endif
    let end = min(min(span.y, opaque_one.t), reach);
    let surface = crossing(origin, direction, start, end, inside);
    // Particles keep away from solids, and so does their surface: where water rests against a solid
    // it has no second surface.
    let gap = (opaque_one.t - surface.after) * abs(dot(opaque_one.normal, direction));
    if inside && surface.after < FAR && opaque_one.kind == OPAQUE && gap < rays.gap {
        return opaque_one;
    }
    if surface.after < FAR {
        let p = origin + direction * surface.after;
        let towards = select(-direction, direction, inside);
        return Found(
            WATER, surface.after, surface.before, surface.after, field_normal(p, towards), 0u, 0.0,
            NO_TRIANGLE);
    }
#ifdef SEA
    if span.y < min(opaque_one.t, reach) {
        return beyond(origin, direction, span.y, inside, travelled, opaque_one);
    }
#else
    if inside && span.y < min(opaque_one.t, reach) {
        return at_side(origin + direction * span.y, span.y);
    }
#endif
    return opaque_one;
}

// Whether a point is in the water.
fn is_wet(p: vec3f) -> bool {
#ifdef SEA
    if any(p.xz < vec2f(0.0)) || any(p.xz > rays.size.xz) {
        return p.y > 0.0 && is_sea_water(p, 0.0);
    }
#endif
    return all(p >= vec3f(0.0)) && all(p <= rays.size) && field(p) > 0.0;
}
