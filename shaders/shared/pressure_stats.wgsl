// What a projection notes; `PressureStats` of solve/pressure/params.rs. Whoever imports it says whether a `note` is an
// atomic word or a plain one.
struct PressureStats {
    // Bits of the largest |∇·u| in a cell of water before the projection and after it, 1/s: those of floats that are not
    // negative order as the floats do.
    divergence_before: note,
    divergence_after: note,
    // The same of the largest |mean of ∇·u| over a pocket.
    incompatible: note,
    // Cells of water without an open face.
    dropped: note,
    // Bodies of water that no air touches.
    pockets: note,
    padding: array<u32, 3>,
}
