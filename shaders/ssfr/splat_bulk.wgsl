// The same for blocks of water in place of the particles within them: the way through each, times how densely they fill it.
#import "shared/camera.wgsl"
#import "shared/ssfr_splat.wgsl"
#import "shared/ssfr_lanes.wgsl"

// Sides along the world's axes.
struct Block {
    low: vec3f,
    // Volume that its particles stand for, over its own.
    filled: f32,
    high: vec3f,
    pad0: f32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<storage, read> blocks: array<Block>;
@group(0) @binding(2) var<storage, read> solid_depth: array<f32>;
@group(0) @binding(3) var<storage, read_write> thickness: array<atomic<u32>>;

// Pixels of the half resolution that a block may touch: least and greatest, inclusive; all of them where it reaches behind the eye.
fn block_bounds(block: Block, size: vec2u) -> vec4i {
    var low = vec2f(FAR);
    var high = vec2f(-FAR);
    for (var k = 0u; k < 8u; k++) {
        let is_high = vec3<bool>((k & 1u) > 0u, (k & 2u) > 0u, (k & 4u) > 0u);
        let corner = eye_from_world(camera, select(block.low, block.high, is_high));
        if corner.z < camera.near {
            return vec4i(vec2i(0), vec2i(size) - 1);
        }
        let at = 0.5 * project(camera, corner) - 0.5;
        low = min(low, at);
        high = max(high, at);
    }
    return pixels_between(camera, low, high, 0.5, size);
}

// Metres of the line of sight in the block before the depth `end`; `way` is what it goes for each metre of depth, world axes.
fn way_through(block: Block, way: vec3f, end: f32) -> f32 {
    let along = select(way, vec3f(1e-12), abs(way) < vec3f(1e-12));
    let a = (block.low - camera.position) / along;
    let b = (block.high - camera.position) / along;
    let first = min(a, b);
    let last = max(a, b);
    let enters = max(max(first.x, first.y), max(first.z, 0.0));
    let leaves = min(min(last.x, last.y), min(last.z, end));
    return max(leaves - enters, 0.0) * length(way);
}

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
    let half_size = camera.size / 2u;
    let bounds = block_bounds(block, half_size);
    let width = u32(max(bounds.z - bounds.x + 1, 0));
    let count = width * u32(max(bounds.w - bounds.y + 1, 0));
    for (var i = thread.x; i < count; i += LANES) {
        let row = row_of(i, width);
        let pixel = vec2u(bounds.xy) + vec2u(i - row * width, row);
        let way = world_direction(camera, eye_ray(camera, 2.0 * vec2f(pixel) + 1.0));
        let through = way_through(block, way, solid_depth[2u * (pixel.y * camera.size.x + pixel.x)]);
        if through > 0.0 {
            let amount = u32(through * block.filled * THICKNESS_SCALE + 0.5);
            atomicAdd(&thickness[pixel.y * half_size.x + pixel.x], amount);
        }
    }
}
