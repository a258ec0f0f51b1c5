// One sample of the picture by ray casting: sky, ground and solids, and the water with everything
// visible in and through it.
#import "shared/camera.wgsl"
#import "shared/ssfr_band.wgsl"
#import "shared/rays_light.wgsl"
#import "shared/ssfr_store.wgsl"
#ifdef VOLUME
#import "shared/ssfr_spray_read.wgsl"
#endif

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> shading: Shading;
@group(0) @binding(2) var<uniform> band: Band;
@group(0) @binding(3) var<uniform> rays: Rays;
@group(0) @binding(4) var<storage, read> level_table: array<u32>;
@group(0) @binding(5) var<storage, read> level_values: array<f32>;
@group(0) @binding(6) var<storage, read> sun_paths: array<f32>;
@group(0) @binding(7) var<storage, read> set_nodes: array<SetNode>;
@group(0) @binding(8) var<storage, read> set_triangles: array<Triangle>;
@group(0) @binding(9) var sky: texture_2d<f32>;
@group(0) @binding(10) var sky_sampler: sampler;
@group(0) @binding(11) var shadow_map: texture_depth_2d;
@group(0) @binding(12) var shadow_sampler: sampler_comparison;
@group(0) @binding(13) var<storage, read_write> output: array<vec4f>;
#ifdef VOLUME
@group(0) @binding(14) var<storage, read> spray: array<u32>;
// Depth of the first hit of each ray.
@group(0) @binding(15) var<storage, read> first_depth: array<f32>;
@group(0) @binding(16) var<storage, read> cloud_words: array<u32>;
@group(0) @binding(20) var<uniform> spray_params: SprayParams;
@group(0) @binding(21) var<uniform> cloud: Cloud;
#endif
#ifdef SEA
@group(0) @binding(17) var<uniform> sea: Sea;
@group(0) @binding(18) var<storage, read> sea_values: array<vec4f>;
#endif
#ifdef SHUTTER
@group(0) @binding(22) var<uniform> moments: array<Moment, 64>;
#endif
#ifdef PALETTE
@group(0) @binding(19) var<uniform> palette: array<vec4f, 64>;
#endif
#ifdef MATERIALS
@group(0) @binding(24) var<uniform> materials: array<Material, 256>;
@group(0) @binding(25) var solid_texels: texture_2d<f32>;
#endif

#ifdef VOLUME
// Radiance over coverage of drops splatted in front of the eye ray's hit at `end`. The grid gives
// the fraction of sunlight that reaches them; where it has no drops, they are lit as at `mean`.
fn drops_before(
    eye: vec3f, direction: vec3f, mean: f32, end: f32, optical_depth: f32,
) -> vec3f {
    let passed = cloud_along(eye, direction, 0.0, min(end, endless()) + cloud.skin, DROPS);
    var far = mean;
    var lit = exp(-cloud_sun_depth(eye + direction * mean));
    if passed.cover > 0.0 {
        far = passed.far / passed.cover;
        lit = passed.lit / passed.cover;
    }
    let light = drops_radiance(eye + direction * far, -direction, optical_depth, lit);
    return hazed(light, far, direction);
}
#endif
#ifdef CAUSTICS
@group(0) @binding(30) var<uniform> caustics: Caustics;
#endif

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= camera.picture.x || id.y >= band.rows {
        return;
    }
    let pixel = vec2u(id.x, id.y + band.row) + camera.margin;
    let out = id.y * camera.picture.x + id.x;
    let eye = open_shutter(pixel);
    let ray = eye_ray(eye, vec2f(pixel) + 0.5);
    let direction = normalize(world_direction(eye, ray));
    let inside = is_wet(eye.position);
    own_place = hash2(
        vec2i(vec2f(pixel) - camera.corner) + vec2i(7919 * i32(camera.sample_index), 0));
#ifdef VOLUME
    // The first hit is known; in air, tracing starts just before it.
    let known = first_depth[pixel.y * camera.size.x + pixel.x];
    let start = select(
        max(known * length(ray) - 2.0 * rays.voxel, 0.0), 0.0, inside || known >= FAR);
    let reach = select(known * length(ray) - start + 2.0 * rays.voxel, 0.0, known >= FAR);
    var value = radiance_along(
        eye.position + direction * start, direction, inside, start, reach);
    let mist = spray_at(vec2f(pixel) + 0.5);
    if mist.cover > 0.0 && !inside {
        let white = drops_before(eye.position, direction, min(known, mist.depth) * length(ray),
            known * length(ray), mist.optical_depth);
        value = mix(value, vec4f(white, 1.0), mist.cover);
        dim_parts(1.0 - mist.cover);
        white_parts(vec2f(pixel) + 0.5, white, mist.cover);
    }
#else
    let value = radiance_along(eye.position, direction, inside, 0.0, FAR);
#endif
    store_light(out, value, camera.weight, camera.sample_index == 0u);
}
