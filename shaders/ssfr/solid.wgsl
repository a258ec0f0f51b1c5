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

const NEAR: f32 = 0.02;

struct Corner {
    @builtin(position) clip: vec4f,
    // Eye-space plane: normal and distance.
    @location(0) @interpolate(flat) plane: vec4f,
    @location(1) @interpolate(flat) range: vec2f,
    @location(2) @interpolate(flat) packed: u32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Corner {
    let triangle = triangles[index / 3u];
    let a = eye_from_world(camera, triangle.a);
    let b = eye_from_world(camera, triangle.b);
    let c = eye_from_world(camera, triangle.c);
    let world_normal = normalize(cross(triangle.b - triangle.a, triangle.c - triangle.a));
    let normal = vec3f(
        dot(world_normal, camera.right),
        dot(world_normal, camera.up),
        dot(world_normal, camera.forward),
    );
    let eye = eye_from_world(camera, corner(triangle, index % 3u));
    let shift = camera.centre - tile.corner;
    var out: Corner;
    out.clip = vec4f(
        2.0 * (camera.focal * eye.x + shift.x * eye.z) / tile.size.x - eye.z,
        eye.z - 2.0 * (shift.y * eye.z - camera.focal * eye.y) / tile.size.y,
        NEAR,
        eye.z,
    );
    out.plane = vec4f(normal, dot(normal, a));
    out.range = vec2f(min(a.z, min(b.z, c.z)), max(a.z, max(b.z, c.z)));
    out.packed = pack_normal(world_normal, triangle.material);
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
    let facing = dot(in.plane.xyz, ray);
    let depth = clamp(in.plane.w / facing, max(in.range.x, NEAR), in.range.y);
    return Texel(depth, in.packed, clamp(NEAR / depth, 0.0, 1.0));
}
