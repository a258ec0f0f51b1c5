// The channels that stand beside the picture. Needs the bindings `next_camera` and `output` of whoever imports it: ten floats a
// pixel, Z, N, P, forward and thickness.
#import "shared/camera.wgsl"

// Where `next`, in the eye space of the next frame, stands in its picture less where `pixel` is, in pixels; rightward and
// upward are positive, as motion vectors are counted in compositing (rows of the picture are counted downward).
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

// A direction in the eye space of the next frame: the sky is infinitely far, and only where that camera looks moves it, not where
// it stands.
fn sky_in_next(direction: vec3f) -> vec3f {
    return vec3f(
        dot(direction, next_camera.right),
        dot(direction, next_camera.up),
        dot(direction, next_camera.forward),
    );
}
