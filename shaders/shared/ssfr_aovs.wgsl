// Additional channels. The importing shader must bind `camera`, `next_camera` and `output` (ten
// floats per pixel: Z, N, P, forward, thickness), and with SPRAY, whose sums must then have MOTION,
// the bindings of ssfr_spray_read.wgsl.
#import "shared/camera.wgsl"

// Position of `next`, in the eye space of the next frame, in its picture minus that of `pixel`, in
// pixels. Right and up are positive, as in motion vectors for compositing, while picture rows count
// downward.
fn motion_to(next: vec3f, pixel: vec2i) -> vec2f {
    let shift = project(next_camera, vec3f(next.xy, max(next.z, 1e-3)))
        - (vec2f(pixel) - next_camera.corner + 0.5);
    return vec2f(shift.x, -shift.y);
}

fn store(at: u32, depth: f32, normal: vec3f, position: vec3f, motion: vec2f, through: f32) {
    let base = 10u * at;
    output[base] = depth;
    output[base + 1u] = normal.x;
    output[base + 2u] = normal.y;
    output[base + 3u] = normal.z;
    output[base + 4u] = position.x;
    output[base + 5u] = position.y;
    output[base + 6u] = position.z;
    output[base + 7u] = motion.x;
    output[base + 8u] = motion.y;
    output[base + 9u] = through;
}

// Spray in front of everything else at a pixel.
struct Over {
    is_seen: bool,
    depth: f32,
    position: vec3f,
    motion: vec2f,
}

// Depth, position and motion of spray that hides more than half of what is behind.
fn spray_over(pixel: vec2i, ray: vec3f) -> Over {
#ifdef SPRAY
    let mist = spray_at(vec2f(pixel) + 0.5);
    if mist.cover > 0.5 {
        let position = world_from_eye(camera, ray * mist.depth);
        let next = position + spray_velocity(vec2f(pixel) + 0.5) * camera.frame_seconds;
        return Over(
            true, mist.depth, position, motion_to(eye_from_world(next_camera, next), pixel));
    }
#endif
    return Over(false, FAR, vec3f(0.0), vec2f(0.0));
}

// Like `store`, for what is behind the spray.
fn store_under(
    over: Over, at: u32, depth: f32, normal: vec3f, position: vec3f, motion: vec2f, through: f32,
) {
    store(
        at, select(depth, over.depth, over.is_seen), normal,
        select(position, over.position, over.is_seen),
        select(motion, over.motion, over.is_seen), through);
}

// A direction in the eye space of the next frame: the sky is infinitely distant, so only the
// rotation of that camera moves it.
fn sky_in_next(direction: vec3f) -> vec3f {
    return vec3f(
        dot(direction, next_camera.right),
        dot(direction, next_camera.up),
        dot(direction, next_camera.forward),
    );
}
