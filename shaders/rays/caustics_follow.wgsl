// Traces the sun's rays from where they enter the water to opaque geometry below.
#import "shared/camera.wgsl"
#import "shared/ssfr_optics.wgsl"
#ifdef RIPPLES
#import "shared/ssfr_ripple.wgsl"
#endif
#import "shared/caustics_sides.wgsl"
#import "shared/caustics_layer.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> rays: Rays;
@group(0) @binding(2) var<uniform> caustics: Caustics;
@group(0) @binding(3) var<storage, read> level_table: array<u32>;
@group(0) @binding(4) var<storage, read> level_values: array<f32>;
@group(0) @binding(5) var<storage, read> set_nodes: array<SetNode>;
@group(0) @binding(6) var<storage, read> set_triangles: array<Triangle>;
@group(0) @binding(7) var<storage, read> sun_rays: array<vec4f>;
// Position in the map, light relative to that through flat water (0 = lost), layer.
@group(0) @binding(8) var<storage, read_write> sun_hits: array<vec4f>;
#ifdef SEA
@group(0) @binding(9) var<uniform> sea: Sea;
@group(0) @binding(10) var<storage, read> sea_values: array<vec4f>;
#endif

// Largest number of surfaces along a ray.
const MOST_SURFACES: i32 = 8;
// Number of taps on either side when smoothing a normal, and number of taps per standard deviation.
const SIDE: i32 = 6;
const FINENESS: f32 = 2.5;

fn place_of(at: vec2i, t: f32) -> vec3f {
    let start = caustics.first + caustics.step * vec2f(at);
    return vec3f(start.x, caustics.top, start.y) - caustics.towards * t;
}

// Gaussian mean of the normals around a ray's, in the plane of the rays. Entries off the ray's
// tangent plane by more than the width, or turned by more than 60°, belong to another surface.
fn smooth_normal(at: vec2i, own: vec4f) -> vec3f {
    let step = max(i32(round(caustics.width / (FINENESS * caustics.spacing))), 1);
    let scale = caustics.spacing / max(caustics.width, 1e-6);
    let p = place_of(at, own.w);
    // A width below half the spacing of the rays smooths nothing.
    let side = select(SIDE, 0, scale > 2.0);
    var sum = own.xyz;
    for (var j = -side; j <= side; j++) {
        for (var i = -side; i <= side; i++) {
            let other = at + step * vec2i(i, j);
            if (i == 0 && j == 0) || any(other < vec2i(0)) || any(other >= vec2i(caustics.rays)) {
                continue;
            }
            let entry = sun_rays[u32(other.y) * caustics.rays.x + u32(other.x)];
            if entry.w >= FAR {
                continue;
            }
            let off = dot(place_of(other, entry.w) - p, own.xyz);
            let far = f32(step) * scale * length(vec2f(f32(i), f32(j)));
            let is_same = abs(off) < caustics.width && dot(entry.xyz, own.xyz) > 0.5;
            sum += select(0.0, exp(-0.5 * far * far), is_same) * entry.xyz;
        }
    }
    return normalize(sum);
}

// Ripples act on surfaces that face up, as in ssfr_facet.
fn rippled(p: vec3f, n: vec3f) -> vec3f {
#ifdef RIPPLES
    let ripple = ripple_at(
        p.xz, camera.clock, caustics.ripple.x, caustics.ripple.y, caustics.spacing);
    let rides = smoothstep(0.2, 0.8, n.y);
    return normalize(n - vec3f(ripple.slope.x, 0.0, ripple.slope.y) * rides);
#else
    return n;
#endif
}

struct Bent {
    direction: vec3f,
    // Transmitted fraction; 0 for total reflection.
    part: f32,
}

// Refraction by Snell and Fresnel; `normal` is on the side the ray comes from, and `level` is the
// geometric normal, which the next intersection sees.
fn bent_at(direction: vec3f, normal: vec3f, level: vec3f, index: f32) -> Bent {
    // Facets never face away from the ray.
    let n = normalize(normal - direction * max(0.03 + dot(normal, direction), 0.0) * 1.5);
    let refracted = refract(direction, n, 1.0 / index);
    if dot(refracted, refracted) < 0.25 {
        return Bent(reflect(direction, n), 0.0);
    }
    let sinks = max(0.005 + dot(refracted, level), 0.0);
    let facing = clamp(-dot(direction, n), 0.0, 1.0);
    return Bent(normalize(refracted - level * sinks), 1.0 - fresnel(facing, index));
}

// For a ray that meets a side of the box at `p`: the point at which it would enter through that
// side if the water continued beyond at its level there, given the different slopes of sunlight in
// air and in water. Below the floor where there is no such point.
fn through_side(p: vec3f) -> vec3f {
    let surface = crossing(p, vec3f(0.0, 1.0, 0.0), 0.0, rays.size.y - p.y, true);
    let sides = min(p.xz, rays.size.xz - p.xz);
    let in_air = caustics.towards.xz / caustics.towards.y;
    let in_water = caustics.sun.xz / caustics.sun.y;
    let ways = select(vec2f(in_air.y, in_water.y), vec2f(in_air.x, in_water.x), sides.x < sides.y);
    let under = min(surface.before, rays.size.y) * ways.x / ways.y;
    let out = p.xz + in_air * surface.before - in_water * under;
    return select(vec3f(0.0, -1.0, 0.0), vec3f(out.x, p.y + surface.before - under, out.y),
        surface.after < FAR);
}

#ifdef SHUTTER
@group(0) @binding(16) var<uniform> moments: array<Moment, 64>;
#endif

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= caustics.rays) {
        return;
    }
#ifdef SHUTTER
    // The map is at the sample's instant.
    take_moment(MOMENTS / 2u);
#endif
    let at = id.y * caustics.rays.x + id.x;
    let entry = sun_rays[at];
    var hit = vec4f(0.0);
    var is_open = entry.w < FAR;
    var origin = vec3f(0.0);
    var direction = -caustics.towards;
    var weight = 0.0;
    var inside = true;
    if is_open && all(entry.xyz == vec3f(0.0)) {
        origin = through_side(place_of(vec2i(id.xy), entry.w));
        direction = -caustics.sun;
        weight = 1.0;
        is_open = is_wet(origin);
    } else if is_open {
        origin = place_of(vec2i(id.xy), entry.w);
        let normal = rippled(origin, smooth_normal(vec2i(id.xy), entry));
        let bent = bent_at(direction, normal, entry.xyz, caustics.index);
        direction = bent.direction;
        weight = bent.part / caustics.through;
    }
    for (var k = 0; k < MOST_SURFACES && is_open; k++) {
        let found = trace(origin, direction, inside, caustics.spacing * camera.focal, FAR);
        if found.kind != WATER {
            is_open = false;
            if found.kind == OPAQUE && inside {
                let p = origin + direction * found.t;
                let n = select(found.normal, -found.normal, dot(found.normal, direction) > 0.0);
                hit = vec4f(caustic_place(p), weight, f32(caustic_layer(p, n)));
            }
            continue;
        }
        // Light leaves through the box's sides as it enters.
        if is_cut(found, origin + direction * found.t) {
            is_open = false;
            continue;
        }
        let normal = select(found.normal, -found.normal, inside);
        let index = select(caustics.index, 1.0 / caustics.index, inside);
        let bent = bent_at(direction, normal, normal, index);
        let is_mirrored = bent.part <= 0.0;
        origin += direction * select(found.after, found.before, is_mirrored);
        direction = bent.direction;
        if !is_mirrored {
            weight *= bent.part;
            inside = !inside;
        }
    }
    sun_hits[at] = hit;
}
