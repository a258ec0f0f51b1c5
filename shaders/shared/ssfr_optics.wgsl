// What happens to light at and in water.

const PI: f32 = 3.14159265;

// Unpolarised reflectance from air onto a medium of refractive index n, c = cosine of incidence.
// Exact: Schlick's fit is off by 0.06 near grazing, where waves are seen.
fn fresnel(c: f32, n: f32) -> f32 {
    let ct = sqrt(max(1.0 - (1.0 - c * c) / (n * n), 0.0));
    let s = (c - n * ct) / (c + n * ct);
    let p = (n * c - ct) / (n * c + ct);
    return 0.5 * (s * s + p * p);
}

// GGX facet density and Smith's masking with α² = 2 × the mean square slope, times the Fresnel reflectance,
// over 4 (n·v)(n·l), times n·l: reflected radiance over the irradiance of a distant light at right angles.
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

// Two lobes of Henyey and Greenstein 1941. Refracted and mirrored light of water drops has a mean cosine of 0.77: large drops have
// 0.885 in all (van de Hulst 1957), of which half is diffracted straight on and cannot be told from light that met nothing.
// 0.93 · 0.85 − 0.07 · 0.3 = 0.77, and a part of the mirrored light comes back.
const AHEAD: f32 = 0.85;
const BACK: f32 = -0.3;
const BACKWARD: f32 = 0.07;

fn lobe(g: f32, cosine: f32) -> f32 {
    let s = max(1.0 + g * g - 2.0 * g * cosine, 1e-6);
    return (1.0 - g * g) / (4.0 * PI * s * sqrt(s));
}

// Per steradian, over the cosine between ways before and after; its integral over all ways is 1.
fn drop_phase(cosine: f32) -> f32 {
    return mix(lobe(AHEAD, cosine), lobe(BACK, cosine), BACKWARD);
}
