// Depth and normal of the solids in one tile of the frame. Depth is that of the triangle's plane
// along the pixel's ray rather than an interpolated one, so that a frame drawn in tiles is bitwise
// equal to one drawn whole.
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

// A box on the screen, in pixels of the tile.
struct Box {
    low: vec2f,
    high: vec2f,
}

fn with_point(box: Box, p: vec3f) -> Box {
    let at = project(camera, p) + camera.corner - tile.corner;
    return Box(min(box.low, at), max(box.high, at));
}

// Distance relative to `near` below which a face is cut. Between it and `near` faces are drawn at
// the depth `near`, so that the view does not look into a body whose face is close to the eye.
const CUT: f32 = 0.001;

// Extends the box by the part of a side beyond the cut.
fn with_side(box: Box, from_p: vec3f, to_p: vec3f) -> Box {
    let depths = vec2f(from_p.z, to_p.z) - CUT * camera.near;
    if max(depths.x, depths.y) <= 0.0 {
        return box;
    }
    let cut = mix(from_p, to_p, depths.x / (depths.x - depths.y));
    let at_plane = vec3f(cut.xy, CUT * camera.near);
    return with_point(with_point(box, select(at_plane, from_p, depths.x > 0.0)),
        select(at_plane, to_p, depths.y > 0.0));
}

// Two triangles over the screen-space box of the triangle. Its sides decide in the fragment shader
// which pixels it covers (homogeneous rasterisation, Olano and Greer 1997): the device's own rules
// snap corners to a grid that begins at the tile, so edges would move with it.
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
    let box = with_side(with_side(with_side(Box(vec2f(FAR), vec2f(-FAR)), a, b), b, c), c, a);
    // One pixel wider, for rounding.
    let low = clamp(box.low - 1.0, vec2f(0.0), tile.size);
    var high = clamp(box.high + 1.0, vec2f(0.0), tile.size);
    // Skips geometry behind the eye and, for closed bodies, back faces.
    if out.range.y <= camera.near || (index / 6u < camera.closed && dot(normal, a) > 0.0) {
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
#ifdef INDEXED
    // The triangle's index determines everything else.
    out.packed = index / 6u;
#else
    out.packed = pack_normal(world_normal, code_of(triangle));
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
    // Edges shared by two triangles belong to both; the nearer fragment is kept.
    if any(inside < vec3f(0.0)) || !(raw > CUT * camera.near) {
        discard;
    }
    let depth = clamp(raw, max(in.range.x, camera.near), max(in.range.y, camera.near));
    return Texel(depth, in.packed, clamp(camera.near / depth, 0.0, 1.0));
}
