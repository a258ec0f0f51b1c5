// Depth of the first hit of the ray through each padded pixel, for splats in front of it.
#import "shared/camera.wgsl"
#import "shared/rays_trace.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> rays: Rays;
@group(0) @binding(2) var<storage, read> level_table: array<u32>;
@group(0) @binding(3) var<storage, read> level_values: array<f32>;
@group(0) @binding(4) var<storage, read> set_nodes: array<SetNode>;
@group(0) @binding(5) var<storage, read> set_triangles: array<Triangle>;
// Depth of the water, or FAR, and of opaque geometry in front of it, or FAR.
@group(0) @binding(6) var<storage, read_write> depth: array<f32>;
@group(0) @binding(7) var<storage, read_write> solid_depth: array<f32>;
#ifdef SPRAY
// Depth of either.
@group(0) @binding(10) var<storage, read_write> first_depth: array<f32>;
#endif
#ifdef SHUTTER
@group(0) @binding(11) var<uniform> moments: array<Moment, 64>;
#endif
#ifdef SEA
@group(0) @binding(8) var<uniform> sea: Sea;
@group(0) @binding(9) var<storage, read> sea_values: array<vec4f>;
#endif

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= camera.size) {
        return;
    }
    let at = id.y * camera.size.x + id.x;
    let eye = open_shutter(id.xy);
    let ray = eye_ray(eye, vec2f(id.xy) + 0.5);
    let along = length(ray);
    let direction = world_direction(eye, ray) / along;
    let found = trace(eye.position, direction, is_wet(eye.position), 0.0, FAR);
    depth[at] = select(FAR, found.t / along, found.kind == WATER);
    solid_depth[at] = select(FAR, found.t / along, found.kind == OPAQUE);
#ifdef SPRAY
    first_depth[at] = select(found.t / along, FAR, found.kind == SKY);
#endif
}
