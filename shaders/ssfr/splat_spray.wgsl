// Aerated water near or before the surface, at half resolution: what whitens it.
#import "shared/camera.wgsl"
#import "shared/ssfr_splat.wgsl"

struct ThicknessParams {
    scale: f32,
    pad0: f32,
    pad1: f32,
    pad2: f32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> params: ThicknessParams;
@group(0) @binding(2) var<storage, read> particles: array<Particle>;
@group(0) @binding(3) var<storage, read> solid_depth: array<f32>;
@group(0) @binding(4) var<storage, read> surface: array<f32>;
@group(0) @binding(5) var<storage, read_write> spray: array<atomic<u32>>;

@compute @workgroup_size(32)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = group.x + group.y * groups.x;
    if index >= camera.particle_count {
        return;
    }
    let particle = particles[index];
    if particle.aeration <= 0.0 {
        return;
    }
    // A thrown particle is a cloud of droplets, wider than the ball that the solver carries.
    let widen = select(1.6, 1.2, particle.body > 0.0);
    let radius = camera.radius * widen;
    let scale = params.scale / (widen * widen * widen);
    let half_size = camera.size / 2u;
    let c = eye_from_world(camera, particle.position + particle.velocity * camera.seconds);
    let bounds = sphere_bounds(camera, c, radius, 0.5, half_size);
    let width = u32(max(bounds.z - bounds.x + 1, 0));
    let count = width * u32(max(bounds.w - bounds.y + 1, 0));
    for (var i = lane; i < count; i += 32u) {
        let pixel = vec2u(bounds.xy) + vec2u(i % width, i / width);
        let at = 2u * (pixel.y * camera.size.x + pixel.x);
        let hit = hit_sphere(eye_ray(camera, 2.0 * vec2f(pixel) + 1.0), c, radius);
        if hit.chord > 0.0 && c.z < min(solid_depth[at], surface[at] + 2.0 * camera.radius) {
            // chord³/(2r)² instead of the chord: the edge of the cloud fades out instead of ending.
            let soft = hit.chord * hit.chord * hit.chord / (4.0 * radius * radius) * (5.0 / 3.0);
            let amount = u32(soft * scale * particle.aeration * THICKNESS_SCALE + 0.5);
            atomicAdd(&spray[pixel.y * half_size.x + pixel.x], amount);
        }
    }
}
