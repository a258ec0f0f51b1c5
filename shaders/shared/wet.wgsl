// Solids under a film of water. The importing shader must bind `set_triangles` and the bindings of
// ssfr_light.wgsl, and import ssfr_solid.wgsl.

// Whether the surface is seen in air. In water it has no film that reflects.
var<private> in_air: bool = true;

// Wetness of a triangle at `p`, linear between its corners.
fn wetness_at(index: u32, p: vec3f) -> f32 {
    if index == NO_TRIANGLE {
        return 0.0;
    }
    let triangle = set_triangles[index];
    let ab = triangle.b - triangle.a;
    let ac = triangle.c - triangle.a;
    let ap = p - triangle.a;
    let n = cross(ab, ac);
    let b = dot(cross(ap, ac), n) / dot(n, n);
    let c = dot(cross(ab, ap), n) / dot(n, n);
    let corners = unpack4x8unorm(triangle.material).yzw;
    return clamp(dot(corners, vec3f(1.0 - b - c, b, c)), 0.0, 1.0);
}

// Root mean square cosine to a direction, at `cosine` to the surface, of the facets of a film whose
// slopes along the direction have a mean square of half that in all: near grazing incidence a rough
// film mirrors less than a smooth one.
fn facet_cosine(cosine: f32) -> f32 {
    let c = clamp(cosine, 0.0, 1.0);
    return sqrt(c * c + 0.5 * shading.film.y * (1.0 - c * c));
}

// Radiance of a surface of diffuse reflectance `albedo` under a film (Ångström 1925; Lekner
// and Dorf 1988). The film's surface reflects a part p = `film.x` of the diffuse light from below
// back to the material, so that only 1/(n² (1 − p albedo)) of the reflected radiance leaves, n the
// index of refraction; n² (1 − p) is the transmittance for diffuse light from above. In air the
// surface also reflects sky and sun.
fn wet_radiance(
    normal: vec3f, view: vec3f, albedo: vec3f, sun: vec3f, sky: vec3f, open: f32,
) -> vec3f {
    let index = shading.index;
    let trapped = shading.film.x;
    let below = albedo / (index * index * (1.0 - trapped * albedo)) / PI;
    if !in_air {
        return below * (sun + sky);
    }
    let facing_sun = max(dot(normal, shading.sun_direction), 0.0);
    let entering = sun * (1.0 - fresnel(facet_cosine(facing_sun), index))
        + sky * (index * index * (1.0 - trapped));
    let mirror = fresnel(facet_cosine(dot(view, normal)), index);
    let bright = sun / max(facing_sun, 0.01)
        * glitter(normal, view, shading.sun_direction, shading.film.y, index);
    let sky_seen = sky_radiance(reflect(-view, normal)) * open;
    return below * entering * (1.0 - mirror) + mirror * sky_seen + bright;
}
