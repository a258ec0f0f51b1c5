// Removes what two passes along the axes leave of each other's edges, with a small two-dimensional
// window (Truong and Yuksel 2018, section 4.3): pairs of samples on either side of the centre, with
// the range of the previous passes.
#import "shared/camera.wgsl"
#import "shared/ssfr_narrow.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> params: NarrowParams;
@group(0) @binding(2) var<storage, read> source: array<f32>;
@group(0) @binding(3) var<storage, read> solid_depth: array<f32>;
@group(0) @binding(4) var<storage, read_write> smoothed: array<f32>;

// Pixels on each side of the centre.
const REACH: i32 = 3;

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
    let sigma = clean_sigma(params.width * camera.focal / z);
    let steepness = -0.5 / max(sigma * sigma, 1e-6);
    let place = vec2i(id.xy);
    let room = min(place, vec2i(camera.size) - 1 - place);
    let reach = min(vec2i(REACH), room);
    var range = NarrowRange(params.range, params.range);
    var sum = 1.0 / z;
    var total = 1.0;
    // Half of the window; the other half are the mirror images.
    for (var y = 0; y <= reach.y; y++) {
        for (var x = select(-reach.x, 1, y == 0); x <= reach.x; x++) {
            let step = y * i32(camera.size.x) + x;
            let pair = narrow_pair(&range, i32(at) - step, i32(at) + step, z);
            let w = exp(steepness * f32(x * x + y * y)) * pair.weight;
            sum += w * pair.inverse;
            total += 2.0 * w;
        }
    }
    smoothed[at] = total / sum;
}
