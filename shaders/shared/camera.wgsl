// A pinhole camera over a frame that is padded on all sides, so that filters have neighbours at its
// edge. Eye space: x right, y up, z forward; an eye-space depth is a positive z. World positions
// are relative to the domain's least corner, which keeps f32 accurate when a scene is far from the
// origin.

struct Camera {
    position: vec3f,
    // Seconds from the frame's instant to that of this sample: particles are drawn at x + v
    // seconds.
    seconds: f32,
    right: vec3f,
    // Focal length in pixels.
    focal: f32,
    up: vec3f,
    particle_count: u32,
    forward: vec3f,
    // Splat radius, metres.
    radius: f32,
    // Principal point in pixels from `corner`, less the sample's jitter; bitwise equal with and
    // without overscan.
    centre: vec2f,
    // Padded size in pixels.
    size: vec2u,
    // Pixels of padding left of and above the shaded area.
    margin: vec2u,
    // Size of the shaded area in pixels.
    picture: vec2u,
    // Weight of this sample in the pixel's mean; the first sample overwrites the previous content.
    weight: f32,
    sample_index: u32,
    // Seconds since frame 0.
    clock: f32,
    // Seconds from this frame to the next.
    frame_seconds: f32,
    // Origin of the padded frame without overscan, in padded pixels: a multiple of 64.
    corner: vec2f,
    // Depth of the near plane of opaque geometry, metres.
    near: f32,
    // Number of leading triangles that belong to closed bodies with the eye outside.
    closed: u32,
}

// Number of samples per pixel. Where a single sample would take several taps, the samples divide
// them among themselves.
fn sample_count(camera: Camera) -> u32 {
    return u32(1.0 / camera.weight + 0.5);
}

// Depth of the background; finite, because drivers with fast math may assume that there is no
// infinity.
const FAR: f32 = 1e30;

fn eye_ray(camera: Camera, pixel: vec2f) -> vec3f {
    let offset = (pixel - camera.corner - camera.centre) / camera.focal;
    return vec3f(offset.x, -offset.y, 1.0);
}

fn eye_from_world(camera: Camera, world: vec3f) -> vec3f {
    let d = world - camera.position;
    return vec3f(dot(d, camera.right), dot(d, camera.up), dot(d, camera.forward));
}

fn world_direction(camera: Camera, eye: vec3f) -> vec3f {
    return camera.right * eye.x + camera.up * eye.y + camera.forward * eye.z;
}

fn world_from_eye(camera: Camera, eye: vec3f) -> vec3f {
    return camera.position + world_direction(camera, eye);
}

// Projects to pixels from `corner`; z must be positive.
fn project(camera: Camera, eye: vec3f) -> vec2f {
    return camera.centre + camera.focal * vec2f(eye.x, -eye.y) / eye.z;
}
