// Radiance along rays through water and air. Needs the bindings of rays_water, rays_set and
// ssfr_light, and `camera`.
#import "shared/rays_trace.wgsl"
#import "shared/rays_sun.wgsl"
#import "shared/ssfr_opaque.wgsl"
#import "shared/ssfr_facet.wgsl"
#import "shared/ssfr_lights.wgsl"
#import "shared/ssfr_holdout.wgsl"
#ifdef VOLUME
#import "shared/rays_cloud_light.wgsl"
#endif
#ifdef FOAM_LAYER
#import "shared/foam_layer.wgsl"
#endif
#ifdef CAUSTICS
#import "shared/caustics_light.wgsl"
#endif

// Stack size of pending rays, and the largest number of rays per picture ray.
const WAITING: i32 = 8;
const MOST_RAYS: i32 = 24;
// Number of surfaces along a path after which the sky's mean replaces further tracing.
const MOST_SURFACES: u32 = 10u;
// Least weight of a side branch, at the first surface and at later ones; below it the other branch
// takes over its weight. With 0.004 at all surfaces, a splash takes half as long again.
const LEAST_BRANCH: f32 = 0.004;
const LEAST_LATER_BRANCH: f32 = 0.1;
// Segments of a path through water for single scattering.
const PARTS: i32 = 4;

// Position within a segment at which the sun's visibility is tested, 0 to 1. It differs by pixel
// and sample, so that a shadow edge in water is spread over the segment instead of repeated once
// per segment.
var<private> own_place: f32;

struct Ray {
    origin: vec3f,
    inside: bool,
    direction: vec3f,
    // Fraction of the picture ray's weight that arrives here.
    weight: vec3f,
    // Distance from the eye to the ray's origin, metres.
    travelled: f32,
    surfaces: u32,
    // REFLECTION or REFRACTION behind the first surface.
    part: u32,
}

// Light component of a contribution that would be `own` on the ray from the eye. What the first
// surface reflects is one component, and what it transmits another, except for light that the water
// scatters.
fn part_of(ray: Ray, own: u32) -> u32 {
    let is_own = ray.surfaces == 0u
        || (ray.part == REFRACTION && (own == WHITE || own == FOAM_LIGHT || own == SCATTERING));
    return select(ray.part, own, is_own);
}

// Metres of water that sunlight passes through on its path to `p`.
fn water_above(p: vec3f) -> f32 {
#ifdef SEA
    if any(p.xz < vec2f(0.0)) || any(p.xz > rays.size.xz) {
        return select(0.0, max(sea.level - p.y, 0.0) * shading.sun_path, is_sea(p.xz));
    }
#endif
    return sun_path_at(p, shading.sun_direction);
}

fn strongest(weight: vec3f) -> f32 {
    return max(weight.x, max(weight.y, weight.z));
}

// ∫ σ exp(−σ (t + s)) dt from `start` to `end` of a path through water, where the light's own path
// s varies linearly from `before` to `after`. This is exact in flat water at any depth.
fn gathered(extinction: vec3f, start: f32, end: f32, before: f32, after: f32) -> vec3f {
    let x = extinction * (end - start + after - before);
    let first = exp(-extinction * (start + before));
    let last = exp(-extinction * (end + after));
    let mean = select((first - last) / x, first * (1.0 - 0.5 * x), abs(x) < vec3f(1e-3));
    return extinction * (end - start) * mean;
}

// Light that water along a path of `length` metres scatters towards its origin: single scattering
// of sun and sky, attenuated by the water above, scaled so that deep flat water seen from straight
// above has the reflectance of `deep_albedo`.
fn scattered(origin: vec3f, direction: vec3f, length: f32) -> vec3f {
    let extinction = shading.absorption + shading.scattering;
    let up = vec3f(0.0, 1.0, 0.0);
    let sun = shading.sun_irradiance * max(shading.sun_direction.y, 0.0) * (1.0 + shading.sun_path);
    let sky = sky_irradiance(up) * 2.0;
    var light = vec3f(0.0);
    var start = 0.0;
    var before = water_above(origin);
    for (var k = 1; k <= PARTS; k++) {
        // Segments are finer near the eye, where most of the light originates.
        let part = f32(k) / f32(PARTS);
        let end = length * part * part;
        let after = water_above(origin + direction * end);
        let seen = sunlit(origin + direction * mix(start, end, own_place), up);
        light += sun * seen * gathered(extinction, start, end, before, after);
        light += sky
            * gathered(extinction, start, end, before / shading.sun_path, after / shading.sun_path);
        start = end;
        before = after;
    }
    return light * deep_albedo() / PI;
}

struct Split {
    // On the side the ray came from.
    normal: vec3f,
    mirrored: vec3f,
    refracted: vec3f,
    reflectance: f32,
    variance: f32,
}

// Reflection and refraction of a ray at the water's surface.
fn split_at(ray: Ray, found: Found) -> Split {
    let view = -ray.direction;
    let side = select(1.0, -1.0, ray.inside);
    let p = ray.origin + ray.direction * found.t;
    let footprint = (ray.travelled + found.t) / camera.focal
        / max(abs(dot(found.normal, view)), 0.1);
    let facet = facet_at(p, found.normal, footprint);
    var normal = facet.normal * side;
    // Visible facets never face away.
    normal = normalize(normal + view * max(0.03 - dot(normal, view), 0.0) * 1.5);
    let index = select(shading.index, 1.0 / shading.index, ray.inside);
    let facing = clamp(dot(normal, view), 0.0, 1.0);
    var mirrored = reflect(-view, normal);
    // A reflected ray stays on its side of the surface, regardless of ripples.
    let grazes = max(0.005 - dot(mirrored, found.normal * side), 0.0);
    mirrored = normalize(mirrored + found.normal * side * grazes);
    var refracted = refract(-view, normal, 1.0 / index);
    let sinks = max(0.005 + dot(refracted, found.normal * side), 0.0);
    refracted = refracted - found.normal * side * sinks;
    let reflectance = select(fresnel(facing, index), 1.0, dot(refracted, refracted) < 0.25);
    return Split(
        normal, mirrored, normalize(refracted - found.normal * side * 1e-6), reflectance,
        facet.variance + found.variance);
}

#ifdef CAUSTICS
// Irradiance on opaque geometry from sunlight that came through the water, before absorption.
fn sun_under_water(p: vec3f, n: vec3f, footprint: f32) -> vec3f {
    let part = caustic_part(p);
    var sun = 0.0;
    if part > 0.0 {
        // The map holds irradiance on level ground.
        let level = max(dot(n, caustics.sun), 0.0) / caustics.sun.y;
        sun = part * shading.sun_direction.y * level * caustic_at(p, n, footprint);
#ifdef VOLUME
        sun *= exp(-cloud_sun_depth(p));
#endif
    }
    if part < 1.0 {
        sun += (1.0 - part) * max(dot(n, shading.sun_direction), 0.0) * sunlit(p, n);
    }
    return shading.sun_irradiance * sun;
}
#endif

struct Opaque {
    light: vec3f,
    // Part of it that is sunlight from the caustics map.
    caustics: vec3f,
}

// Radiance of opaque geometry under the light that the water above it transmits.
fn opaque_radiance(ray: Ray, found: Found) -> Opaque {
    let p = ray.origin + ray.direction * found.t;
    let n = select(found.normal, -found.normal, dot(found.normal, ray.direction) > 0.0);
    let depth = water_above(p) / shading.sun_path;
    let footprint = (ray.travelled + found.t) / camera.focal;
    let at = Surface(p, n, material_of(found.material), found.triangle);
#ifdef WET
    in_air = !ray.inside;
#endif
#ifdef CAUSTICS
    if ray.inside {
        let sun = sun_under_water(p, n, footprint);
        let light = radiance_under(at, -ray.direction, footprint, depth, sun);
        var dark = light;
#ifdef LIGHTS
        dark = radiance_under(at, -ray.direction, footprint, depth, vec3f(0.0));
#endif
        return Opaque(light, light - dark);
    }
#endif
    return Opaque(radiance_of(at, -ray.direction, footprint, depth), vec3f(0.0));
}

#ifdef VOLUME
// Adds the light that drops or bubbles in front of a hit at `far` scatter along the ray, and
// returns their transmittance. Drops in air in front of the eye are splatted instead.
fn veil(ray: Ray, found: Found, far: f32, light: ptr<function, vec3f>) -> f32 {
    var kept = 1.0;
    if ray.inside {
        let passed = cloud_along(ray.origin, ray.direction, 0.0, far, BUBBLES);
        if passed.cover > 0.0 {
            let mean = passed.far / passed.cover;
            let p = ray.origin + ray.direction * mean;
            let seen = bubbles_radiance(p, -ray.direction, passed.depth, passed.lit / passed.cover);
            let white = ray.weight * passed.cover * seen
                * exp(-(shading.absorption + shading.scattering) * mean);
            let before = ray.weight * passed.cover * scattered(ray.origin, ray.direction, mean);
            *light += white + before;
            light_part(part_of(ray, FOAM_LIGHT), white);
            light_part(part_of(ray, SCATTERING), before);
            kept = 1.0 - passed.cover;
        }
    } else if ray.surfaces > 0u {
        let skin = select(0.0, cloud.skin, found.kind == WATER);
        let passed = cloud_along(ray.origin, ray.direction, 0.0, far + skin, DROPS);
        if passed.cover > 0.0 {
            let mean = passed.far / passed.cover;
            let p = ray.origin + ray.direction * mean;
            let seen = drops_radiance(p, -ray.direction, passed.depth, passed.lit / passed.cover);
            let white = ray.weight * passed.cover * hazed(seen, mean, ray.direction);
            *light += white;
            light_part(part_of(ray, WHITE), white);
            kept = 1.0 - passed.cover;
        }
    }
    return kept;
}
#endif

// Radiance and coverage along a ray from `origin`, in air or water, that has travelled `travelled`
// metres from the eye without a hit. Its first hit is known to be before `known`, or to be none
// where that is 0.
fn radiance_along(
    origin: vec3f, direction: vec3f, inside: bool, travelled: f32, known: f32,
) -> vec4f {
    var reach = known;
    var waiting: array<Ray, WAITING>;
    var held = 1;
    waiting[0] = Ray(origin, inside, direction, vec3f(1.0), travelled, 0u, SKYLIGHT);
    var light = vec3f(0.0);
    var alpha = 1.0;
    for (var k = 0; k < MOST_RAYS && held > 0; k++) {
        held -= 1;
        let ray = waiting[held];
        let found = trace(
            ray.origin, ray.direction, ray.inside, ray.travelled,
            select(FAR, reach, ray.surfaces == 0u));
        if ray.surfaces == 0u && found.kind == SKY && reach > 0.0 && reach < FAR {
            // The known hit is a sheet thinner than a step that was missed: traces the ray again
            // without a bound.
            reach = FAR;
            held = 1;
            continue;
        }
        if HOLDS_OUT && ray.surfaces == 0u && !ray.inside && found.kind == OPAQUE {
            return vec4f(0.0);
        }
        // The first segment covers the whole path from the eye, wherever tracing began.
        let far = min(found.t + select(0.0, ray.travelled, ray.surfaces == 0u), 100.0 * endless());
        var weight = ray.weight;
#ifdef VOLUME
        weight *= veil(ray, found, far, &light);
#endif
        if ray.inside {
            let gained = weight * scattered(ray.origin, ray.direction, far);
            light += gained;
            light_part(part_of(ray, SCATTERING), gained);
            weight *= exp(-(shading.absorption + shading.scattering) * far);
        } else if found.kind != SKY {
            let air = weight * hazed(vec3f(0.0), far, ray.direction);
            light += air;
            light_part(part_of(ray, SKYLIGHT), air);
            weight *= exp(-far / shading.haze);
        }
        if found.kind == SKY {
            var sky = sky_radiance(ray.direction);
            if ray.surfaces == 0u {
                let disc = disc_radiance(ray.direction);
                light_part(SKYLIGHT, weight * sky * shading.background);
                light_part(SUN, weight * disc * shading.background);
                sky = (sky + disc) * shading.background;
                alpha = shading.background;
            } else {
                light_part(ray.part, weight * sky);
            }
            light += weight * sky;
            continue;
        }
        if found.kind == OPAQUE {
            let opaque_one = opaque_radiance(ray, found);
            let seen = weight * opaque_one.light;
            light += seen;
            light_part(part_of(ray, SOLIDS), seen);
#ifdef CAUSTICS
            light_part(part_of(ray, SOLIDS), -weight * opaque_one.caustics);
            light_part(CAUSTICS, weight * opaque_one.caustics);
#endif
            continue;
        }
        let split = split_at(ray, found);
        let p = ray.origin + ray.direction * found.t;
#ifdef FOAM_LAYER
        let slant = max(abs(dot(found.normal, ray.direction)), 0.1);
        let cover = foam_cover(
            p, found.normal, (ray.travelled + found.t) / camera.focal / sqrt(slant));
        if cover > 0.0 {
            let foam = weight * cover * foam_radiance(p, found.normal, ray.inside);
            light += foam;
            light_part(part_of(ray, FOAM_LIGHT), foam);
            weight *= 1.0 - cover;
        }
#endif
        if !ray.inside {
            let sun = weight * shading.sun_irradiance * sunlit(p, vec3f(0.0, 1.0, 0.0))
                * glitter(split.normal, -ray.direction, shading.sun_direction, split.variance,
                    shading.index);
            light += sun;
            light_part(part_of(ray, SUN), sun);
        }
        if ray.surfaces >= MOST_SURFACES {
            let rest = weight * sky_irradiance(vec3f(0.0, 1.0, 0.0)) / PI;
            light += rest;
            light_part(ray.part, rest);
            continue;
        }
        var mirror = split.reflectance;
        let least = select(LEAST_BRANCH, LEAST_LATER_BRANCH, ray.surfaces > 0u);
        if strongest(weight) * mirror < least && mirror < 0.5 {
            mirror = 0.0;
        } else if strongest(weight) * (1.0 - mirror) < least {
            mirror = 1.0;
        }
        let travelled = ray.travelled + found.t;
        let before = ray.origin + ray.direction * found.before;
        let after = ray.origin + ray.direction * found.after;
        let surfaces = ray.surfaces + 1u;
        let mirrored = part_of(ray, REFLECTION);
        let bent = part_of(ray, REFRACTION);
        let reflected = Ray(
            before, ray.inside, split.mirrored, weight * mirror, travelled, surfaces, mirrored);
        let through = Ray(after, !ray.inside, split.refracted, weight * (1.0 - mirror), travelled,
            surfaces, bent);
        // The stronger branch and its descendants are traced first. Without stack space for the
        // weaker one, the stronger one takes over its weight.
        let is_mirror = mirror > 0.5;
        var next = through;
        var later = reflected;
        if is_mirror {
            next = reflected;
            later = through;
        }
        if strongest(later.weight) > 0.0 {
            if held < WAITING - 1 {
                waiting[held] = later;
                held += 1;
            } else {
                next.weight = weight;
            }
        }
        waiting[held] = next;
        held += 1;
    }
    // Pending rays see the sky's mean.
    for (var k = 0; k < held; k++) {
        let rest = waiting[k].weight * sky_irradiance(vec3f(0.0, 1.0, 0.0)) / PI;
        light += rest;
        light_part(waiting[k].part, rest);
    }
    return vec4f(light, alpha);
}
