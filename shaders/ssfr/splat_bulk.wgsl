// Adds to the thickness the path of the line of sight through blocks of water. A block replaces the
// particles inside it, which are not splatted.
#import "shared/camera.wgsl"
#import "shared/ssfr_splat.wgsl"
#import "shared/ssfr_lanes.wgsl"

// Axis-aligned sides at the frame's instant.
struct Block {
    low: vec3f,
    // Volume of its particles over its own.
    filled: f32,
    high: vec3f,
    pad0: f32,
    // Mean velocity of its particles, m/s.
    velocity: vec3f,
    pad1: f32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> blocks: array<Block>;
@group(0) @binding(2) var<storage, read> solid_depth: array<f32>;
@group(0) @binding(3) var<storage, read_write> thickness: array<atomic<u32>>;

// Spheres of a block's particles would reach beyond its faces, and those of neighbouring particles
// reach into it; sharp faces would therefore leave a seam. A block counts as the mean of eight
// copies, displaced by these four vectors, in splat radii, and their opposites: along each axis the
// displacements are the medians of eight equal parts of a ball.
const PAIRS = 4u;

fn aside(k: u32) -> vec3f {
    let first = select(vec3f(0.447, -0.700, 0.084), vec3f(0.700, 0.256, -0.447), k == 0u);
    let last = select(vec3f(0.084, 0.447, -0.256), vec3f(0.256, 0.084, 0.700), k == 2u);
    return select(last, first, k < 2u) * camera.radius;
}

// Half-resolution pixels that a block may touch: least and greatest, inclusive; all of them where
// it extends behind the eye.
fn block_bounds(low: vec3f, high: vec3f, size: vec2u) -> vec4i {
    var first = vec2f(FAR);
    var last = vec2f(-FAR);
    var behind = 0u;
    for (var k = 0u; k < 8u; k++) {
        let is_high = vec3<bool>((k & 1u) > 0u, (k & 2u) > 0u, (k & 4u) > 0u);
        let corner = eye_from_world(camera, select(low, high, is_high));
        if corner.z < camera.near {
            behind++;
        }
        let at = 0.5 * project(camera, vec3f(corner.xy, max(corner.z, camera.near))) - 0.5;
        first = min(first, at);
        last = max(last, at);
    }
    if behind == 8u {
        return vec4i(0, 0, -1, -1);
    }
    if behind > 0u {
        return vec4i(vec2i(0), vec2i(size) - 1);
    }
    return pixels_between(camera, first, last, 0.5, size);
}

// Length of a ray between two corners, up to the depth `end`; the corners are given as the depths
// at which the ray crosses their planes.
fn between(a: vec3f, b: vec3f, end: f32) -> f32 {
    let first = min(a, b);
    let last = max(a, b);
    let enters = max(max(first.x, first.y), max(first.z, 0.0));
    let leaves = min(min(last.x, last.y), min(last.z, end));
    return max(leaves - enters, 0.0);
}

// A row of threads per block, which share its pixels.
@compute @workgroup_size(LANES, ROWS)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_id) thread: vec3u,
) {
    let index = row_of_dealt_group(group, groups, thread);
    if index >= arrayLength(&blocks) {
        return;
    }
    let block = blocks[index];
    if block.filled <= 0.0 {
        return;
    }
    let gone = block.velocity * camera.seconds;
    let low = block.low + gone;
    let high = block.high + gone;
    let half_size = camera.size / 2u;
    let bounds = block_bounds(low - camera.radius, high + camera.radius, half_size);
    // Pairs of copies per sample; a picture with one sample uses all four.
    let pairs = max(PAIRS / sample_count(camera), 1u);
    for (var y = bounds.y; y <= bounds.w; y++) {
        for (var x = bounds.x + i32(thread.x); x <= bounds.z; x += i32(LANES)) {
            let pixel = vec2u(vec2i(x, y));
            // Displacement of the line of sight per metre of depth.
            let way = world_direction(camera, eye_ray(camera, 2.0 * vec2f(pixel) + 1.0));
            let inverse = 1.0 / select(way, vec3f(1e-12), abs(way) < vec3f(1e-12));
            let a = (low - camera.position) * inverse;
            let b = (high - camera.position) * inverse;
            let end = solid_depth[2u * (pixel.y * camera.size.x + pixel.x)];
            // `end` is positive, so this is always `pairs`. If it depended on uniforms only,
            // lavapipe would compile the pass again for each sample (docs/performance.md).
            let own = select(0u, pairs, end > 0.0);
            var sum = 0.0;
            for (var k = 0u; k < own; k++) {
                let off = aside((camera.sample_index * pairs + k) % PAIRS) * inverse;
                sum += between(a + off, b + off, end) + between(a - off, b - off, end);
                if k + 1u == own {
                    break;
                }
            }
            if sum > 0.0 {
                let through = length(way) * sum / f32(2u * pairs);
                let amount = u32(through * block.filled * THICKNESS_SCALE + 0.5);
                atomicAdd(&thickness[pixel.y * half_size.x + pixel.x], amount);
            }
        }
    }
}
