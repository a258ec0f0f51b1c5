// Lists consist of words with four neighbours each, padded with the dummy particle: one load for
// four neighbours. They are interleaved in blocks of 512 particles, even ones first, so that
// neighbouring threads of either colour read neighbouring words. On llvmpipe, λ and Δx take 50 %
// longer with blocks of 128, and twice as long with blocks of 16 (docs/performance.md).
override LIST_CAPACITY: u32;
const LIST_STRIDE = 512u;

fn list_base(i: u32) -> u32 {
    let local = i - phase.first;
    let block = local / LIST_STRIDE;
    let lane = local % LIST_STRIDE;
    return block * LIST_STRIDE * (LIST_CAPACITY / 4u) + (lane >> 1u)
        + (lane & 1u) * (LIST_STRIDE / 2u);
}
