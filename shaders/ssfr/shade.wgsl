// One sample of the picture: sky, ground and solids, and water in front of them, dimmed by spray
// (shade_spray adds the light of the spray). With AOVS, the additional channels instead; with
// OBJECTS, the first visible object.
#import "shared/camera.wgsl"
#import "shared/ssfr_band.wgsl"
#ifdef LISTED
#import "shared/ssfr_tiles.wgsl"
#endif
#import "shared/ssfr_half.wgsl"
#import "shared/ssfr_solid.wgsl"
#import "shared/ssfr_march.wgsl"
#import "shared/ssfr_optics.wgsl"
#import "shared/ssfr_opaque.wgsl"
#import "shared/ssfr_facet.wgsl"
#ifdef AOVS
#import "shared/ssfr_aovs.wgsl"
#else
#ifndef OBJECTS
#import "shared/ssfr_store.wgsl"
#endif
#endif
#ifndef DRY
#import "shared/ssfr_sheet.wgsl"
#endif
#ifdef CARRIED
#import "shared/ssfr_carried.wgsl"
#endif
#ifdef SPRAY
#import "shared/ssfr_spray_read.wgsl"
#import "shared/ssfr_spray_front.wgsl"
#import "shared/ssfr_spray_light.wgsl"
#endif
#ifdef SEA
#import "shared/ssfr_sea.wgsl"
#endif
#ifdef FOAM_LAYER
#import "shared/foam_layer.wgsl"
#endif
#import "shared/ssfr_lights.wgsl"
#import "shared/ssfr_holdout.wgsl"
#import "shared/ssfr_water.wgsl"

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
// Ten floats per pixel: Z, N, P, forward, thickness.
@group(0) @binding(11) var<storage, read_write> output: array<f32>;
@group(0) @binding(12) var<storage, read> owner: array<u32>;
@group(0) @binding(13) var<storage, read> particles: array<Particle>;
@group(0) @binding(14) var<uniform> next_camera: Camera;
#else
#ifdef OBJECTS
// First visible object, and the bits of the fraction that spray covers.
@group(0) @binding(11) var<storage, read_write> output: array<vec2u>;
#else
@group(0) @binding(11) var<storage, read_write> output: array<vec4f>;
#endif
#endif
#ifdef LISTED
@group(0) @binding(23) var<storage, read> tiles: array<u32>;
#endif
#ifdef SPRAY
@group(0) @binding(15) var<storage, read> spray: array<u32>;
@group(0) @binding(16) var<uniform> spray_params: SprayParams;
#endif

#ifdef FOAM_LAYER
@group(0) @binding(25) var<uniform> cloud: Cloud;
@group(0) @binding(26) var<storage, read> cloud_words: array<u32>;
#endif
#ifdef CARRIED
@group(0) @binding(24) var<uniform> carried: array<Carried, 256>;
#endif

#ifdef SEA
@group(0) @binding(18) var<uniform> sea: Sea;
@group(0) @binding(19) var<storage, read> sea_values: array<vec4f>;
#endif
#ifdef PALETTE
@group(0) @binding(17) var<uniform> palette: array<vec4f, 64>;
#endif
#ifdef INDEXED
@group(0) @binding(20) var<storage, read> set_triangles: array<Triangle>;
#endif
#ifdef MATERIALS
@group(0) @binding(21) var<uniform> materials: array<Material, 256>;
@group(0) @binding(22) var solid_texels: texture_2d<f32>;
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

// One-sided difference of eye positions along `step`, on the side where the depth changes less: the
// other side may be another surface.
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
    // A lone pixel has no differences: it faces the viewer.
    if max(abs(across.z), abs(down.z)) >= 0.1 * FAR {
        return -normalize(ray);
    }
    return normalize(select(n, -n, dot(n, ray) > 0.0));
}

fn thickness_at(position: vec2f) -> f32 {
    let tap = half_tap(position);
    var words = vec4u(
        thickness[tap.at.x], thickness[tap.at.y], thickness[tap.at.z], thickness[tap.at.w]);
    return half_load(&words, tap.part);
}

// Distance along a world ray to the ground at y = 0; FAR where there is none.
fn ground_distance(origin: vec3f, direction: vec3f) -> f32 {
    // Bitwise: `||` would be a branch that depends on uniforms only (docs/performance.md).
    if (direction.y > -1e-5) | (origin.y <= 0.0) {
        return FAR;
    }
    return -origin.y / direction.y;
}

// Material code of a pixel's solid, as in ssfr_solid.
fn solid_code(at: u32) -> u32 {
#ifdef INDEXED
    return code_of(set_triangles[solid_packed[at]]);
#else
    return solid_packed[at] >> 24u;
#endif
}

// Surface of the solid visible at a pixel, at a world position.
fn solid_surface(at: u32, position: vec3f, view: vec3f) -> Surface {
    let word = solid_packed[at];
#ifdef INDEXED
    let triangle = set_triangles[word];
    let n = normalize(cross(triangle.b - triangle.a, triangle.c - triangle.a));
    let named = word;
#else
    let n = unpack_normal(word);
    let named = NO_TRIANGLE;
#endif
    return Surface(position, select(n, -n, dot(n, view) < 0.0), material_of(solid_code(at)), named);
}

// In place of a pixel's index: the ground rather than a solid.
const NO_SOLID: u32 = 0xffffffffu;

// Opaque point that may need shading: the pixel of its solid, or NO_SOLID for the ground; its world
// position, the direction to the viewer, a pixel's size there, and the metres of water above it.
struct Seen {
    at: u32,
    position: vec3f,
    view: vec3f,
    footprint: f32,
    under: f32,
}

fn surface_of(seen: Seen) -> Surface {
    let ground = Surface(seen.position, vec3f(0.0, 1.0, 0.0), 2u, NO_TRIANGLE);
#ifdef BARE
    return ground;
#else
    if seen.at == NO_SOLID {
        return ground;
    }
    return solid_surface(seen.at, seen.position, seen.view);
#endif
}

fn light_of(seen: Seen) -> vec3f {
    return radiance_of(surface_of(seen), seen.view, seen.footprint, seen.under);
}

struct Behind {
    // Along the optical axis; FAR in the sky.
    depth: f32,
    // Distance to the eye, metres.
    far: f32,
    seen: Seen,
}

// What this pixel shows without water.
fn behind(pixel: vec2i, ray: vec3f, direction: vec3f) -> Behind {
    let along = length(ray);
    let ground = ground_distance(camera.position, direction) / along;
    var depth = ground;
    var at = NO_SOLID;
#ifndef BARE
    let here = u32(pixel.y) * camera.size.x + u32(pixel.x);
    let solid = solid_depth[here];
    if solid < min(ground, FAR) {
        depth = solid;
        at = here;
    }
#endif
    if depth >= 0.1 * FAR {
        return Behind(FAR, FAR, Seen(NO_SOLID, vec3f(0.0), -direction, 0.0, 0.0));
    }
    let far = depth * along;
    return Behind(depth, far,
        Seen(at, camera.position + direction * far, -direction, far / camera.focal, 0.0));
}

// `light` is the radiance of its surface, unless it is the sky.
fn behind_radiance(found: Behind, direction: vec3f, light: vec3f) -> vec3f {
    let is_sky = found.depth >= 0.1 * FAR;
    let air = sky_radiance(select(at_horizon(direction), direction, is_sky));
    if is_sky {
        return (air + disc_radiance(direction)) * shading.background;
    }
    return mix(air, light, air_between(found.far));
}

// Opaque points that a pixel may need: behind the water, in it, and in its reflection.
const BACKDROP: u32 = 1u;
const INTO: u32 = 2u;
const MIRROR: u32 = 4u;

// Light components of `behind_radiance`, whose sum is `colour`.
fn behind_parts(found: Behind, direction: vec3f, colour: vec3f) {
#ifdef LIGHTS
    if found.depth < 0.1 * FAR {
        let air = hazed(vec3f(0.0), found.far, direction);
        light_part(SKYLIGHT, air);
        light_part(SOLIDS, colour - air);
    } else {
        light_part(SKYLIGHT, sky_radiance(direction) * shading.background);
        light_part(SUN, disc_radiance(direction) * shading.background);
    }
#endif
}

#ifdef LISTED
// List of tiles to process.
#ifdef BARE
const LIST: u32 = BARE_TILES;
#else
#ifdef DRY
const LIST: u32 = SET_ALONE;
#else
const LIST: u32 = WET;
#endif
#endif
#endif

@compute @workgroup_size(16, 4)
#ifdef LISTED
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_id) thread: vec3u,
) {
    let place = group.x + group.y * groups.x;
    if place >= tiles[LIST] {
        return;
    }
    let all = tiles[WET] + tiles[SET_ALONE] + tiles[BARE_TILES];
    let id = pixel_of_tile(
        tiles[FIRST_TILE + LIST * all + place], thread, camera.margin + vec2u(0u, band.row));
#else
fn main(@builtin(global_invocation_id) id: vec3u) {
#endif
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
#ifdef DRY
    let z = FAR;
    let wet = false;
    var through = 0.0;
#else
    let z = surface[at];
    let wet = z < straight.depth && z < 0.1 * FAR;
    var through = thickness_at(vec2f(pixel) + 0.5);
#endif
#ifdef SEA
    let open = sea_from_eye(direction, min(straight.far, select(FAR, z * length(ray), wet)));
    through += sea_behind(direction);
    let beside = open.distance < FAR;
    if beside {
        through = (camera.position.y + direction.y * open.distance) / max(-direction.y, 1e-3);
    }
#endif
#ifdef AOVS
    let over = spray_over(pixel, ray);
#ifdef SEA
    if beside {
        let position = camera.position + direction * open.distance;
        let moved = position + sea_velocity(position.xz) * camera.frame_seconds;
        let motion = motion_to(eye_from_world(next_camera, moved), pixel);
        store_under(over, out, open.distance / length(ray), open.normal, position, motion, through);
        return;
    }
#endif
    if wet {
        let position = world_from_eye(camera, ray * z);
        let normal = world_direction(camera, surface_normal(pixel, z));
        var motion = vec2f(0.0);
        let particle = owner[at];
        if particle < camera.particle_count {
            let moved = position + particles[particle].velocity * camera.frame_seconds;
            motion = motion_to(eye_from_world(next_camera, moved), pixel);
        }
        store_under(over, out, z, normal, position, motion, through);
        return;
    }
    let seen = straight.depth < 0.1 * FAR;
    let surface = surface_of(straight.seen);
    var place = surface.position;
#ifdef CARRIED
    if seen && straight.seen.at != NO_SOLID {
        place = carried_to_next(solid_code(at), place);
    }
#endif
    let next = select(sky_in_next(direction), eye_from_world(next_camera, place), seen);
    let motion = motion_to(next, pixel);
    let normal = select(vec3f(0.0), surface.normal, seen);
    store_under(over, out, straight.depth, normal, surface.position, motion, through);
#else
    var cover = 0.0;
#ifdef SPRAY
    cover = spray_at(vec2f(pixel) + 0.5).cover;
#endif
#ifdef OBJECTS
#ifdef SEA
    let has_water = wet || beside;
#else
    let has_water = wet;
#endif
    // The sky, the ground or a solid.
    var object = 3u;
    if has_water {
        object = 0u;
    } else if straight.depth < 0.1 * FAR {
        object = 2u;
        if straight.seen.at != NO_SOLID {
            object = solid_code(at);
        }
    }
    output[out] = vec2u(object, bitcast<u32>(cover));
#else
    var colour: vec3f;
    var alpha = 1.0;
#ifdef DRY
    let light = light_of(straight.seen);
    let is_water = false;
    let backdrop = behind_radiance(straight, direction, light);
#else
    var met = straight;
    var way = direction;
    if wet {
        let aside = through_sheet(pixel, z, straight);
        let aside_ray = eye_ray(camera, vec2f(aside) + 0.5);
        way = normalize(world_direction(camera, aside_ray));
        met = behind(aside, aside_ray, way);
    }
    var depth = z;
    var is_water = wet;
    var lost = 0.0;
#ifdef SEA
    if beside {
        depth = open.distance / length(ray);
        is_water = true;
        lost = open.variance;
    }
#endif
    // Bit mask of the points to shade.
    var wanted = select(0u, BACKDROP, met.depth < 0.1 * FAR);
    var water: Water;
    var mirror: Mirrored;
    var into: Bent;
    if is_water {
        var normal = world_direction(camera, surface_normal(pixel, z));
#ifdef SEA
        normal = select(normal, open.normal, beside);
#endif
        water = water_at(depth, ray, view, normal, lost);
        mirror = mirrored(water);
        into = bent(water, through);
        wanted = select(0u, wanted, into.filled < 1.0) | select(0u, INTO, into.filled > 0.0)
            | select(0u, MIRROR, mirror.hit.distance < FAR);
    }
    // A loop, because adapters that execute both sides of a branch leave a loop once none of their
    // pixels needs more, and most need one or two of the three. The condition is also tested at the
    // end, or they run the body once more for no pixel; with that test only, lavapipe (Mesa 22.3)
    // would overwrite the results of finished pixels.
    var light_behind = vec3f(0.0);
    var light_into = vec3f(0.0);
    var light_mirrored = vec3f(0.0);
    while wanted != 0u {
        let which = wanted & (0u - wanted);
        var seen = met.seen;
        if which == INTO {
            seen = into.found;
        } else if which == MIRROR {
            seen = mirror.found;
        }
#ifdef WET
        in_air = !is_water || which == MIRROR;
#endif
        let light = light_of(seen);
        if which == BACKDROP {
            light_behind = light;
        } else if which == INTO {
            light_into = light;
        } else {
            light_mirrored = light;
        }
        wanted &= wanted - 1u;
        if wanted == 0u {
            break;
        }
    }
    let backdrop = behind_radiance(met, way, light_behind);
#endif
    if is_water {
#ifndef DRY
        let far = depth * length(ray);
        let mirror_light = mirrored_light(mirror, water, light_mirrored);
        let behind_light = mix(backdrop, light_into, into.filled);
        colour = water_light(water, mirror_light, behind_light, into.way);
#ifdef FOAM_LAYER
        colour = foamed(water, colour);
#endif
        colour = hazed(colour, far, direction);
        dim_parts(exp(-far / shading.haze));
        light_part(SKYLIGHT, hazed(vec3f(0.0), far, direction));
#endif
    } else if HOLDS_OUT && straight.depth < 0.1 * FAR {
        alpha = 0.0;
    } else {
        colour = backdrop;
        behind_parts(straight, direction, colour);
        if straight.depth >= 0.1 * FAR {
            alpha = shading.background;
        }
    }
    let kept = 1.0 - cover;
    colour *= kept;
    alpha *= kept;
    dim_parts(kept);
    store_light(out, vec4f(colour, alpha), camera.weight, camera.sample_index == 0u);
#endif
#endif
}
