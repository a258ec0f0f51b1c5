// Light of water seen by splats: what it mirrors, what is in it and behind it, and its foam. Needs
// the bindings and functions of ssfr/shade.wgsl.

struct Water {
    position: vec3f,
    eye: vec3f,
    normal: vec3f,
    // The normal without ripples.
    level: vec3f,
    view: vec3f,
    // Mean square slope of waves below the pixel's resolution.
    slope_variance: f32,
    // Fraction of the sunlight that arrives.
    lit: f32,
}

// Light scattered by water with the transmittance `clear`.
fn body_light(normal: vec3f, lit: f32, clear: vec3f) -> vec3f {
    return diffuse_light(normal, lit) * deep_albedo() * (1.0 - clear);
}

// Hit of a reflected ray.
struct Mirrored {
    way: vec3f,
    hit: March,
    found: Seen,
}

fn mirrored(water: Water) -> Mirrored {
    var r = reflect(-water.view, water.normal);
    // A reflected ray into the water would hit the next wave; it is bent up to the horizon.
    r = normalize(vec3f(r.x, max(r.y, 0.01), r.z));
    let eye_r = vec3f(dot(r, camera.right), dot(r, camera.up), dot(r, camera.forward));
    let start = water.eye + 0.3 * shading.spacing * eye_r;
    let hit = march(start, eye_r, 0.56 * shading.extent, 14, 1.25, 1.0, 0.0);
    return Mirrored(
        r, hit, Seen(hit.at, world_from_eye(camera, hit.eye), -r, hit.eye.z / camera.focal, 0.0));
}

// Light of a reflected ray; `light` is the radiance of the solid it hits, seen through the water
// and spray that the picture has between it and the mirror. That spray faces the mirror and is lit
// like it.
fn mirrored_light(met: Mirrored, water: Water, light: vec3f) -> vec3f {
    if met.hit.distance >= FAR {
        return sky_radiance(met.way);
    }
    let at = met.hit.at;
    let place = vec2f(vec2u(at % camera.size.x, at / camera.size.x)) + 0.5;
    let nearest = water.eye.z;
    let z = surface[at];
    let seen = select(0.0, thickness_at(place), z > nearest && z < met.hit.eye.z);
    let clear = exp(-(shading.absorption + shading.scattering) * seen);
    var colour = light * clear + body_light(vec3f(0.0, 1.0, 0.0), water.lit, clear);
#ifdef SPRAY
    let mist = spray_at(place);
    if mist.depth > nearest && mist.depth < met.hit.eye.z {
        colour = mix(
            colour, spray_radiance(-met.way, -met.way, mist.optical_depth, water.lit), mist.cover);
    }
#endif
    return colour;
}

// Hit of a ray refracted into the water.
struct Bent {
    found: Seen,
    // Metres of water along its path.
    way: f32,
    // 1 where it hits opaque geometry in the water, 0 where the water ends well before that: a
    // sheet or a crest, which hardly deflects the view.
    filled: f32,
}

// `seen` metres of water are on the straight line of sight.
fn bent(water: Water, seen: f32) -> Bent {
    let n = shading.index;
    let ci = clamp(dot(water.normal, water.view), 0.0, 1.0);
    let ct = sqrt(max(1.0 - (1.0 - ci * ci) / (n * n), 0.0));
    let t = normalize(refract(-water.view, water.normal, 1.0 / n));
    // Splats measure the straight path; through a sheet the refracted one is shorter.
    let path = seen * max(ci, 0.3) / ct;

    var reach = ground_distance(water.position, t);
    var at = NO_SOLID;
    let eye_t = vec3f(dot(t, camera.right), dot(t, camera.up), dot(t, camera.forward));
    let far = min(reach, 1.4 * seen + 1.8 * shading.spacing);
    // A refracted ray descends more steeply than the line of sight, so that a step below level
    // ground lies this much farther behind it in depth.
    let deep = max(t.y / min(-water.view.y, -0.02), 1.0);
    let hit = march(water.eye, eye_t, far, 8, 1.0, deep, water.eye.z - 0.6 * shading.spacing);
    if hit.distance < reach {
        reach = hit.distance;
        at = hit.at;
    }
    let filled = smoothstep(0.2, 0.5, seen / max(reach, 0.006 * shading.spacing));
    let straight = min(reach, endless());
    let position = water.position + t * straight;
    let under = max(water.position.y - position.y, 0.0);
    return Bent(Seen(at, position, -t, water.eye.z / camera.focal, under),
        mix(path, straight, filled), filled);
}

// Water at depth `z`, with the normal `smooth_normal` before ripples; `lost` is the mean square
// slope of waves that a pixel there cannot resolve.
fn water_at(z: f32, ray: vec3f, view: vec3f, smooth_normal: vec3f, lost: f32) -> Water {
    let eye = ray * z;
    let position = world_from_eye(camera, eye);
    var normal = smooth_normal;
    let footprint = z / camera.focal / max(dot(normal, view), 0.1);
    let facet = facet_at(position, normal, footprint);
    // Visible facets never face away.
    normal = normalize(facet.normal + view * max(0.03 - dot(facet.normal, view), 0.0) * 1.5);
    let lit = sunlit(position, vec3f(0.0, 1.0, 0.0));
    return Water(position, eye, normal, smooth_normal, view, facet.variance + lost, lit);
}

// Light of water that reflects `mirrored` and transmits `behind`, dimmed along its path.
fn water_light(water: Water, mirrored: vec3f, behind: vec3f, way: f32) -> vec3f {
    let reflectance = fresnel(clamp(dot(water.normal, water.view), 0.0, 1.0), shading.index);
    let sun = shading.sun_irradiance * water.lit
        * glitter(
            water.normal, water.view, shading.sun_direction, water.slope_variance, shading.index);
    let extinction = shading.absorption + shading.scattering;
    let clear = exp(-extinction * way);
    let seen = behind * clear;
    let scattered = body_light(water.normal, water.lit, clear);
    let mirror = reflectance * mirrored;
    light_part(REFLECTION, mirror);
    light_part(REFRACTION, (1.0 - reflectance) * seen);
    light_part(SCATTERING, (1.0 - reflectance) * scattered);
    light_part(SUN, sun);
    return mirror + (1.0 - reflectance) * (seen + scattered) + sun;
}

#ifdef FOAM_LAYER
// Light of water under its foam, which covers `light` in part.
fn foamed(water: Water, light: vec3f) -> vec3f {
    let slant = max(dot(water.level, water.view), 0.1);
    let cover = foam_cover(
        water.position, water.level, water.eye.z / camera.focal / sqrt(slant));
    if cover <= 0.0 {
        return light;
    }
    let foam = cover * foam_radiance(water.position, water.level, false);
    dim_parts(1.0 - cover);
    light_part(FOAM_LIGHT, foam);
    return (1.0 - cover) * light + foam;
}
#endif
