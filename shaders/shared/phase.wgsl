// Which particles a dispatch handles, and in which half of `predicted` their neighbours stand.
// Colour = parity of the sorted index: the other colour is always close by, and a dispatch over one
// colour is dense.
struct Phase {
    // Of the chunk; even.
    first: u32,
    // Threads of this dispatch.
    count: u32,
    stride: u32,
    colour: u32,
    read_even: u32,
    read_odd: u32,
    write: u32,
    // Particles of the chunk.
    chunk_count: u32,
}
@group(0) @binding(6) var<uniform> phase: Phase;

fn phase_particle(thread: u32) -> u32 {
    return phase.first + thread * phase.stride + phase.colour;
}

// Boundary samples follow both halves; their index counts on from the particles'.
fn stored_index(j: u32) -> u32 {
    let half = select(phase.read_even, phase.read_odd, (j & 1u) == 1u);
    return j + select(half, params.particle_count, j >= params.particle_count);
}
