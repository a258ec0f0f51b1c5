// The surface that the flow left on the coarse level, interpolated on the fine one. Beside an edge, where not all
// four coarse cells lie on the fine one's surface, only what the flow changed there is taken over.
#import "shared/camera.wgsl"
#import "shared/ssfr_flow.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> params: FlowParams;
// Of the fine level.
@group(0) @binding(2) var<uniform> level: FlowLevel;
@group(0) @binding(3) var<storage, read> coarse_before: array<f32>;
@group(0) @binding(4) var<storage, read> coarse_after: array<f32>;
@group(0) @binding(5) var<storage, read> fine: array<f32>;
@group(0) @binding(6) var<storage, read_write> corrected: array<f32>;

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= level.size.x || id.y >= level.size.y {
        return;
    }
    let at = id.y * level.size.x + id.x;
    let z = fine[at];
    corrected[at] = z;
    if z >= FAR || !level_share(params, z, camera.focal, level.level + 1u).reached {
        return;
    }
    let size = vec2i((level.size + 1u) / 2u);
    let cell = 2.0 * z * f32(1u << level.level) / camera.focal;
    let position = (vec2f(id.xy) + 0.5) * 0.5 - 0.5;
    let base = vec2i(floor(position));
    let part = position - floor(position);
    var change = 0.0;
    // In 1/z, where a plane is straight.
    var inverse = 0.0;
    var total = 0.0;
    for (var i = 0; i < 4; i++) {
        let corner = vec2i(i & 1, i >> 1u);
        let c = base + corner;
        if any(c < vec2i(0)) || any(c >= size) {
            continue;
        }
        let index = u32(c.y * size.x + c.x);
        let before = coarse_before[index];
        if is_edge(params, z, before, cell) {
            continue;
        }
        let w = mix(1.0 - part, part, vec2f(corner));
        let after = coarse_after[index];
        change += w.x * w.y * (after - before);
        inverse += w.x * w.y / after;
        total += w.x * w.y;
    }
    if total > 0.999 {
        corrected[at] = 1.0 / inverse;
    } else if total > 0.0 {
        corrected[at] = max(z + change / total, 0.25 * z);
    }
}
