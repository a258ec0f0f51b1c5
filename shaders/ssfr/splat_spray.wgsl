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

const DROPS: u32 = 5u;

// A number in 0..1 that belongs to a particle and a channel.
fn random(index: u32, channel: u32) -> f32 {
    var h = index * 0x9E3779B1u + channel * 0x85EBCA77u;
    h = (h ^ (h >> 15u)) * 0x2C1B3C6Du;
    h = (h ^ (h >> 12u)) * 0x297A2D39u;
    return f32((h ^ (h >> 15u)) >> 8u) / 16777216.0;
}

// chord³/(2r)² instead of the chord, times 5/3 for the same volume: the edge fades out instead of ending.
fn soft_chord(ray: vec3f, c: vec3f, radius: f32) -> f32 {
    let chord = max(hit_sphere(ray, c, radius).chord, 0.0);
    return chord * chord * chord / (4.0 * radius * radius) * (5.0 / 3.0);
}

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
    // The particle stands for a cloud of drops, wider than the ball that the solver carries.
    let thrown = !is_body(particle);
    let id = particle.tag >> 1u;
    let radius = 1.4 * camera.radius;
    let half_size = camera.size / 2u;
    let c = eye_from_world(camera, particle.position + particle.velocity * camera.seconds);
    var drops: array<vec4f, DROPS>;
    var volume = 0.0;
    for (var k = 0u; k < DROPS; k++) {
        let offset = vec3f(random(id, 4u * k), random(id, 4u * k + 1u), random(id, 4u * k + 2u));
        let size = camera.radius * mix(0.14, 0.5, pow(random(id, 4u * k + 3u), 2.0));
        drops[k] = vec4f(c + (offset - 0.5) * 1.7 * camera.radius, size);
        volume += pow(size / camera.radius, 3.0);
    }
    // Thrown water is mostly air: its drops hold a part of what the particle stands for.
    volume = select(0.5, 0.15, thrown) / volume;
    let bounds = sphere_bounds(camera, c, radius, 0.5, half_size);
    let width = u32(max(bounds.z - bounds.x + 1, 0));
    let count = width * u32(max(bounds.w - bounds.y + 1, 0));
    for (var i = lane; i < count; i += 32u) {
        let row = row_of(i, width);
        let pixel = vec2u(bounds.xy) + vec2u(i - row * width, row);
        let at = 2u * (pixel.y * camera.size.x + pixel.x);
        if c.z >= min(solid_depth[at], surface[at] + 2.0 * camera.radius) {
            continue;
        }
        let ray = eye_ray(camera, 2.0 * vec2f(pixel) + 1.0);
        var sum = 0.0;
        for (var k = 0u; k < DROPS; k++) {
            sum += soft_chord(ray, drops[k].xyz, drops[k].w);
        }
        let amount = u32(sum * volume * params.scale * particle.aeration * THICKNESS_SCALE + 0.5);
        if amount > 0u {
            atomicAdd(&spray[pixel.y * half_size.x + pixel.x], amount);
        }
    }
}
