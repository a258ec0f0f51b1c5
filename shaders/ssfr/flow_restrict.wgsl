// Computes the next coarser level: the nearest of four depths, averaged with those on the same
// surface.
#import "shared/camera.wgsl"
#import "shared/ssfr_flow.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> params: FlowParams;
// Of the fine level.
@group(0) @binding(2) var<uniform> level: FlowLevel;
@group(0) @binding(3) var<storage, read> fine: array<f32>;
@group(0) @binding(4) var<storage, read_write> coarse: array<f32>;

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = (level.size + 1u) / 2u;
    if id.x >= size.x || id.y >= size.y {
        return;
    }
    var z: array<f32, 4>;
    var nearest = FAR;
    for (var i = 0u; i < 4u; i++) {
        let at = 2u * id.xy + vec2u(i & 1u, i >> 1u);
        z[i] = FAR;
        if all(at < level.size) {
            z[i] = fine[at.y * level.size.x + at.x];
        }
        nearest = min(nearest, z[i]);
    }
    var mean = FAR;
    if nearest < FAR {
        let cell = nearest * f32(1u << level.level) / camera.focal;
        var sum = 0.0;
        var count = 0.0;
        for (var i = 0u; i < 4u; i++) {
            if !is_edge(params, nearest, z[i], cell) {
                // In 1/z, in which a plane is straight.
                sum += 1.0 / z[i];
                count += 1.0;
            }
        }
        mean = count / sum;
    }
    coarse[id.y * size.x + id.x] = mean;
}
