// Projection of particles as ellipsoids, in place of the spheres of ssfr_splat.
#import "shared/camera.wgsl"
#import "shared/ssfr_splat.wgsl"

// Symmetric matrix, metres, that maps the unit sphere to the ellipsoid in world axes.
struct Shape {
    // xx, yy, zz.
    diagonal: vec3f,
    pad0: f32,
    // yz, xz, xy.
    off: vec3f,
    pad1: f32,
}

fn stretch(shape: Shape) -> mat3x3f {
    let d = shape.diagonal;
    let o = shape.off;
    return mat3x3f(vec3f(d.x, o.z, o.y), vec3f(o.z, d.y, o.x), vec3f(o.y, o.x, d.z));
}

struct Ellipsoid {
    // Pixels that it may touch: least and greatest, inclusive; x > z where there are none.
    bounds: vec4i,
    // Least depth.
    nearest: f32,
    // In the space in which the ellipsoid is a unit sphere: its centre from the eye, the ray
    // through the corner of pixel (0, 0), and the increments of the ray per pixel to the right and
    // down.
    middle: vec3f,
    corner: vec3f,
    across: vec3f,
    down: vec3f,
}

// Ellipsoid of a particle whose centre is `from_eye` metres from the eye, in world axes; `part`
// scales its size.
fn ellipsoid_at(
    camera: Camera, from_eye: vec3f, shape: Shape, part: f32, size: vec2u,
) -> Ellipsoid {
    let s = part * stretch(shape);
    let c = vec3f(
        dot(from_eye, camera.right), dot(from_eye, camera.up), dot(from_eye, camera.forward));
    // Half-extents along the eye's axes: planes n · x = n · c ± |S n| touch the ellipsoid.
    let right = s * camera.right;
    let up = s * camera.up;
    let forward = s * camera.forward;
    let deep = dot(forward, forward);
    var out: Ellipsoid;
    out.nearest = max(c.z - sqrt(deep), 0.0);
    out.bounds = vec4i(0, 0, -1, -1);
    if c.z < 1.5 * sqrt(deep) {
        return out;
    }
    // Vertical planes through the eye, (1, 0, −u) · x = 0, touch it where (c_x − u c_z)² = |S (1,
    // 0, −u)|²; expanded so that squares of distances do not cancel. Horizontal planes likewise.
    let squared = c.z * c.z - deep;
    let wide = vec2f(dot(right, right), dot(up, up));
    let skew = vec2f(dot(right, forward), dot(up, forward));
    let p = c.xy * c.z - skew;
    let root = sqrt(max(
        wide * c.z * c.z + deep * c.xy * c.xy - 2.0 * skew * c.xy * c.z + skew * skew - wide * deep,
        vec2f(0.0)));
    let least = vec2f(p.x - root.x, -p.y - root.y) / squared;
    let most = vec2f(p.x + root.x, -p.y + root.y) / squared;
    out.bounds = pixels_between(
        camera, camera.centre + camera.focal * least - 0.5,
        camera.centre + camera.focal * most - 0.5, 1.0, size);
    let by = cross(s[1], s[2]);
    let inverse = mat3x3f(by, cross(s[2], s[0]), cross(s[0], s[1])) * (1.0 / dot(s[0], by));
    out.middle = inverse * from_eye;
    out.across = inverse * camera.right / camera.focal;
    out.down = inverse * camera.up / -camera.focal;
    out.corner = inverse * camera.forward
        - camera.centre.x * out.across - camera.centre.y * out.down;
    return out;
}

// Eye-space depth of the near side at a pixel position relative to the camera's `corner`; FAR where
// the ray misses.
fn hit_ellipsoid(ellipsoid: Ellipsoid, position: vec2f) -> f32 {
    let ray = ellipsoid.corner + position.x * ellipsoid.across + position.y * ellipsoid.down;
    let hit = hit_sphere(ray, ellipsoid.middle, 1.0);
    return hit.depth;
}
