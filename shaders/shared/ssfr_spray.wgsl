// Sums of spray and whitewater splats at half resolution, in planes of one word per cell: optical
// length, and optical length times depth; with MOTION also times each component of velocity; with
// FOAM but without MOTION also the optical length of foam and bubbles only.
#import "shared/ssfr_splat.wgsl"

struct SprayParams {
    // Optical density of the sums, 1/m.
    density: f32,
    // d³ / (4/3 π r³): volume of a particle over that of its sphere.
    scale: f32,
    // Depth, metres, and speed, m/s, that 1 represents in the sums; no value is larger.
    range: f32,
    speed: f32,
}

// Fixed-point scale of the sums: integer atomics give the same bits in any order. A sum holds up to
// 1024 m.
const SPRAY_SCALE: f32 = 4194304.0;
