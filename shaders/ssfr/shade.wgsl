// One sample of the picture: sky, ground and solids, and the water before them. With AOVS, the channels
// that stand beside the picture instead.
#import "shared/camera.wgsl"
#import "shared/ssfr_band.wgsl"
#import "shared/ssfr_half.wgsl"
#import "shared/ssfr_solid.wgsl"
#import "shared/ssfr_optics.wgsl"
#import "shared/ssfr_light.wgsl"
#import "shared/ssfr_facet.wgsl"
#ifdef AOVS
#import "shared/ssfr_aovs.wgsl"
#endif

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> shading: Shading;
@group(0) @binding(2) var<uniform> band: Band;
@group(0) @binding(3) var<storage, read> surface: array<f32>;
@group(0) @binding(4) var<storage, read> thickness: array<u32>;
@group(0) @binding(5) var<storage, read> solid_depth: array<f32>;
@group(0) @binding(6) var<storage, read> solid_packed: array<u32>;
@group(0) @binding(7) var sky: texture_2d<f32>;
@group(0) @binding(8) var sky_sampler: sampler;
@group(0) @binding(9) var shadow_map: texture_depth_2d;
@group(0) @binding(10) var shadow_sampler: sampler_comparison;
#ifdef AOVS
// Ten floats a pixel: Z, N, P, forward, thickness.
@group(0) @binding(11) var<storage, read_write> output: array<f32>;
@group(0) @binding(12) var<storage, read> owner: array<u32>;
@group(0) @binding(13) var<storage, read> particles: array<Particle>;
@group(0) @binding(14) var<uniform> next_camera: Camera;
#else
@group(0) @binding(11) var<storage, read_write> output: array<vec4f>;
#ifdef SPRAY
@group(0) @binding(12) var<storage, read> spray: array<u32>;
#endif
#endif

fn surface_at(pixel: vec2i) -> f32 {
    if any(pixel < vec2i(0)) || any(pixel >= vec2i(camera.size)) {
        return FAR;
    }
    return surface[u32(pixel.y) * camera.size.x + u32(pixel.x)];
}

fn eye_at(pixel: vec2i, z: f32) -> vec3f {
    return eye_ray(camera, vec2f(pixel) + 0.5) * z;
}

// One-sided difference of eye positions, along `step`, on the side where the depth changes less:
// the other side may be another surface.
fn difference(pixel: vec2i, z: f32, step: vec2i) -> vec3f {
    let after = surface_at(pixel + step);
    let before = surface_at(pixel - step);
    let here = eye_at(pixel, z);
    if abs(after - z) <= abs(z - before) {
        return eye_at(pixel + step, after) - here;
    }
    return here - eye_at(pixel - step, before);
}

// Eye-space normal, towards the viewer.
fn surface_normal(pixel: vec2i, z: f32) -> vec3f {
    let across = difference(pixel, z, vec2i(1, 0));
    let down = difference(pixel, z, vec2i(0, 1));
    let n = cross(across, down);
    let ray = eye_at(pixel, z);
    // A lone pixel without neighbours has no differences: it faces the viewer.
    if max(abs(across.z), abs(down.z)) >= 0.1 * FAR {
        return -normalize(ray);
    }
    return normalize(select(n, -n, dot(n, ray) > 0.0));
}

fn thickness_at(position: vec2f) -> f32 {
    let tap = half_tap(position);
    var words = vec4u(thickness[tap.at.x], thickness[tap.at.y], thickness[tap.at.z], thickness[tap.at.w]);
    return half_load(&words, tap.part);
}

// Distance along a world ray to the ground, FAR where there is none; the floor is at y = 0.
fn ground_distance(origin: vec3f, direction: vec3f) -> f32 {
    if direction.y > -1e-5 || origin.y <= 0.0 {
        return FAR;
    }
    return -origin.y / direction.y;
}

fn solid_surface(at: u32, eye: vec3f, view: vec3f) -> Surface {
    let word = solid_packed[at];
    let n = unpack_normal(word);
    return Surface(world_from_eye(camera, eye), select(n, -n, dot(n, view) < 0.0), word >> 24u);
}

struct Behind {
    // Along the optical axis; FAR in the sky.
    depth: f32,
    // Metres to the eye.
    far: f32,
    surface: Surface,
}

// What stands at this pixel where there is no water.
fn behind(pixel: vec2i, ray: vec3f, direction: vec3f) -> Behind {
    let at = u32(pixel.y) * camera.size.x + u32(pixel.x);
    let solid = solid_depth[at];
    let along = length(ray);
    let ground = ground_distance(camera.position, direction) / along;
    if solid < min(ground, FAR) {
        return Behind(solid, solid * along, solid_surface(at, ray * solid, -direction));
    }
    if ground < 0.1 * FAR {
        let far = ground * along;
        let up = vec3f(0.0, 1.0, 0.0);
        return Behind(ground, far, Surface(camera.position + direction * far, up, 2u));
    }
    return Behind(FAR, FAR, Surface(vec3f(0.0), vec3f(0.0), 3u));
}

fn behind_radiance(found: Behind, direction: vec3f) -> vec3f {
    if found.depth < 0.1 * FAR {
        let colour = radiance_of(found.surface, -direction, found.far / camera.focal, 0.0);
        return hazed(colour, found.far, direction);
    }
    var colour = sky_radiance(direction);
    // Half of the sun's angle across: 0.2666°.
    if dot(direction, shading.sun_direction) > 0.99998918 {
        colour += min(shading.sun_irradiance * shading.disc, vec3f(60000.0));
    }
    return colour * shading.background;
}

struct March {
    // World distance; FAR where nothing was hit.
    distance: f32,
    at: u32,
    eye: vec3f,
}

// Walks a ray over the depth image of the solids. A hit lies just behind that surface, a few spacings or steps at
// most; things nearer to the viewer than `nearest` stand before the water and are no hit.
fn march(origin: vec3f, direction: vec3f, reach: f32, steps: i32, growth: f32, nearest: f32) -> March {
    var last = 0.0;
    // First step of a geometric row of `steps` steps that ends at `reach`.
    var step = reach / f32(steps);
    if growth > 1.0 {
        step = reach * (growth - 1.0) / (pow(growth, f32(steps)) - 1.0);
    }
    for (var i = 0; i < steps; i++) {
        let t = last + step;
        let q = origin + direction * t;
        if q.z < camera.near {
            break;
        }
        let pixel = vec2i(floor(project(camera, q)));
        if any(pixel < vec2i(0)) || any(pixel >= vec2i(camera.size)) {
            break;
        }
        let z = solid_depth[u32(pixel.y) * camera.size.x + u32(pixel.x)];
        if z < q.z && z > nearest && q.z - z < 3.5 * shading.spacing + 1.5 * step {
            return refine(origin, direction, last, t);
        }
        last = t;
        step *= growth;
    }
    return March(FAR, 0u, vec3f(0.0));
}

fn refine(origin: vec3f, direction: vec3f, from_t: f32, to_t: f32) -> March {
    var low = from_t;
    var high = to_t;
    for (var i = 0; i < 5; i++) {
        let middle = 0.5 * (low + high);
        let q = origin + direction * middle;
        let pixel = clamp(vec2i(floor(project(camera, q))), vec2i(0), vec2i(camera.size) - 1);
        let z = solid_depth[u32(pixel.y) * camera.size.x + u32(pixel.x)];
        if z < q.z {
            high = middle;
        } else {
            low = middle;
        }
    }
    let q = origin + direction * high;
    let pixel = clamp(vec2i(floor(project(camera, q))), vec2i(0), vec2i(camera.size) - 1);
    return March(high, u32(pixel.y) * camera.size.x + u32(pixel.x), q);
}

struct Water {
    position: vec3f,
    eye: vec3f,
    normal: vec3f,
    view: vec3f,
    // Mean square slope below the pixel.
    slope_variance: f32,
}

fn mirrored(water: Water) -> vec3f {
    var r = reflect(-water.view, water.normal);
    // A mirrored ray that dips into the water would hit its next wave; it is bent up to the horizon.
    r = normalize(vec3f(r.x, max(r.y, 0.01), r.z));
    let eye_r = vec3f(dot(r, camera.right), dot(r, camera.up), dot(r, camera.forward));
    let start = water.eye + 0.3 * shading.spacing * eye_r;
    let hit = march(start, eye_r, 0.56 * shading.extent, 14, 1.25, 0.0);
    if hit.distance < FAR {
        let found = solid_surface(hit.at, hit.eye, -r);
        return radiance_of(found, -r, hit.eye.z / camera.focal, 0.0);
    }
    return sky_radiance(r);
}

// Light that comes up through the surface.
fn transmitted(water: Water, pixel: vec2i, straight: Behind) -> vec3f {
    let n = shading.index;
    let ci = clamp(dot(water.normal, water.view), 0.0, 1.0);
    let ct = sqrt(max(1.0 - (1.0 - ci * ci) / (n * n), 0.0));
    let t = normalize(refract(-water.view, water.normal, 1.0 / n));
    // Splats measure the straight way; through a sheet the bent one is shorter.
    let seen = thickness_at(vec2f(pixel) + 0.5);
    let path = seen * max(ci, 0.3) / ct;

    var reach = ground_distance(water.position, t);
    var floor_point = water.position + t * min(reach, endless());
    var found = Surface(floor_point, vec3f(0.0, 1.0, 0.0), 2u);
    let eye_t = vec3f(dot(t, camera.right), dot(t, camera.up), dot(t, camera.forward));
    let far = min(reach, 1.4 * seen + 1.8 * shading.spacing);
    let hit = march(water.eye, eye_t, far, 8, 1.0, water.eye.z - 0.6 * shading.spacing);
    if hit.distance < reach {
        reach = hit.distance;
        found = solid_surface(hit.at, hit.eye, -t);
    }
    // Water that ends well before the ray meets anything: a sheet or a crest, through which one looks on
    // almost straight.
    let filled = smoothstep(0.2, 0.5, seen / max(reach, 0.006 * shading.spacing));
    let way = mix(path, min(reach, endless()), filled);
    var light = vec3f(0.0);
    if filled < 1.0 {
        light += behind_radiance(straight, -water.view) * (1.0 - filled);
    }
    if filled > 0.0 {
        let depth = max(water.position.y - found.position.y, 0.0);
        light += radiance_of(found, -t, water.eye.z / camera.focal, depth) * filled;
    }
    let extinction = shading.absorption + shading.scattering;
    let clear = exp(-extinction * way);
    return light * clear + diffuse_light(water.position, water.normal) * deep_albedo() * (1.0 - clear);
}

fn shade_water(pixel: vec2i, z: f32, ray: vec3f, view: vec3f, straight: Behind) -> vec3f {
    let eye = ray * z;
    let position = world_from_eye(camera, eye);
    var normal = world_direction(camera, surface_normal(pixel, z));
    let footprint = z / camera.focal / max(dot(normal, view), 0.1);
    let facet = facet_at(position, normal, footprint);
    // No facet that is seen faces away.
    normal = normalize(facet.normal + view * max(0.03 - dot(facet.normal, view), 0.0) * 1.5);
    let water = Water(position, eye, normal, view, facet.variance);

    let reflectance = fresnel(clamp(dot(normal, view), 0.0, 1.0), shading.index);
    let sun = shading.sun_irradiance * sunlit(position, vec3f(0.0, 1.0, 0.0))
        * glitter(normal, view, shading.sun_direction, facet.variance, shading.index);
    return reflectance * mirrored(water) + (1.0 - reflectance) * transmitted(water, pixel, straight)
        + sun;
}

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= camera.picture.x || id.y >= band.rows {
        return;
    }
    let pixel = vec2i(vec2u(id.x, id.y + band.row) + camera.margin);
    let at = u32(pixel.y) * camera.size.x + u32(pixel.x);
    let out = id.y * camera.picture.x + id.x;
    let ray = eye_ray(camera, vec2f(pixel) + 0.5);
    let direction = normalize(world_direction(camera, ray));
    let view = -direction;
    let straight = behind(pixel, ray, direction);
    let z = surface[at];
    let wet = z < straight.depth && z < 0.1 * FAR;
#ifdef AOVS
    let through = thickness_at(vec2f(pixel) + 0.5);
    if wet {
        let position = world_from_eye(camera, ray * z);
        let normal = world_direction(camera, surface_normal(pixel, z));
        var motion = vec2f(0.0);
        let particle = owner[at];
        if particle < camera.particle_count {
            let moved = position + particles[particle].velocity * camera.frame_seconds;
            motion = motion_to(eye_from_world(next_camera, moved), pixel);
        }
        store(out, z, normal, position, motion, through);
        return;
    }
    let seen = straight.depth < 0.1 * FAR;
    let next = select(sky_in_next(direction), eye_from_world(next_camera, straight.surface.position), seen);
    let motion = motion_to(next, pixel);
    store(out, straight.depth, straight.surface.normal, straight.surface.position, motion, through);
#else
    var colour: vec3f;
    var alpha = 1.0;
    if wet {
        let far = z * length(ray);
        colour = hazed(shade_water(pixel, z, ray, view, straight), far, direction);
    } else {
        colour = behind_radiance(straight, direction);
        if straight.depth >= 0.1 * FAR {
            alpha = shading.background;
        }
    }
#ifdef SPRAY
    let tap = half_tap(vec2f(pixel) + 0.5);
    var words = vec4u(spray[tap.at.x], spray[tap.at.y], spray[tap.at.z], spray[tap.at.w]);
    let cover = 1.0 - exp(-shading.spray_density * half_load(&words, tap.part));
    if cover > 0.0 {
        let where_to = camera.position + direction * min(z, min(straight.depth, endless())) * length(ray);
        let white = diffuse_light(where_to, vec3f(0.0, 1.0, 0.0)) * 0.85;
        colour = mix(colour, white, cover);
        alpha = mix(alpha, 1.0, cover);
    }
#endif
    let value = vec4f(colour, alpha) * camera.weight;
    if camera.sample_index == 0u {
        output[out] = value;
    } else {
        output[out] += value;
    }
#endif
}
