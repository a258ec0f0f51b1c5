// Counters that passes add to over a frame; mirrored by `Counters` of solve/params.rs.
struct Counters {
    // Times that a particle's displacement was reduced to the cap.
    capped: atomic<u32>,
    // Times that a particle had more neighbours than its list holds. PBF only.
    searched: atomic<u32>,
    // Iterations of solves that stop at a density error. PBF only.
    iterations: atomic<u32>,
    // Number of non-finite values.
    not_finite: atomic<u32>,
}
