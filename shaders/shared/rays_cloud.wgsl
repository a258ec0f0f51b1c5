// Drops and bubbles as a sparse grid of optical density (`Cloud` of render/cloud/density.rs), and
// their integration along rays. The importing shader must bind `cloud`, `cloud_words` and
// `shading`.
#import "shared/box.wgsl"
#import "shared/cloud.wgsl"

// Voxels and nodes along a brick's edge, and values per brick.
const CLOUD_EDGE: u32 = 8u;
const CLOUD_NODES: u32 = 9u;
const CLOUD_VALUES: u32 = 729u;
// Flag in the table of a brick with drops; twice that for bubbles.
const HAS_DROPS: u32 = 0x40000000u;
// Largest number of bricks along a ray: more than three edges of the largest grid.
const MOST_BRICKS: i32 = 4096;
// Optical depth behind which nothing is visible.
const DEEPEST: f32 = 12.0;
// Index of each kind in the grid's values.
const DROPS: u32 = 0u;
const BUBBLES: u32 = 1u;

// Result of integrating drops or bubbles along a ray.
struct Passed {
    // Optical depth, and the coverage 1 − exp(−depth).
    depth: f32,
    cover: f32,
    // Sums, weighted by visible coverage, of the fraction of sunlight that arrives and of the
    // distance.
    lit: f32,
    far: f32,
}

fn cloud_words_before_values() -> u32 {
    return cloud.bricks.x * cloud.bricks.y * cloud.bricks.z
        + cloud.nodes.x * cloud.nodes.y * cloud.nodes.z;
}

// Density in a brick at `q`, in voxels from its corner.
fn cloud_density(slot: u32, q: vec3f, kind: u32) -> f32 {
    let low = clamp(floor(q), vec3f(0.0), vec3f(f32(CLOUD_EDGE - 1u)));
    let part = q - low;
    let c = vec3u(low);
    let y = CLOUD_NODES;
    let z = CLOUD_NODES * CLOUD_NODES;
    let i = cloud_words_before_values() + (slot - 1u) * CLOUD_VALUES + c.x + y * c.y + z * c.z;
    let before = vec4f(
        cloud_value(i, kind), cloud_value(i + y, kind), cloud_value(i + z, kind),
        cloud_value(i + y + z, kind));
    let j = i + 1u;
    let after = vec4f(
        cloud_value(j, kind), cloud_value(j + y, kind), cloud_value(j + z, kind),
        cloud_value(j + y + z, kind));
    let along_x = mix(before, after, part.x);
    let along_y = mix(along_x.xz, along_x.yw, part.y);
    return mix(along_y.x, along_y.y, part.z);
}

fn shade_node(c: vec3u) -> f32 {
    let table = cloud.bricks.x * cloud.bricks.y * cloud.bricks.z;
    return bitcast<f32>(cloud_words[table + (c.z * cloud.nodes.y + c.y) * cloud.nodes.x + c.x]);
}

// Optical depth of drops and bubbles between a point and the sun, trilinear between the lattice's
// nodes; a point beyond the grid takes the value at which its path to the sun enters the grid.
fn cloud_sun_depth(p: vec3f) -> f32 {
    let size = vec3f(cloud.bricks * CLOUD_EDGE) * cloud.voxel;
    let local = p - cloud.corner;
    let span = span_of(size, local, shading.sun_direction);
    let enter = max(span.x, 0.0);
    var depth = 0.0;
    if span.y > enter {
        let last = vec3f(cloud.nodes - 1u);
        let at = clamp((local + shading.sun_direction * enter) / cloud.pitch, vec3f(0.0), last);
        let low = min(floor(at), max(last - 1.0, vec3f(0.0)));
        let part = at - low;
        let c = vec3u(low);
        let d = min(c + 1u, cloud.nodes - 1u);
        let before = vec4f(
            shade_node(c), shade_node(vec3u(c.x, d.y, c.z)), shade_node(vec3u(c.xy, d.z)),
            shade_node(vec3u(c.x, d.yz)));
        let after = vec4f(
            shade_node(vec3u(d.x, c.yz)), shade_node(vec3u(d.xy, c.z)),
            shade_node(vec3u(d.x, c.y, d.z)), shade_node(d));
        let along_x = mix(before, after, part.x);
        let along_y = mix(along_x.xz, along_x.yw, part.y);
        depth = mix(along_y.x, along_y.y, part.z);
    }
    return depth;
}

// Integrates one kind between two distances along a ray, brick by brick, with steps of at most a
// voxel in bricks that hold some.
fn cloud_along(origin: vec3f, direction: vec3f, from_t: f32, to_t: f32, kind: u32) -> Passed {
    let edge = f32(CLOUD_EDGE) * cloud.voxel;
    let start = origin - cloud.corner;
    let span = span_of(vec3f(cloud.bricks) * edge, start, direction);
    let inverse = safe_inverse(direction);
    let end = min(span.y, to_t);
    var t = max(span.x, from_t);
    var passed = Passed(0.0, 0.0, 0.0, 0.0);
    for (var i = 0; i < MOST_BRICKS && t < end && passed.depth < DEEPEST; i++) {
        // A point just inside the side through which the ray enters.
        let inner = start + direction * (t + 1e-3 * cloud.voxel);
        let brick = vec3u(clamp(inner / edge, vec3f(0.0), vec3f(cloud.bricks) - 0.5));
        let corner = vec3f(brick) * edge;
        let out = (corner + select(vec3f(0.0), vec3f(edge), direction > vec3f(0.0)) - start)
            * inverse;
        let leave = min(max(min(out.x, min(out.y, out.z)), t + 1e-3 * cloud.voxel), end);
        let word = cloud_words[(brick.z * cloud.bricks.y + brick.y) * cloud.bricks.x + brick.x];
        if (word & (HAS_DROPS << kind)) != 0u {
            let slot = word & (HAS_DROPS - 1u);
            let steps = ceil((leave - t) / cloud.voxel);
            let step = (leave - t) / steps;
            for (var k = 0.5; k < steps; k += 1.0) {
                let at = t + k * step;
                let place = start + direction * at;
                let own = cloud_density(slot, (place - corner) / cloud.voxel, kind) * step;
                if own > 0.0 {
                    let seen = exp(-passed.depth) * (1.0 - exp(-own));
                    passed.depth += own;
                    passed.lit += seen * exp(-cloud_sun_depth(place + cloud.corner));
                    passed.far += seen * at;
                }
            }
        }
        t = leave;
    }
    passed.cover = 1.0 - exp(-passed.depth);
    return passed;
}
