// What splats sum up of spray and whitewater, at half resolution: planes of one word a cell, optical length first, then that times
// depth, and with MOTION times each axis of velocity; with FOAM, without MOTION, that of foam and bubbles alone.
#import "shared/ssfr_splat.wgsl"

struct SprayParams {
    // Optical density of what stands in the sums, 1/m.
    density: f32,
    // d³ / (4/3 π r³): the volume that a particle stands for over that of its sphere.
    scale: f32,
    // Depth and speed that stand for 1 in the sums, metres and m/s: none is larger.
    range: f32,
    speed: f32,
}

// Fixed point of the sums: integer atomics add up to the same bits in any order. They hold 1024 m.
const SPRAY_SCALE: f32 = 4194304.0;
