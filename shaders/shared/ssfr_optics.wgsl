// Optics of water.

const PI: f32 = 3.14159265;

// Unpolarised Fresnel reflectance from air onto a medium of refractive index n, c = cosine of
// incidence. Exact: Schlick's approximation is off by 0.06 near grazing incidence, at which waves
// are seen.
fn fresnel(c: f32, n: f32) -> f32 {
    let ct = sqrt(max(1.0 - (1.0 - c * c) / (n * n), 0.0));
    let s = (c - n * ct) / (c + n * ct);
    let p = (n * c - ct) / (n * c + ct);
    return 0.5 * (s * s + p * p);
}

// GGX facet density and Smith's masking with α² = 2 × the mean square slope, times the Fresnel
// reflectance, over 4 (n·v)(n·l), times n·l: reflected radiance over the irradiance of a distant
// light on a perpendicular face.
fn glitter(n: vec3f, v: vec3f, l: vec3f, slope_variance: f32, index: f32) -> f32 {
    let nl = dot(n, l);
    let nv = max(dot(n, v), 0.02);
    if nl <= 0.0 {
        return 0.0;
    }
    let h = normalize(v + l);
    let a2 = clamp(2.0 * slope_variance, 1e-5, 1.0);
    let nh = clamp(dot(n, h), 0.0, 1.0);
    let t = nh * nh * (a2 - 1.0) + 1.0;
    let density = a2 / (PI * t * t);
    let mask_l = nl + sqrt(a2 + (1.0 - a2) * nl * nl);
    let mask_v = nv + sqrt(a2 + (1.0 - a2) * nv * nv);
    return density * fresnel(clamp(dot(v, h), 0.0, 1.0), index) * nl / (mask_l * mask_v);
}

// Two Henyey-Greenstein lobes (1941). Light refracted and reflected by water drops has a mean
// cosine of 0.77: large drops have 0.885 in total (van de Hulst 1957), but half of that light is
// diffracted forward and indistinguishable from unscattered light. 0.93 · 0.85 − 0.07 · 0.3 = 0.77,
// with a fraction of reflected light going backward.
const AHEAD: f32 = 0.85;
const BACK: f32 = -0.3;
const BACKWARD: f32 = 0.07;

fn lobe(g: f32, cosine: f32) -> f32 {
    let s = max(1.0 + g * g - 2.0 * g * cosine, 1e-6);
    return (1.0 - g * g) / (4.0 * PI * s * sqrt(s));
}

// Phase function, 1/sr, by the cosine between the directions before and after scattering; its
// integral over the sphere is 1.
fn drop_phase(cosine: f32) -> f32 {
    return mix(lobe(AHEAD, cosine), lobe(BACK, cosine), BACKWARD);
}
