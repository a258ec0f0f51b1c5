// Reads entries of `predicted`, which importers bind: positions, with λ ≤ 0 of a particle in w, or
// the weight > 0 of a boundary sample in units of a particle's mass. If one binding cannot hold
// them all, entries from PAGE on are in `predicted_high`.
#ifdef PAGED
override PAGE: u32;
#endif

fn predicted_at(j: u32) -> vec4f {
#ifdef PAGED
    // Loops instead of branches: software adapters run both sides of a branch, but skip a loop that
    // no thread enters.
    var place: vec4f;
    for (var once = 0u; once < select(0u, 1u, j < PAGE); once++) {
        place = predicted[j];
    }
    for (var once = 0u; once < select(0u, 1u, j >= PAGE); once++) {
        place = predicted_high[j - PAGE];
    }
    return place;
#else
    return predicted[j];
#endif
}
