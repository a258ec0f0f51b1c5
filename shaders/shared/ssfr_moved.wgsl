// Where a particle is at the sample's instant. Needs the binding `camera` of whoever imports it, and with PATHS `paths`: then it goes
// along the curve that the frames around it say (src/render/paths.rs), without it straight on.
#import "shared/ssfr_splat.wgsl"

struct Path {
    // Metres for the square and the cube of seconds, before the frame's instant and after it.
    before_square: vec3f,
    pad0: f32,
    before_cube: vec3f,
    pad1: f32,
    after_square: vec3f,
    pad2: f32,
    after_cube: vec3f,
    pad3: f32,
}

fn moved(particle: Particle, index: u32) -> vec3f {
    let straight = particle.position + particle.velocity * camera.seconds;
#ifdef PATHS
    let t = camera.seconds;
    let path = paths[index];
    let square = select(path.after_square, path.before_square, t < 0.0);
    let cube = select(path.after_cube, path.before_cube, t < 0.0);
    return straight + t * t * (square + t * cube);
#else
    return straight;
#endif
}
