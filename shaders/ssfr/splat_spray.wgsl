// Aerated water near or before the surface, at half resolution: what whitens it.
#import "shared/camera.wgsl"
#import "shared/ssfr_splat.wgsl"
#import "shared/ssfr_lanes.wgsl"
#import "shared/ssfr_page.wgsl"
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

// A particle stands for torn water: puffs of mist strung on a bent thread, and drops about it that are seen one by one.
// Puffs, the radius of each in splat radii, and their part of the volume. By eye: without mist clouds are speckled, without drops
// they are smoke.
const PUFFS: u32 = 4u;
const PUFF: f32 = 1.1;
const MIST: f32 = 0.6;
// Drops of a particle far away.
const DROPS: f32 = 5.0;
const MOST_DROPS: u32 = 4096u;
// The least of them, and what is added to it for the largest, in splat radii.
const LEAST_SIZE: f32 = 0.14;
const SIZES: f32 = 0.36;
// Root mean square of their places from the particle along an axis, in splat radii, over that of what is strung anywhere on a thread;
// and of the puffs' middles: a seventh of a puff's radius squared is its own, and four middles of parts of a thread are 0.94 as wide.
const WIDE: f32 = 0.716;
const WIDE_PUFFS: f32 = 0.6;
// Half a thread's length, how far its ends are bent aside, and how far what is strung on it lies off: root mean squares over that of all,
// √((LENGTH² + 0.8 BEND² + 3 OFF²) / 3) = 1.
const LENGTH: f32 = 1.2;
const BEND: f32 = 0.6;
const OFF: f32 = 0.651;
// Nearer to the eye than this, in splat radii, nothing is drawn; at twice as far all is.
const NEAREST: f32 = 2.6;
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

// A direction that belongs to a particle and a channel.
fn turned(id: u32, channel: u32) -> vec3f {
    let up = 2.0 * random(id, channel) - 1.0;
    let turn = 2.0 * 3.14159265 * random(id, channel + 1u);
    let across = sqrt(max(1.0 - up * up, 0.0));
    return vec3f(across * cos(turn), up, across * sin(turn));
}

// A number with the mean 0 and the variance 1, of a tent.
fn tent(id: u32, channel: u32) -> f32 {
    return 2.449490 * (random(id, channel) + random(id, channel + 1u) - 1.0);
}

struct Thread {
    along: vec3f,
    bent: vec3f,
}

// What lies at `part` in 0..1 of a thread, from its middle; off the thread as the channels from `channel` on say.
fn strung(thread: Thread, part: f32, id: u32, channel: u32) -> vec3f {
    let s = 1.732051 * (2.0 * part - 1.0);
    let off = vec3f(tent(id, channel), tent(id, channel + 2u), tent(id, channel + 4u));
    return LENGTH * s * thread.along + BEND * (s * s - 1.0) * thread.bent + OFF * off;
}

@compute @workgroup_size(LANES, ROWS)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_id) thread: vec3u,
) {
    let place = row_of_group(group, groups, thread);
    if place >= page.aired_count {
        return;
    }
    let index = aired[page.aired_first + place] - page.first;
    let particle = particles[index];
    let air = air_of(particle);
    let id = particle.tag >> 1u;
    let half_size = camera.size / 2u;
    let c = eye_from_world(camera, moved(particle, index));
    let near = smoothstep(NEAREST, 2.0 * NEAREST, c.z / camera.radius);
    if near <= 0.0 {
        return;
    }
    // Near the eye more and smaller ones, each as opaque: as many more as their areas are less.
    let finer = max((LEAST_SIZE + SIZES) * camera.radius * camera.focal / (c.z * LARGEST), 1.0);
    let drops = min(u32(DROPS * finer * finer), MOST_DROPS);
    // Σ of their cubes: sizes are LEAST + SIZES q² at the middles of as many parts of 0..1, but for terms of 1 over their number
    // squared.
    let m = LEAST_SIZE;
    let n = SIZES;
    let part = 1.0 / f32(drops);
    let cubes = m * m * m + m * m * n + 0.6 * m * n * n + n * n * n / 7.0
        - part * part * (6.0 * m * m * n + 12.0 * m * n * n + 6.0 * n * n * n) / 24.0;
    let of_drops = (1.0 - MIST) / (cubes * f32(drops)) * finer * finer * finer;
    let of_puffs = MIST / (PUFF * PUFF * PUFF * f32(PUFFS));
    let thread_of = Thread(turned(id, 0u), turned(id, 2u));
    for (var k = thread.x; k < PUFFS + drops; k += LANES) {
        let is_puff = k < PUFFS;
        let q = select((f32(k - PUFFS) + 0.5) * part, 0.0, is_puff);
        let own = camera.radius * select((m + n * q * q) / finer, PUFF, is_puff);
        let strand = select(random(id, 7u * k + 4u), (f32(k) + 0.5) / f32(PUFFS), is_puff);
        let wide = select(WIDE, WIDE_PUFFS, is_puff) * camera.radius;
        let d = c + wide * strung(thread_of, strand, id, 7u * k + 5u);
        // At least 0.7 pixels of the half resolution, so that a small one is fainter and never missed: its volume stays.
        let radius = max(own, 1.4 * d.z / camera.focal);
        let shrunk = own / radius;
        let volume = near * air * select(of_drops, of_puffs, is_puff);
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
