// Light that drops and bubbles on a ray's way scatter along it. Needs what rays_light.wgsl needs.
#import "shared/rays_cloud.wgsl"
#import "shared/ssfr_spray_light.wgsl"

// Radiance over irradiance, deep in the light, of a white body whose light goes as Lommel and Seeliger say, so that a ball of it gives
// back all that it takes: 3 / (8 π (1 − ln 2)).
const WHITE_BODY: f32 = 0.38899;

// Per steradian, of sunlight that comes to drops. As `cloud_phase`, but that the way through them shades a thick cloud, and not the
// phase of a ball that shades itself.
fn shaded_phase(cosine: f32, optical_depth: f32) -> f32 {
    let onward = mix(AHEAD, BACK, BACKWARD);
    let often = mix(WHITE_BODY, 0.25 / PI, unmet((1.0 - onward) * optical_depth));
    return mix(often, drop_phase(-cosine), unmet(CLUMPED * optical_depth));
}

// Radiance over their cover of drops in air; `lit` is the part of the sunlight that other drops let through to them.
fn drops_radiance(position: vec3f, view: vec3f, optical_depth: f32, lit: f32) -> vec3f {
    let phase = shaded_phase(dot(view, shading.sun_direction), optical_depth);
    let sun = shading.sun_irradiance * unshaded(position, vec3f(0.0, 1.0, 0.0)) * phase * lit;
    let around = shading.irradiance[0].rgb;
    return sun + mix(around, sky_irradiance(view), 1.0 - exp(-optical_depth)) / PI;
}

// The same of bubbles in water, in what light the water above lets through.
fn bubbles_radiance(position: vec3f, view: vec3f, optical_depth: f32, lit: f32) -> vec3f {
    let extinction = shading.absorption + shading.scattering;
    let above = water_above(position);
    let up = vec3f(0.0, 1.0, 0.0);
    let level = shading.sun_direction.xz / shading.index;
    let towards = vec3f(level.x, sqrt(1.0 - dot(level, level)), level.y);
    let phase = shaded_phase(dot(view, towards), optical_depth);
    let beam = shading.sun_irradiance * max(shading.sun_direction.y, 0.0) * shading.sun_path;
    let sun = beam * unshaded(position, up) * phase * lit * exp(-extinction * above);
    return sun + sky_irradiance(up) / PI * exp(-extinction * above / shading.sun_path);
}
