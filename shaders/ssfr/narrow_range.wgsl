// The narrow-range filter (Truong and Yuksel 2018) along one axis; depths here are positive, so the paper's
// inequalities are turned round. Distances and widths are in pixels, the range in metres.
#import "shared/camera.wgsl"

struct NarrowParams {
    // Standard deviation, metres in the world.
    width: f32,
    // Half of the range that counts as one surface (δ).
    range: f32,
    // How far behind the centre a sample beyond the range is placed (μ).
    offset: f32,
    // 0 along x, 1 along y.
    axis: u32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> params: NarrowParams;
@group(0) @binding(2) var<storage, read> source: array<f32>;
@group(0) @binding(3) var<storage, read_write> smoothed: array<f32>;

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= camera.size) {
        return;
    }
    let at = id.y * camera.size.x + id.x;
    let z = source[at];
    smoothed[at] = z;
    if z >= FAR {
        return;
    }
    let sigma = params.width * camera.focal / z;
    let reach = i32(ceil(2.5 * sigma));
    let stride = select(1, i32(camera.size.x), params.axis == 1u);
    let here = i32(select(id.x, id.y, params.axis == 1u));
    let most = i32(select(camera.size.x, camera.size.y, params.axis == 1u)) - 1;
    var near_limit = params.range;
    var far_limit = params.range;
    // Means are of 1/z, in which a plane seen at a slant is straight and stays where it is.
    var sum = 1.0 / z;
    var total = 1.0;
    let steepness = -0.5 / max(sigma * sigma, 1e-6);
    for (var k = 1; k <= min(reach, min(here, most - here)); k++) {
        var a = source[i32(at) - k * stride];
        var b = source[i32(at) + k * stride];
        // Something else stands in front: it goes, and its mirror with it.
        if a < z - near_limit || b < z - near_limit {
            continue;
        }
        let in_a = a <= z + far_limit;
        let in_b = b <= z + far_limit;
        // The range widens with what was accepted.
        if in_a && in_b {
            near_limit = max(near_limit, z - min(a, b) + params.range);
            far_limit = max(far_limit, max(a, b) - z + params.range);
        }
        a = select(z + params.offset, a, in_a);
        b = select(z + params.offset, b, in_b);
        let w = exp(steepness * f32(k * k));
        sum += w * (1.0 / a + 1.0 / b);
        total += 2.0 * w;
    }
    smoothed[at] = total / sum;
}
