// Position of a particle at the sample's instant. The importing shader must bind `camera` and, with
// PATHS, `paths`: the particle then follows its curve through the neighbouring frames
// (src/render/paths.rs), otherwise a straight line.
#import "shared/ssfr_splat.wgsl"

struct Path {
    // Coefficients of t² and t³, t in seconds, before and after the frame's instant.
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
    return moved_by(particle, index, camera.seconds);
}

// The same at `t` seconds from the frame's instant.
fn moved_by(particle: Particle, index: u32, t: f32) -> vec3f {
    let straight = particle.position + particle.velocity * t;
#ifdef PATHS
    let path = paths[index];
    let square = select(path.after_square, path.before_square, t < 0.0);
    let cube = select(path.after_cube, path.before_cube, t < 0.0);
    return straight + t * t * (square + t * cube);
#else
    return straight;
#endif
}
