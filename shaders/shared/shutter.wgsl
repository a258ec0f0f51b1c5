// Instants of a sample's rays while the shutter is open (`Moments` of src/render/samples.rs). With
// SHUTTER each pixel's ray has one of its own: all that it meets is at that instant, and so is the
// camera. The importing shader must bind `camera` and, with SHUTTER, `moments`.
#import "shared/camera.wgsl"
#ifdef SHUTTER
#import "shared/hash.wgsl"

struct Moment {
    // The camera's pose, focal length and principal point, as in `Camera`.
    position: vec3f,
    // Seconds from the frame's instant.
    seconds: f32,
    right: vec3f,
    focal: f32,
    up: vec3f,
    // Time since the sample's instant over the time of all moments.
    part: f32,
    forward: vec3f,
    // Seconds since the level set's instant.
    since: f32,
    centre: vec2f,
    // Largest component of the water's velocities beside the level set, m/s.
    speed: f32,
    // Differs between frames and samples.
    seed: u32,
}

const MOMENTS: u32 = 64u;

// Of the pixel's own moment: `since`, `speed`, `part`, and the seconds since the sample's instant.
var<private> own_since: f32 = 0.0;
var<private> own_speed: f32 = 0.0;
var<private> own_part: f32 = 0.0;
var<private> own_delay: f32 = 0.0;

fn take_moment(index: u32) {
    own_since = moments[index].since;
    own_speed = moments[index].speed;
    own_part = moments[index].part;
    own_delay = moments[index].seconds - camera.seconds;
}

// The sample's camera at one of its moments.
fn camera_at(index: u32) -> Camera {
    var at = camera;
    at.position = moments[index].position;
    at.seconds = moments[index].seconds;
    at.right = moments[index].right;
    at.focal = moments[index].focal;
    at.up = moments[index].up;
    at.forward = moments[index].forward;
    at.centre = moments[index].centre;
    return at;
}

// Takes the moment of a padded pixel, and returns the camera at it.
fn open_shutter(pixel: vec2u) -> Camera {
    let at = bitcast<vec2u>(vec2i(vec2f(pixel) - camera.corner));
    let index = pcg(at.x ^ pcg(at.y ^ pcg(moments[0].seed))) >> 26u;
    take_moment(index);
    return camera_at(index);
}
#else

fn open_shutter(pixel: vec2u) -> Camera {
    return camera;
}
#endif
