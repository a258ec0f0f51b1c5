// Which particles a dispatch handles.
// Colour = parity of the sorted index: the other colour is always close by, and a dispatch over one
// colour is dense.
struct Phase {
    // Of the chunk; even.
    first: u32,
    // Threads of this dispatch.
    count: u32,
    stride: u32,
    colour: u32,
    // Of the Chebyshev semi-iteration; 1 is the plain one.
    acceleration: f32,
}
@group(0) @binding(6) var<uniform> phase: Phase;

// Copies of uniforms that inner loops read: llvmpipe does not hoist uniform loads out of a loop.
var<private> fluid_count: u32;
var<private> inverse_h: f32;

fn begin_phase() {
    fluid_count = params.particle_count;
    inverse_h = params.inverse_support_radius;
}

fn phase_particle(thread: u32) -> u32 {
    return phase.first + thread * phase.stride + phase.colour;
}

// w of `predicted`: λ ≤ 0 of a particle, or the weight > 0 of a boundary sample in particles' worth.
fn weight(w: f32) -> f32 {
#ifdef SOLIDS
    return select(1.0, w, w > 0.0);
#else
    return 1.0;
#endif
}
