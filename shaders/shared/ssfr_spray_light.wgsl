// Light that spray scatters to the eye: a cloud of drops that take nothing up. Needs what ssfr_light.wgsl needs.
#import "shared/ssfr_light.wgsl"

// Drops fly in clumps and threads that the sums smear out: light meets in them so many times the optical depth of the mean. By eye.
const CLUMPED: f32 = 8.0;

// (1 − exp(−x)) / x: of light that comes through a cloud evenly, the part that meets nothing more. Where x is small the difference
// shows what exp is rounded by: there by its series, off by x⁴ / 120.
fn unmet(x: f32) -> f32 {
    let series = 1.0 - x * (0.5 - x * (1.0 / 6.0 - x / 24.0));
    return select((1.0 - exp(-x)) / max(x, 0.1), series, x < 0.1);
}

// Per steradian, of sunlight that a cloud scatters towards the eye; `cosine` is that between the ways to the sun and to the eye, `lit` that
// between the way to the sun and the normal of the cloud's near side.
// Light that was scattered once goes by the drops' phase; light that was scattered more often goes anywhere from a thin cloud and as
// from a white wall from a thick one, which is told by the optical depth that is left of scattering that goes mostly onward
// (similarity: van de Hulst 1980). Each of the three has the integral 1, so that a cloud gives what it takes at any depth.
fn cloud_phase(cosine: f32, lit: f32, optical_depth: f32) -> f32 {
    let onward = mix(AHEAD, BACK, BACKWARD);
    let thin = unmet((1.0 - onward) * optical_depth);
    let often = mix(max(lit, 0.0) / PI, 0.25 / PI, thin);
    return mix(often, drop_phase(-cosine), unmet(CLUMPED * optical_depth));
}

// Radiance of spray over its cover towards `view`; its near side faces `facing`, and `lit` of the sunlight comes to it. Under an even sky it
// is the sky's.
fn spray_radiance(view: vec3f, facing: vec3f, optical_depth: f32, lit: f32) -> vec3f {
    let phase = cloud_phase(dot(view, shading.sun_direction), dot(facing, shading.sun_direction), optical_depth);
    let sun = shading.sun_irradiance * lit * phase;
    // A thin cloud sees the whole sky and what is below it, a thick one what its near side looks at.
    let around = shading.irradiance[0].rgb;
    return sun + mix(around, sky_irradiance(facing), 1.0 - exp(-optical_depth)) / PI;
}
