// Additional channels by ray casting: the first hit of the ray through a pixel's centre, and the
// water along the straight line of sight.
#import "shared/camera.wgsl"
#import "shared/ssfr_band.wgsl"
#import "shared/ssfr_splat.wgsl"
#import "shared/ssfr_aovs.wgsl"
#import "shared/rays_trace.wgsl"
#ifdef SPRAY
#import "shared/ssfr_spray_read.wgsl"
#endif
#ifdef CARRIED
#import "shared/ssfr_carried.wgsl"
#endif

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> next_camera: Camera;
@group(0) @binding(2) var<uniform> band: Band;
@group(0) @binding(3) var<uniform> rays: Rays;
@group(0) @binding(4) var<storage, read> level_table: array<u32>;
@group(0) @binding(5) var<storage, read> level_values: array<f32>;
@group(0) @binding(6) var<storage, read> set_nodes: array<SetNode>;
@group(0) @binding(7) var<storage, read> set_triangles: array<Triangle>;
@group(0) @binding(8) var<storage, read_write> output: array<f32>;
#ifdef FORWARD
@group(0) @binding(9) var<storage, read> owner: array<u32>;
@group(0) @binding(10) var<storage, read> particles: array<Particle>;
#endif
#ifdef SPRAY
@group(0) @binding(11) var<storage, read> spray: array<u32>;
@group(0) @binding(12) var<uniform> spray_params: SprayParams;
#endif

#ifdef CARRIED
@group(0) @binding(15) var<uniform> carried: array<Carried, 256>;
#endif

#ifdef SHUTTER
@group(0) @binding(16) var<uniform> moments: array<Moment, 64>;
#endif
#ifdef SEA
@group(0) @binding(13) var<uniform> sea: Sea;
@group(0) @binding(14) var<storage, read> sea_values: array<vec4f>;
#endif

// Largest number of surfaces along a line of sight.
const MOST_SURFACES: i32 = 32;

// Metres of water on a straight line up to opaque geometry.
fn water_along(start: vec3f, direction: vec3f) -> f32 {
    var origin = start;
    var inside = is_wet(origin);
    var sum = 0.0;
    for (var k = 0; k < MOST_SURFACES; k++) {
        let found = trace(origin, direction, inside, length(origin - start), FAR);
        if found.kind == SKY {
            break;
        }
        if inside {
            sum += found.t;
        }
        if found.kind == OPAQUE {
            break;
        }
        origin += direction * found.after;
        inside = !inside;
    }
    return sum;
}

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= camera.picture.x || id.y >= band.rows {
        return;
    }
    let pixel = vec2u(id.x, id.y + band.row) + camera.margin;
    let out = id.y * camera.picture.x + id.x;
    let eye = open_shutter(pixel);
    let ray = eye_ray(eye, vec2f(pixel) + 0.5);
    let along = length(ray);
    let direction = world_direction(eye, ray) / along;
    let through = water_along(eye.position, direction);
    let found = trace(eye.position, direction, is_wet(eye.position), 0.0, FAR);
    let over = spray_over(vec2i(pixel), ray);
    if found.kind == SKY {
        let motion = motion_to(sky_in_next(direction), vec2i(pixel));
        store_under(over, out, FAR, vec3f(0.0), vec3f(0.0), motion, through);
        return;
    }
    let position = eye.position + direction * found.t;
    let normal = select(found.normal, -found.normal, dot(found.normal, direction) > 0.0);
    var moved = position;
#ifdef CARRIED
    if found.kind == OPAQUE {
        moved = carried_to_next(found.material, position);
    }
#endif
#ifdef SEA
    let is_beyond = is_sea(position.xz);
    if found.kind == WATER && is_beyond {
        moved += sea_velocity(position.xz) * camera.frame_seconds;
    }
#endif
#ifdef FORWARD
    if found.kind == WATER {
        let particle = owner[pixel.y * camera.size.x + pixel.x];
        if particle < camera.particle_count {
            moved += particles[particle].velocity * camera.frame_seconds;
        }
    }
#endif
    let motion = motion_to(eye_from_world(next_camera, moved), vec2i(pixel));
    store_under(over, out, found.t / along, normal, position, motion, through);
}
