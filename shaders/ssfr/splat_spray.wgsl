// Splats aerated water near or in front of the surface, at half resolution; this whitens the water.
#import "shared/angle.wgsl"
#import "shared/camera.wgsl"
#import "shared/ssfr_splat.wgsl"
#import "shared/ssfr_lanes.wgsl"
#import "shared/ssfr_page.wgsl"
#import "shared/ssfr_moved.wgsl"
#import "shared/ssfr_spray_add.wgsl"
#import "shared/ssfr_streak.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> spray_params: SprayParams;
@group(0) @binding(2) var<storage, read> particles: array<Particle>;
@group(0) @binding(3) var<storage, read> solid_depth: array<f32>;
@group(0) @binding(4) var<storage, read> surface: array<f32>;
@group(0) @binding(5) var<storage, read_write> spray: array<atomic<u32>>;
// Number of particles that hold air, then their indices.
@group(0) @binding(7) var<storage, read> aired: array<u32>;
#ifdef PATHS
@group(0) @binding(6) var<storage, read> paths: array<Path>;
#endif
#ifdef SHUTTER
@group(0) @binding(21) var<uniform> moments: array<Moment, 64>;
#endif

// A particle stands for torn water: puffs of mist along a curved thread, and individually visible
// drops around it. Pairs of values are for a lone particle and for one in company. Chosen by eye:
// without mist, clouds look speckled; without drops they look like smoke, and a lone puff looks
// like cotton.
//
// Number of puffs, the radius of each in splat radii, and their share of the volume.
const PUFFS: u32 = 4u;
const PUFF: f32 = 1.1;
const MIST: vec2f = vec2f(0.0, 0.6);
// Drops of a distant particle, and the factor by which they are finer than that number would imply.
const DROPS: f32 = 5.0;
const FINER: vec2f = vec2f(2.0, 1.0);
const MOST_DROPS: u32 = 4096u;
// Size of the smallest drop, and the difference to the largest, in splat radii.
const LEAST_SIZE: f32 = 0.14;
const SIZES: f32 = 0.36;
// Root mean square offset along an axis, in splat radii, that drops get from their positions along
// the thread; and that of the puffs' centres, which is less because each puff adds a variance of a
// seventh of its radius squared and the four centres of segments spread 0.94 times as wide as
// points anywhere on the thread.
const WIDE: f32 = 0.716;
const WIDE_PUFFS: f32 = 0.6;
// Half the thread's length, the bend of its ends, and the scatter around it: root mean squares
// relative to the total, √((LENGTH² + 0.8 BEND² + 3 OFF²) / 3) = 1.
const LENGTH: vec2f = vec2f(1.5, 1.2);
const BEND: f32 = 0.6;
const OFF: vec2f = vec2f(0.392, 0.651);
// Distance to the eye, in splat radii, below which nothing is drawn; from twice that on everything
// is.
const NEAREST: f32 = 2.6;
// Radius in pixels above which a drop is replaced by smaller ones: 0.7 cells of the half
// resolution.
const LARGEST: f32 = 1.4;

// Deterministic random number in 0..1 by particle and channel.
fn random(index: u32, channel: u32) -> f32 {
    var h = index * 0x9E3779B1u + channel * 0x85EBCA77u;
    h = (h ^ (h >> 15u)) * 0x2C1B3C6Du;
    h = (h ^ (h >> 12u)) * 0x297A2D39u;
    return f32((h ^ (h >> 15u)) >> 8u) / 16777216.0;
}

// chord³/(2r)² in place of the chord, times 5/3 for the same volume, so that the edge fades out.
fn soft_chord(ray: vec3f, c: vec3f, radius: f32) -> f32 {
    let chord = max(hit_sphere(ray, c, radius).chord, 0.0);
    return chord * chord * chord / (4.0 * radius * radius) * (5.0 / 3.0);
}

// Deterministic random direction by particle and channel.
fn turned(id: u32, channel: u32) -> vec3f {
    let up = 2.0 * random(id, channel) - 1.0;
    let angle = angle_of(random(id, channel + 1u));
    let across = sqrt(max(1.0 - up * up, 0.0));
    return vec3f(across * cos(angle), up, across * sin(angle));
}

// Random number with a triangular distribution, mean 0 and variance 1.
fn tent(id: u32, channel: u32) -> f32 {
    return 2.449490 * (random(id, channel) + random(id, channel + 1u) - 1.0);
}

struct Thread {
    along: vec3f,
    bent: vec3f,
    length: f32,
    off: f32,
}

// Interpolates a pair of values by company.
fn between(pair: vec2f, company: f32) -> f32 {
    return mix(pair.x, pair.y, company);
}

// Offset from the thread's centre of a point at the fraction `part`, 0 to 1, along it, with scatter
// from the channels from `channel` on.
fn strung(thread: Thread, part: f32, id: u32, channel: u32) -> vec3f {
    let s = 1.732051 * (2.0 * part - 1.0);
    let off = vec3f(tent(id, channel), tent(id, channel + 2u), tent(id, channel + 4u));
    return thread.length * s * thread.along + BEND * (s * s - 1.0) * thread.bent + thread.off * off;
}

// Visible fraction, at a half-resolution pixel, of an object `wide` metres across at depth `z`.
fn seen_at(pixel: vec2u, z: f32, wide: f32) -> f32 {
    let at = 2u * (pixel.y * camera.size.x + pixel.x);
    // Water above a drop removes its white, half of it at a depth of two particle radii.
    let under = 1.0 - smoothstep(camera.radius, 3.0 * camera.radius, z - surface[at]);
    return before(solid_depth[at], z, wide) * under;
}

// Splats a puff, whose many pixels the particle's threads share; `volume` is its share of the
// particle's.
fn add_puff(c: vec3f, volume: f32, lane: u32, velocity: vec3f) {
    let own = PUFF * camera.radius;
    // At least 0.7 pixels of the half resolution, so that small puffs become fainter instead of
    // being missed; the volume is kept.
    let radius = max(own, 1.4 * c.z / camera.focal);
    let shrunk = own / radius;
    let weight = volume * shrunk * shrunk * shrunk * spray_params.scale;
    let bounds = sphere_bounds(camera, c, radius, 0.5, camera.size / 2u);
    let width = u32(max(bounds.z - bounds.x + 1, 0));
    let count = width * u32(max(bounds.w - bounds.y + 1, 0));
    for (var i = lane; i < count; i += LANES) {
        let row = row_of(i, width);
        let pixel = vec2u(bounds.xy) + vec2u(i - row * width, row);
        let seen = seen_at(pixel, c.z, radius);
        if seen > 0.0 {
            let ray = eye_ray(camera, 2.0 * vec2f(pixel) + 1.0);
            add_spray(pixel, soft_chord(ray, c, radius) * weight * seen, c.z, velocity);
        }
    }
}

// Splats a drop. It is at most 1.4 cells of two pixels wide, so its volume is distributed
// bilinearly to the four surrounding cells.
fn add_drop(c: vec3f, own: f32, volume: f32, velocity: vec3f) {
    let cell = 2.0 * c.z / camera.focal;
    if c.z < 1.5 * own {
        return;
    }
    // Volume over the cell's area as seen along the ray.
    let aslant = length(c) / c.z;
    let way = 4.188790 * own * own * own * volume * spray_params.scale / (cell * cell) * aslant;
    let place = 0.5 * (camera.centre + camera.focal * vec2f(c.x, -c.y) / c.z) - 0.5;
    let base = floor(place);
    let part = place - base;
    let first = vec2i(base) + vec2i(camera.corner * 0.5);
    for (var k = 0; k < 4; k++) {
        let step = vec2i(k & 1, k >> 1u);
        let pixel = first + step;
        if any(pixel < vec2i(0)) || any(pixel >= vec2i(camera.size / 2u)) {
            continue;
        }
        let share = select(1.0 - part, part, step == vec2i(1));
        let seen = seen_at(vec2u(pixel), c.z, 0.7 * cell);
        add_spray(vec2u(pixel), way * share.x * share.y * seen, c.z, velocity);
    }
}

// A particle's threads share the pixels of each puff, which are many, and divide the drops, which
// have few pixels each.
@compute @workgroup_size(LANES, ROWS)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_id) thread: vec3u,
) {
    let place = row_of_dealt_group(group, groups, thread);
    if place >= page.aired_count {
        return;
    }
    let index = aired[page.aired_first + place] - page.first;
    let particle = particles[index];
    let id = particle.tag >> 1u;
    let c = eye_from_world(camera, moved(particle, index));
    let near = smoothstep(NEAREST, 2.0 * NEAREST, c.z / camera.radius);
    if near <= 0.0 {
        return;
    }
    let air = near * air_of(particle);
    let company = company_of(particle);
    var streak = vec3f(0.0);
#ifdef SHUTTER
    streak = streak_between(
        moved_by(particle, index, moments[0].seconds),
        moved_by(particle, index, moments[MOMENTS - 1u].seconds));
#endif
    let thread_of = Thread(
        turned(id, 0u), turned(id, 2u), between(LENGTH, company), between(OFF, company));
    let mist = between(MIST, company);
    let of_puffs = air * mist / (PUFF * PUFF * PUFF * f32(PUFFS));
    for (var k = 0u; k < select(0u, PUFFS, mist > 0.0); k++) {
        let off = strung(thread_of, (f32(k) + 0.5) / f32(PUFFS), id, 7u * k + 5u);
        let puff = c + WIDE_PUFFS * camera.radius * off;
        let beads = beads_along(streak, puff, max(PUFF * camera.radius * camera.focal / c.z, 2.0));
        for (var bead = 0u; bead < beads; bead++) {
            add_puff(puff + bead_off(streak, bead, beads), of_puffs / f32(beads), thread.x,
                particle.velocity);
        }
    }
    // Near the eye, more and smaller drops of the same opacity: as many more as their areas are
    // smaller.
    let finer = between(FINER, company)
        * max((LEAST_SIZE + SIZES) * camera.radius * camera.focal / (c.z * LARGEST), 1.0);
    let drops = min(u32(DROPS * finer * finer), MOST_DROPS);
    // Sum of the cubes of sizes LEAST + SIZES q² at the midpoints of that many parts of 0..1, with
    // correction terms of second order in 1 over their number.
    let m = LEAST_SIZE;
    let n = SIZES;
    let part = 1.0 / f32(drops);
    let cubes = m * m * m + m * m * n + 0.6 * m * n * n + n * n * n / 7.0
        - part * part * (6.0 * m * m * n + 12.0 * m * n * n + 6.0 * n * n * n) / 24.0;
    let of_drops = air * (1.0 - mist) / (cubes * f32(drops)) * finer * finer * finer;
    for (var j = thread.x; j < drops; j += LANES) {
        let k = PUFFS + j;
        let q = (f32(j) + 0.5) * part;
        let off = strung(thread_of, random(id, 7u * k + 4u), id, 7u * k + 5u);
        let own = camera.radius * (m + n * q * q) / finer;
        let drop = c + WIDE * camera.radius * off;
        let beads = beads_along(streak, drop, 2.0);
        for (var bead = 0u; bead < beads; bead++) {
            add_drop(drop + bead_off(streak, bead, beads), own, of_drops / f32(beads),
                particle.velocity);
        }
    }
}
