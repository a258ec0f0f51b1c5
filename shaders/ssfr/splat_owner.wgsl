// Particle with the nearest sphere, or with ELLIPSOIDS ellipsoid, at each pixel; the least index
// among those at the nearest depth.
#import "shared/camera.wgsl"
#import "shared/ssfr_splat.wgsl"
#import "shared/ssfr_lanes.wgsl"
#import "shared/ssfr_page.wgsl"
#ifdef ELLIPSOIDS
#import "shared/ssfr_ellipsoid.wgsl"
#endif

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> particles: array<Particle>;
@group(0) @binding(2) var<storage, read> depth: array<f32>;
@group(0) @binding(3) var<storage, read_write> owner: array<atomic<u32>>;
#ifdef ELLIPSOIDS
@group(0) @binding(4) var<storage, read> shapes: array<Shape>;
#endif

@compute @workgroup_size(LANES, ROWS)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_id) thread: vec3u,
) {
    let index = row_of_group(group, groups, thread);
    if index >= page.count {
        return;
    }
    let particle = particles[index];
    let radius = body_radius(camera, particle);
    if radius <= 0.0 {
        return;
    }
    let place = particle.position;
#ifdef ELLIPSOIDS
    let ellipsoid = ellipsoid_at(
        camera, place - camera.position, shapes[index], radius / camera.radius, camera.size);
    let bounds = ellipsoid.bounds;
#else
    let c = eye_from_world(camera, place);
    let bounds = sphere_bounds(camera, c, radius, 1.0, camera.size);
#endif
    let width = u32(max(bounds.z - bounds.x + 1, 0));
    let count = width * u32(max(bounds.w - bounds.y + 1, 0));
    for (var i = thread.x; i < count; i += LANES) {
        let row = row_of(i, width);
        let pixel = vec2u(bounds.xy) + vec2u(i - row * width, row);
        let at = pixel.y * camera.size.x + pixel.x;
#ifdef ELLIPSOIDS
        let hit = hit_ellipsoid(ellipsoid, vec2f(pixel) + 0.5 - camera.corner);
#else
        let hit = hit_sphere(eye_ray(camera, vec2f(pixel) + 0.5), c, radius).depth;
#endif
        // Two shaders may round the same formula differently, so equality is tested within a few
        // ulp.
        if hit < FAR && hit <= depth[at] * 1.000001 {
            atomicMin(&owner[at], page.first + index);
        }
    }
}
