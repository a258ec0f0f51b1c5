// Light that spray scatters towards the eye: a cloud of drops without absorption. Needs the
// bindings of ssfr_light.wgsl.
#import "shared/ssfr_light.wgsl"

// Drops fly in clumps and threads that the sums blur: the optical depth within them is this
// multiple of the mean. Chosen by eye.
const CLUMPED: f32 = 8.0;

// (1 − exp(−x)) / x: fraction of light emitted uniformly along a path that leaves without another
// event. For small x a series, off by x⁴ / 120, avoids the rounding of exp in the difference.
fn unmet(x: f32) -> f32 {
    let series = 1.0 - x * (0.5 - x * (1.0 / 6.0 - x / 24.0));
    return select((1.0 - exp(-x)) / max(x, 0.1), series, x < 0.1);
}

// Sunlight that a cloud scatters towards the eye, 1/sr; `cosine` is that of the angle between the
// directions to the sun and to the eye, `lit` that of the angle between the sun and the normal of
// the cloud's near side.
//
// Singly scattered light follows the drops' phase function. Multiply scattered light is isotropic
// in a thin cloud and Lambertian in a thick one, as decided by the optical depth reduced for
// predominantly forward scattering (similarity relation: van de Hulst 1980). Each of the three
// distributions integrates to 1, so that a cloud conserves energy at any depth.
fn cloud_phase(cosine: f32, lit: f32, optical_depth: f32) -> f32 {
    let onward = mix(AHEAD, BACK, BACKWARD);
    let thin = unmet((1.0 - onward) * optical_depth);
    let often = mix(max(lit, 0.0) / PI, 0.25 / PI, thin);
    return mix(often, drop_phase(-cosine), unmet(CLUMPED * optical_depth));
}

// Radiance of spray over its coverage towards `view`; its near side faces `facing`, and `lit` is
// the fraction of sunlight that arrives. Under a uniform sky it equals the sky's radiance.
fn spray_radiance(view: vec3f, facing: vec3f, optical_depth: f32, lit: f32) -> vec3f {
    let phase = cloud_phase(
        dot(view, shading.sun_direction), dot(facing, shading.sun_direction), optical_depth);
    let sun = shading.sun_irradiance * lit * phase;
    // A thin cloud sees the whole sky and what is below it; a thick one the hemisphere of its near
    // side.
    let around = shading.irradiance[0].rgb;
    return sun + mix(around, sky_irradiance(facing), 1.0 - exp(-optical_depth)) / PI;
}
