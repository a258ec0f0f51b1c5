// The narrow-range filter (Truong and Yuksel 2018) along one axis. Distances and widths are in
// pixels, the range in metres.
#import "shared/camera.wgsl"
#import "shared/ssfr_narrow.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> params: NarrowParams;
@group(0) @binding(2) var<storage, read> source: array<f32>;
@group(0) @binding(3) var<storage, read> solid_depth: array<f32>;
@group(0) @binding(4) var<storage, read_write> smoothed: array<f32>;

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
    let sigma = axis_sigma(params.width * camera.focal / z);
    let reach = i32(ceil(2.5 * sigma));
    let stride = select(1, i32(camera.size.x), params.axis == 1u);
    let here = i32(select(id.x, id.y, params.axis == 1u));
    let most = i32(select(camera.size.x, camera.size.y, params.axis == 1u)) - 1;
    var range = NarrowRange(params.range, params.range);
    var sum = 1.0 / z;
    var total = 1.0;
    let steepness = -0.5 / max(sigma * sigma, 1e-6);
    for (var k = 1; k <= min(reach, min(here, most - here)); k++) {
        let pair = narrow_pair(&range, i32(at) - k * stride, i32(at) + k * stride, z);
        let w = exp(steepness * f32(k * k)) * pair.weight;
        sum += w * pair.inverse;
        total += 2.0 * w;
    }
    smoothed[at] = total / sum;
}
