// Statistics of a projection; mirrored by `PressureStats` of solve/pressure/params.rs. The importer
// defines `note` as an atomic or a plain word.
struct PressureStats {
    // Bits of the largest |∇·u| in a cell of water before and after the projection, 1/s:
    // non-negative floats sort like their bit patterns.
    divergence_before: note,
    divergence_after: note,
    // Bits of the largest |mean of ∇·u| over a pocket, 1/s.
    incompatible: note,
    // Cells of water without an open face.
    dropped: note,
    // Bodies of water that no air touches.
    pockets: note,
    padding: array<u32, 3>,
}
