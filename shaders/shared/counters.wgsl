// What passes count over a frame; `Counters` of solve/params.rs.
struct Counters {
    // Times that a particle was slowed to the displacement cap.
    capped: atomic<u32>,
    // Times that a particle had more neighbours than its list holds.
    searched: atomic<u32>,
    // Iterations until a density error.
    iterations: atomic<u32>,
    // Values that are not finite.
    not_finite: atomic<u32>,
}
