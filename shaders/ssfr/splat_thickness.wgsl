// Water along the line of sight in front of solids, at half resolution: chords of spheres, except
// of particles in blocks (ssfr/splat_bulk), scaled so that their sum over a bulk lattice is the
// length of the path.
#import "shared/camera.wgsl"
#import "shared/ssfr_splat.wgsl"
#import "shared/ssfr_lanes.wgsl"
#import "shared/ssfr_page.wgsl"
#import "shared/ssfr_moved.wgsl"

struct ThicknessParams {
    // d³ / (4/3 π r³): volume of a particle over that of its sphere.
    scale: f32,
    pad0: f32,
    pad1: f32,
    pad2: f32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> params: ThicknessParams;
@group(0) @binding(2) var<storage, read> particles: array<Particle>;
@group(0) @binding(3) var<storage, read> solid_depth: array<f32>;
@group(0) @binding(4) var<storage, read_write> thickness: array<atomic<u32>>;
#ifdef PATHS
@group(0) @binding(5) var<storage, read> paths: array<Path>;
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
    let half_size = camera.size / 2u;
    let c = eye_from_world(camera, moved(particle, index));
    let bounds = sphere_bounds(camera, c, radius, 0.5, half_size);
    let width = u32(max(bounds.z - bounds.x + 1, 0));
    let count = width * u32(max(bounds.w - bounds.y + 1, 0));
    for (var i = thread.x; i < count; i += LANES) {
        let row = row_of(i, width);
        let pixel = vec2u(bounds.xy) + vec2u(i - row * width, row);
        let hit = hit_sphere(eye_ray(camera, 2.0 * vec2f(pixel) + 1.0), c, radius);
        if hit.chord > 0.0 && hit.depth < solid_depth[2u * (pixel.y * camera.size.x + pixel.x)] {
            let amount = u32(hit.chord * params.scale * THICKNESS_SCALE + 0.5);
            atomicAdd(&thickness[pixel.y * half_size.x + pixel.x], amount);
        }
    }
}
