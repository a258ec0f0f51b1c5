// Spray at a pixel: its coverage, and the means of depth and velocity weighted by it. The importing
// shader must bind `camera`, `spray_params` and `spray`.
#import "shared/ssfr_spray.wgsl"
#import "shared/ssfr_half.wgsl"
#import "shared/ssfr_lights.wgsl"

struct Spray {
    optical_depth: f32,
    cover: f32,
    // Depth along the optical axis, metres.
    depth: f32,
}

fn spray_mean(tap: HalfTap, plane: u32) -> f32 {
    let words = vec4u(spray[tap.at.x + plane], spray[tap.at.y + plane], spray[tap.at.z + plane],
        spray[tap.at.w + plane]);
    let v = vec4f(words) / SPRAY_SCALE;
    return mix(mix(v.x, v.y, tap.part.x), mix(v.z, v.w, tap.part.x), tap.part.y);
}

fn spray_plane() -> u32 {
    let half_size = camera.size / 2u;
    return half_size.x * half_size.y;
}

// Spray at a padded pixel position.
fn spray_at(position: vec2f) -> Spray {
    let tap = half_tap(position);
    let length = spray_mean(tap, 0u);
    if length <= 0.0 {
        return Spray(0.0, 0.0, FAR);
    }
    let optical_depth = spray_params.density * length;
    let depth = spray_mean(tap, spray_plane()) / length * spray_params.range;
    return Spray(optical_depth, 1.0 - exp(-optical_depth), depth);
}

fn spray_signed(tap: HalfTap, plane: u32) -> f32 {
    let words = vec4u(spray[tap.at.x + plane], spray[tap.at.y + plane], spray[tap.at.z + plane],
        spray[tap.at.w + plane]);
    let v = vec4f(bitcast<vec4i>(words)) / SPRAY_SCALE;
    return mix(mix(v.x, v.y, tap.part.x), mix(v.z, v.w, tap.part.x), tap.part.y);
}

// Mean velocity, m/s, where there is spray; requires splatting with MOTION.
fn spray_velocity(position: vec2f) -> vec3f {
    let tap = half_tap(position);
    let plane = spray_plane();
    let sum = vec3f(
        spray_signed(tap, 2u * plane), spray_signed(tap, 3u * plane),
        spray_signed(tap, 4u * plane));
    return sum / spray_mean(tap, 0u) * spray_params.speed;
}

// Adds the light of splats at a position, with their coverage, to the light components.
fn white_parts(position: vec2f, light: vec3f, cover: f32) {
#ifdef FOAM
    let tap = half_tap(position);
    let foam = clamp(spray_mean(tap, 2u * spray_plane())
        / max(spray_mean(tap, 0u), 1.0 / SPRAY_SCALE), 0.0, 1.0);
    light_part(FOAM_LIGHT, light * (cover * foam));
    light_part(WHITE, light * (cover * (1.0 - foam)));
#else
    light_part(WHITE, light * cover);
#endif
}
