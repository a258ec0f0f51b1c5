// Adds the light of spray to a sample that shade has dimmed for it, in the tiles with spray.
#import "shared/camera.wgsl"
#import "shared/ssfr_band.wgsl"
#import "shared/ssfr_tiles.wgsl"
#import "shared/ssfr_store.wgsl"
#import "shared/ssfr_spray_read.wgsl"
#import "shared/ssfr_spray_front.wgsl"
#import "shared/ssfr_spray_light.wgsl"

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> shading: Shading;
@group(0) @binding(2) var<uniform> band: Band;
@group(0) @binding(3) var sky: texture_2d<f32>;
@group(0) @binding(4) var sky_sampler: sampler;
@group(0) @binding(5) var shadow_map: texture_depth_2d;
@group(0) @binding(6) var shadow_sampler: sampler_comparison;
@group(0) @binding(7) var<storage, read_write> output: array<vec4f>;
@group(0) @binding(8) var<storage, read> spray: array<u32>;
@group(0) @binding(9) var<uniform> spray_params: SprayParams;
@group(0) @binding(10) var<storage, read> tiles: array<u32>;

@compute @workgroup_size(16, 4)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_id) thread: vec3u,
) {
    let place = group.x + group.y * groups.x;
    if place >= tiles[WET] {
        return;
    }
    let id = pixel_of_tile(tiles[FIRST_TILE + place], thread, camera.margin + vec2u(0u, band.row));
    if id.x >= camera.picture.x || id.y >= band.rows {
        return;
    }
    let pixel = vec2f(vec2u(id.x, id.y + band.row) + camera.margin) + 0.5;
    let mist = spray_at(pixel);
    if mist.cover <= 0.0 {
        return;
    }
    let ray = eye_ray(camera, pixel);
    let direction = normalize(world_direction(camera, ray));
    let far = mist.depth * length(ray);
    let facing = world_direction(camera, spray_normal(pixel, mist.depth));
    let lit = sunlit(camera.position + direction * far, vec3f(0.0, 1.0, 0.0));
    let light = spray_radiance(-direction, facing, mist.optical_depth, lit);
    let white = hazed(light, far, direction);
    white_parts(pixel, white, mist.cover);
    store_light(
        id.y * camera.picture.x + id.x, vec4f(white, 1.0) * mist.cover, camera.weight, false);
}
