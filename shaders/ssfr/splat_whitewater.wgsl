// Splats spray, foam and bubbles in front of the surface or just below it, at half resolution;
// these whiten the water.
#import "shared/camera.wgsl"
#import "shared/ssfr_splat.wgsl"
#import "shared/ssfr_spray_add.wgsl"
#import "shared/ssfr_streak.wgsl"

struct Whitewater {
    // World position and radius, metres.
    position: vec3f,
    radius: f32,
    velocity: vec3f,
    // 1 for foam and bubbles, 0 for spray.
    foam: f32,
}

struct WhitewaterParams {
    // Number of whitewater particles.
    count: u32,
    // Factor on radii.
    size: f32,
    // Optical density relative to that of the sums.
    density: f32,
    // Depth at which the water above a bubble has removed 63 % of its white, metres.
    fading: f32,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var<uniform> whitewater_params: WhitewaterParams;
@group(0) @binding(2) var<storage, read> whitewater: array<Whitewater>;
@group(0) @binding(3) var<storage, read> solid_depth: array<f32>;
@group(0) @binding(4) var<storage, read> surface: array<f32>;
@group(0) @binding(5) var<storage, read_write> spray: array<atomic<u32>>;
@group(0) @binding(6) var<uniform> spray_params: SprayParams;
#ifdef SHUTTER
@group(0) @binding(21) var<uniform> moments: array<Moment, 64>;
#endif

fn splat(one: Whitewater, c: vec3f, share: f32) {
    let half_size = camera.size / 2u;
    let own = whitewater_params.size * one.radius;
    // At least 0.7 pixels of the half resolution, so that small particles become fainter instead of
    // being missed; the volume is kept.
    let radius = max(own, 1.4 * c.z / camera.focal);
    let shrunk = own / radius;
    let weight = share * whitewater_params.density * shrunk * shrunk * shrunk;
    let bounds = sphere_bounds(camera, c, radius, 0.5, half_size);
    for (var y = bounds.y; y <= bounds.w; y++) {
        for (var x = bounds.x; x <= bounds.z; x++) {
            let pixel = vec2u(vec2i(x, y));
            let at = 2u * (pixel.y * camera.size.x + pixel.x);
            let seen = before(solid_depth[at], c.z, radius);
            if seen <= 0.0 {
                continue;
            }
            let ray = eye_ray(camera, 2.0 * vec2f(pixel) + 1.0);
            let chord = max(hit_sphere(ray, c, radius).chord, 0.0);
            // Water above it removes its white.
            let under = max(c.z - surface[at], 0.0);
            let amount = chord * weight * seen * exp(-under / whitewater_params.fading);
            add_spray(pixel, amount, c.z, one.velocity);
#ifdef FOAM
            add_foam(pixel, amount * one.foam);
#endif
        }
    }
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = (group.x + group.y * groups.x) * 64u + lane;
    if index >= whitewater_params.count {
        return;
    }
    let one = whitewater[index];
    let c = eye_from_world(camera, one.position + one.velocity * camera.seconds);
    var streak = vec3f(0.0);
#ifdef SHUTTER
    streak = streak_between(
        one.position + one.velocity * moments[0].seconds,
        one.position + one.velocity * moments[MOMENTS - 1u].seconds);
#endif
    let radius = whitewater_params.size * one.radius * camera.focal / max(c.z, 1e-6);
    let beads = beads_along(streak, c, max(radius, 1.4));
    for (var bead = 0u; bead < beads; bead++) {
        splat(one, c + bead_off(streak, bead, beads), 1.0 / f32(beads));
    }
}
