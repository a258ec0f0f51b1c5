// Light that drops and bubbles along a ray scatter towards its origin. Needs the bindings of
// rays_light.wgsl.
#import "shared/rays_cloud.wgsl"
#import "shared/ssfr_spray_light.wgsl"

// Radiance over irradiance of a fully lit white body with Lommel–Seeliger scattering, scaled so
// that a sphere of it reflects all light: 3 / (8 π (1 − ln 2)).
const WHITE_BODY: f32 = 0.38899;

// Sunlight scattered by drops, 1/sr. Like `cloud_phase`, but the path through the drops shades a
// thick cloud instead of the phase function of a self-shadowing sphere.
fn shaded_phase(cosine: f32, optical_depth: f32) -> f32 {
    let onward = mix(AHEAD, BACK, BACKWARD);
    let often = mix(WHITE_BODY, 0.25 / PI, unmet((1.0 - onward) * optical_depth));
    return mix(often, drop_phase(-cosine), unmet(CLUMPED * optical_depth));
}

// Radiance over coverage of drops in air; `lit` is the transmittance of other drops for the
// sunlight that reaches them.
fn drops_radiance(position: vec3f, view: vec3f, optical_depth: f32, lit: f32) -> vec3f {
    let phase = shaded_phase(dot(view, shading.sun_direction), optical_depth);
    let sun = shading.sun_irradiance * unshaded(position, vec3f(0.0, 1.0, 0.0)) * phase * lit;
    let around = shading.irradiance[0].rgb;
    return sun + mix(around, sky_irradiance(view), 1.0 - exp(-optical_depth)) / PI;
}

// The same for bubbles in water, attenuated by the water above.
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
