// Lists are words of four neighbours, filled up with nobody: one load in four. They interleave in blocks
// of 512 particles, the even ones first, so that neighbouring threads of either colour read neighbouring
// words. In blocks of 128 λ and Δx take half as long again on llvmpipe, in blocks of 16 twice as long (docs/performance.md).
override LIST_CAPACITY: u32;
const LIST_STRIDE = 512u;

fn list_base(i: u32) -> u32 {
    let local = i - phase.first;
    let block = local / LIST_STRIDE;
    let lane = local % LIST_STRIDE;
    return block * LIST_STRIDE * (LIST_CAPACITY / 4u) + (lane >> 1u) + (lane & 1u) * (LIST_STRIDE / 2u);
}
