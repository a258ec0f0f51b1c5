// The particles that a dispatch handles. A particle's colour is the parity of its sorted index:
// particles of the other colour are always close by, and a dispatch over one colour is dense.
// Mirrored by `Phase` of solve/params.rs.
struct Phase {
    // First particle of the chunk; even.
    first: u32,
    // Threads of the dispatch.
    count: u32,
    stride: u32,
    colour: u32,
    // Factor of the Chebyshev semi-iteration; 1 is the plain iteration.
    acceleration: f32,
}
@group(0) @binding(6) var<uniform> phase: Phase;

// Copies of uniforms for inner loops: llvmpipe does not hoist uniform loads out of loops.
var<private> fluid_count: u32;
var<private> inverse_h: f32;

fn begin_phase() {
    fluid_count = params.particle_count;
    inverse_h = params.inverse_support_radius;
}

fn phase_particle(thread: u32) -> u32 {
    return phase.first + thread * phase.stride + phase.colour;
}

// The w of `predicted` is λ ≤ 0 for a particle, or for a boundary sample its weight > 0 in units of
// a particle's mass. Returns the weight; 1 for a particle.
fn weight(w: f32) -> f32 {
#ifdef SOLIDS
    return select(1.0, w, w > 0.0);
#else
    return 1.0;
#endif
}
