// State of PBF's iteration to a density error; mirrored by `IterationControl` of solve/params.rs.
struct IterationControl {
    is_done: u32,
    iterations: u32,
    padding: vec2u,
    // Workgroups of an indirect dispatch over all particles, and over one colour.
    all: vec4u,
    colour: vec4u,
}
