// Depth of the solids as seen by the sun.
#import "shared/ssfr_solid.wgsl"

@group(0) @binding(0) var<uniform> shadow_from_world: mat4x4f;
@group(0) @binding(1) var<storage, read> triangles: array<Triangle>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return shadow_from_world * vec4f(corner(triangles[index / 3u], index % 3u), 1.0);
}
