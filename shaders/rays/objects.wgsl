// Object of the first hit of each ray of a sample, and the fraction that spray covers.
#import "shared/camera.wgsl"
#import "shared/ssfr_band.wgsl"
#import "shared/rays_trace.wgsl"
#ifdef SPRAY
#import "shared/ssfr_spray_read.wgsl"
#endif

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> band: Band;
@group(0) @binding(2) var<uniform> rays: Rays;
@group(0) @binding(3) var<storage, read> level_table: array<u32>;
@group(0) @binding(4) var<storage, read> level_values: array<f32>;
@group(0) @binding(5) var<storage, read> set_nodes: array<SetNode>;
@group(0) @binding(6) var<storage, read> set_triangles: array<Triangle>;
@group(0) @binding(7) var<storage, read_write> output: array<vec2u>;
#ifdef SPRAY
@group(0) @binding(8) var<storage, read> spray: array<u32>;
@group(0) @binding(9) var<uniform> spray_params: SprayParams;
#endif

#ifdef SHUTTER
@group(0) @binding(11) var<uniform> moments: array<Moment, 64>;
#endif
#ifdef SEA
@group(0) @binding(14) var<uniform> sea: Sea;
@group(0) @binding(15) var<storage, read> sea_values: array<vec4f>;
#endif

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= camera.picture.x || id.y >= band.rows {
        return;
    }
    let pixel = vec2u(id.x, id.y + band.row) + camera.margin;
    let eye = open_shutter(pixel);
    let direction = normalize(world_direction(eye, eye_ray(eye, vec2f(pixel) + 0.5)));
    let found = trace(eye.position, direction, is_wet(eye.position), 0.0, FAR);
    var object = found.material;
    if found.kind == WATER {
        object = 0u;
    }
    var cover = 0.0;
#ifdef SPRAY
    cover = spray_at(vec2f(pixel) + 0.5).cover;
#endif
    output[id.y * camera.picture.x + id.x] = vec2u(object, bitcast<u32>(cover));
}
