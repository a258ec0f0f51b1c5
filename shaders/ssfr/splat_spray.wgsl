// Aerated water near or before the surface, at half resolution: what whitens it.
#import "shared/camera.wgsl"
#import "shared/ssfr_splat.wgsl"
#import "shared/ssfr_lanes.wgsl"
#import "shared/ssfr_moved.wgsl"
#import "shared/ssfr_spray_add.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> spray_params: SprayParams;
@group(0) @binding(2) var<storage, read> particles: array<Particle>;
@group(0) @binding(3) var<storage, read> solid_depth: array<f32>;
@group(0) @binding(4) var<storage, read> surface: array<f32>;
@group(0) @binding(5) var<storage, read_write> spray: array<atomic<u32>>;
// How many particles hold air, and which.
@group(0) @binding(7) var<storage, read> aired: array<u32>;
#ifdef PATHS
@group(0) @binding(6) var<storage, read> paths: array<Path>;
#endif

// Drops that stand for a particle far away.
const DROPS: f32 = 5.0;
const MOST_DROPS: u32 = 4096u;
// The least of them, and what is added to it for the largest, in splat radii.
const LEAST_SIZE: f32 = 0.14;
const SIZES: f32 = 0.36;
// How far from the particle they are at most, in splat radii: about a spacing, so that clouds of neighbours run into each other.
const CLOUD: f32 = 1.6;
// Radius in pixels above which a drop is many smaller ones.
const LARGEST: f32 = 1.0;

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

// Where the k-th drop of a particle is, from it, in splat radii: evenly in a ball.
fn offset_of(id: u32, k: u32) -> vec3f {
    let up = 2.0 * random(id, 3u * k) - 1.0;
    let turn = 2.0 * 3.14159265 * random(id, 3u * k + 1u);
    let across = sqrt(max(1.0 - up * up, 0.0));
    return CLOUD * pow(random(id, 3u * k + 2u), 1.0 / 3.0) * vec3f(across * cos(turn), up, across * sin(turn));
}

@compute @workgroup_size(LANES, ROWS)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_id) thread: vec3u,
) {
    let place = row_of_group(group, groups, thread);
    if place >= aired[0] {
        return;
    }
    let index = aired[1u + place];
    let particle = particles[index];
    let air = air_of(particle);
    // The particle stands for a cloud of drops, wider than the ball that the solver carries.
    let id = particle.tag >> 1u;
    let half_size = camera.size / 2u;
    let c = eye_from_world(camera, moved(particle, index));
    if c.z < (CLOUD + 1.0) * camera.radius {
        return;
    }
    // Near the eye more and smaller ones, each as opaque: as many more as their areas are less.
    let finer = max((LEAST_SIZE + SIZES) * camera.radius * camera.focal / (c.z * LARGEST), 1.0);
    let count = min(u32(DROPS * finer * finer), MOST_DROPS);
    // Σ of their cubes: sizes are LEAST + SIZES q² at the middles of as many parts of 0..1, but for terms of 1 over their number
    // squared.
    let m = LEAST_SIZE;
    let n = SIZES;
    let part = 1.0 / f32(count);
    let cubes = m * m * m + m * m * n + 0.6 * m * n * n + n * n * n / 7.0
        - part * part * (6.0 * m * m * n + 12.0 * m * n * n + 6.0 * n * n * n) / 24.0;
    let volume = air / (cubes * f32(count)) * finer * finer * finer;
    for (var k = thread.x; k < count; k += LANES) {
        let q = (f32(k) + 0.5) * part;
        let own = camera.radius * (m + n * q * q) / finer;
        let d = c + offset_of(id, k) * camera.radius;
        // At least 0.7 pixels of the half resolution, so that a small one is fainter and never missed: its volume stays.
        let radius = max(own, 1.4 * d.z / camera.focal);
        let shrunk = own / radius;
        let weight = volume * shrunk * shrunk * shrunk * spray_params.scale;
        let bounds = sphere_bounds(camera, d, radius, 0.5, half_size);
        for (var y = bounds.y; y <= bounds.w; y++) {
            for (var x = bounds.x; x <= bounds.z; x++) {
                let pixel = vec2u(vec2i(x, y));
                let at = 2u * (pixel.y * camera.size.x + pixel.x);
                // The water over a drop takes its white away, half of it two radii of a particle down.
                let under = 1.0 - smoothstep(camera.radius, 3.0 * camera.radius, d.z - surface[at]);
                let seen = before(solid_depth[at], d.z, radius) * under;
                if seen <= 0.0 {
                    continue;
                }
                let ray = eye_ray(camera, 2.0 * vec2f(pixel) + 1.0);
                add_spray(pixel, soft_chord(ray, d, radius) * weight * seen, d.z, particle.velocity);
            }
        }
    }
}
