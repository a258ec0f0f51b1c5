// Sun, sky, shadows and haze. The importing shader must bind `shading`, `sky`, `sky_sampler`,
// `shadow_map` and `shadow_sampler`.
#import "shared/ssfr_optics.wgsl"
#ifdef VOLUME
#import "shared/rays_cloud.wgsl"
#endif

struct Shading {
    // Unit vector towards the sun.
    sun_direction: vec3f,
    roughness: f32,
    // Irradiance of the sun on a face perpendicular to it.
    sun_irradiance: vec3f,
    index: f32,
    absorption: vec3f,
    // Metres of water that sunlight passes through per metre of depth.
    sun_path: f32,
    scattering: vec3f,
    // Particle spacing, metres.
    spacing: f32,
    ground_colour: vec3f,
    ground_variation: f32,
    solid_colour: vec3f,
    haze: f32,
    // Ripples, with RIPPLES: longest wavelength, m, and root mean square slope.
    ripple: vec2f,
    // Windows, with WINDOWS: heights of storeys and widths of bays, metres.
    windows: vec2f,
    // Fraction of the windows that are lit, and their radiance.
    window_lit: f32,
    window_radiance: f32,
    // 1 where the sky is part of the picture.
    background: f32,
    // Radiance of the sun's disc over its irradiance, 1/sr; 0 for a panorama, which contains the
    // disc.
    disc: f32,
    // Longer horizontal side of the domain, metres; lengths of the surroundings scale with it.
    extent: f32,
    // Offset along the normal of shadow lookups, metres.
    shadow_offset: f32,
    // Film of water on wet solids, with WET: the fraction of diffuse light from below that its
    // surface reflects, and the mean square slope of that surface.
    film: vec2f,
    // Irradiance of sky and ground by direction: nine spherical-harmonics coefficients (Ramamoorthi
    // 2001).
    irradiance: array<vec4f, 9>,
    shadow_from_world: mat4x4f,
}

// Distance that counts as infinite, metres.
fn endless() -> f32 {
    return 400.0 * shading.extent;
}

fn sky_radiance(direction: vec3f) -> vec3f {
    let d = normalize(direction);
    let uv = vec2f(atan2(d.z, d.x) / (2.0 * PI) + 0.5, acos(clamp(d.y, -1.0, 1.0)) / PI);
    return textureSampleLevel(sky, sky_sampler, uv, 0.0).rgb;
}

// Radiance of the sun's disc, which has an angular radius of 0.2666°.
fn disc_radiance(direction: vec3f) -> vec3f {
    if dot(direction, shading.sun_direction) > 0.99998918 {
        return min(shading.sun_irradiance * shading.disc, vec3f(60000.0));
    }
    return vec3f(0.0);
}

fn sky_irradiance(n: vec3f) -> vec3f {
    let c = &shading.irradiance;
    return max(
        (*c)[0].rgb
            + (*c)[1].rgb * n.y + (*c)[2].rgb * n.z + (*c)[3].rgb * n.x
            + (*c)[4].rgb * (n.x * n.y) + (*c)[5].rgb * (n.y * n.z)
            + (*c)[6].rgb * (3.0 * n.z * n.z - 1.0)
            + (*c)[7].rgb * (n.x * n.z) + (*c)[8].rgb * (n.x * n.x - n.y * n.y),
        vec3f(0.0),
    );
}

// Fraction of the sunlight that reaches a point. The normal `n` keeps a face out of its own shadow.
fn sunlit(world: vec3f, n: vec3f) -> f32 {
    var seen = unshaded(world, n);
#ifdef VOLUME
    if seen > 0.0 {
        seen *= exp(-cloud_sun_depth(world));
    }
#endif
    return seen;
}

// 1 in the sun, 0 in the shadow of a solid.
fn unshaded(world: vec3f, n: vec3f) -> f32 {
    let p = (shading.shadow_from_world * vec4f(world + shading.shadow_offset * n, 1.0)).xyz;
    let uv = vec2f(0.5 * p.x + 0.5, 0.5 - 0.5 * p.y);
    if any(uv <= vec2f(0.0)) || any(uv >= vec2f(1.0)) {
        return 1.0;
    }
    let texel = 0.7 / vec2f(textureDimensions(shadow_map));
    var sum = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let offset = texel * (vec2f(f32(i & 1u), f32(i >> 1u)) * 2.0 - 1.0);
        sum += textureSampleCompareLevel(shadow_map, shadow_sampler, uv + offset, p.z - 0.0004);
    }
    return 0.25 * sum;
}

// Blends a colour at a distance towards the sky's colour at the horizon in that direction.
fn hazed(colour: vec3f, distance: f32, direction: vec3f) -> vec3f {
    return mix(sky_radiance(at_horizon(direction)), colour, air_between(distance));
}

// Transmittance of air over a distance.
fn air_between(distance: f32) -> f32 {
    return exp(-distance / shading.haze);
}

// Direction at the horizon with the same azimuth.
fn at_horizon(direction: vec3f) -> vec3f {
    let level = normalize(vec3f(direction.x, 0.0, direction.z) + vec3f(1e-4, 0.0, 0.0));
    return vec3f(level.x, 0.0, level.z);
}

// Diffusely scattered radiance per unit albedo of light that enters water or foam through a surface
// with this normal; `lit` is the fraction of sunlight that arrives.
fn diffuse_light(n: vec3f, lit: f32) -> vec3f {
    let sun = shading.sun_irradiance * max(dot(n, shading.sun_direction), 0.0) * lit;
    return (sun + sky_irradiance(n)) / PI;
}

// Diffuse reflectance of deep water with its single-scattering albedo (Hapke 1981, equation 38).
fn deep_albedo() -> vec3f {
    let extinction = shading.absorption + shading.scattering;
    let g = sqrt(shading.absorption / max(extinction, vec3f(1e-6)));
    return select(vec3f(0.0), (1.0 - g) / (1.0 + g), extinction > vec3f(0.0));
}
