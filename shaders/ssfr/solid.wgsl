// Depth and normal of the solids, into one tile of the frame. Depth is that of the triangle's plane along the
// pixel's ray, not an interpolated one, so a frame drawn in tiles holds the bits of one drawn whole.
#import "shared/camera.wgsl"
#import "shared/ssfr_solid.wgsl"

struct Tile {
    // In padded pixels.
    corner: vec2f,
    size: vec2f,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> tile: Tile;
@group(0) @binding(2) var<storage, read> triangles: array<Triangle>;

struct Corner {
    @builtin(position) clip: vec4f,
    // Eye-space plane: normal and distance.
    @location(0) @interpolate(flat) plane: vec4f,
    // Planes through the eye and each side; a ray inside all three meets the triangle.
    @location(1) @interpolate(flat) side_a: vec3f,
    @location(2) @interpolate(flat) side_b: vec3f,
    @location(3) @interpolate(flat) side_c: vec3f,
    @location(4) @interpolate(flat) range: vec2f,
    @location(5) @interpolate(flat) packed: u32,
}

// Two triangles over the box that holds the triangle on the screen, or over the tile where it passes the eye.
// Which pixels it covers is decided by its sides in the fragment (homogeneous rasterisation, Olano and Greer
// 1997): the device's own rules snap corners to a grid that starts at the tile, and edges would move with it.
@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Corner {
    let triangle = triangles[index / 6u];
    let a = eye_from_world(camera, triangle.a);
    let b = eye_from_world(camera, triangle.b);
    let c = eye_from_world(camera, triangle.c);
    let world_normal = normalize(cross(triangle.b - triangle.a, triangle.c - triangle.a));
    let normal = vec3f(
        dot(world_normal, camera.right),
        dot(world_normal, camera.up),
        dot(world_normal, camera.forward),
    );
    var out: Corner;
    out.range = vec2f(min(a.z, min(b.z, c.z)), max(a.z, max(b.z, c.z)));
    var low = vec2f(0.0);
    var high = tile.size;
    if out.range.x > camera.near {
        let pa = project(camera, a);
        let pb = project(camera, b);
        let pc = project(camera, c);
        // A pixel wider, for rounding.
        let corner = tile.corner - camera.corner;
        low = clamp(min(pa, min(pb, pc)) - corner - 1.0, vec2f(0.0), tile.size);
        high = clamp(max(pa, max(pb, pc)) - corner + 1.0, vec2f(0.0), tile.size);
    } else if out.range.y <= camera.near {
        high = vec2f(0.0);
    }
    // Of a closed body the sides towards the eye hide the others.
    if index / 6u < camera.closed && dot(normal, a) > 0.0 {
        high = low;
    }
    let k = index % 6u;
    let right = k == 1u || k == 2u || k == 4u;
    let bottom = k == 2u || k == 4u || k == 5u;
    let at = vec2f(select(low.x, high.x, right), select(low.y, high.y, bottom));
    out.clip = vec4f(2.0 * at.x / tile.size.x - 1.0, 1.0 - 2.0 * at.y / tile.size.y, 0.5, 1.0);
    out.plane = vec4f(normal, dot(normal, a));
    let orientation = select(-1.0, 1.0, dot(a, cross(b, c)) > 0.0);
    out.side_a = orientation * cross(a, b);
    out.side_b = orientation * cross(b, c);
    out.side_c = orientation * cross(c, a);
#ifdef MATERIALS
    // Which triangle it is tells the rest.
    out.packed = index / 6u;
#else
    out.packed = pack_normal(world_normal, triangle.material);
#endif
    return out;
}

struct Texel {
    @location(0) depth: f32,
    @location(1) packed: u32,
    @builtin(frag_depth) order: f32,
}

@fragment
fn fragment(in: Corner) -> Texel {
    let ray = eye_ray(camera, in.clip.xy + tile.corner);
    let inside = vec3f(dot(in.side_a, ray), dot(in.side_b, ray), dot(in.side_c, ray));
    let raw = in.plane.w / dot(in.plane.xyz, ray);
    // Sides that two triangles share belong to both; the nearer one is kept.
    if any(inside < vec3f(0.0)) || !(raw > 0.0) {
        discard;
    }
    let depth = clamp(raw, max(in.range.x, camera.near), max(in.range.y, camera.near));
    return Texel(depth, in.packed, clamp(camera.near / depth, 0.0, 1.0));
}
