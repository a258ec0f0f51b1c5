// Converts the sums of the sun's light to values, stored after the lattice of sun paths through
// water.
#import "shared/caustics_sums.wgsl"
#import "shared/caustics.wgsl"

@group(0) @binding(0) var<uniform> caustics: Caustics;
@group(0) @binding(1) var<storage, read> light_sums: array<u32>;
@group(0) @binding(2) var<storage, read_write> sun_paths: array<f32>;

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= caustics.size.x || id.y >= 2u * caustics.size.y {
        return;
    }
    let at = id.y * caustics.size.x + id.x;
    sun_paths[caustics.start + at] = f32(light_sums[at]) / LIGHT_SCALE;
}
