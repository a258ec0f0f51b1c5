// Lists are words of four neighbours, filled up with nobody: one load in four. They interleave in blocks
// of 128 particles, the even ones first, so that neighbouring threads of either colour read neighbouring
// words.
override LIST_CAPACITY: u32;
const LIST_STRIDE = 128u;

fn list_base(i: u32) -> u32 {
    let local = i - phase.first;
    let block = local / LIST_STRIDE;
    let lane = local % LIST_STRIDE;
    return block * LIST_STRIDE * (LIST_CAPACITY / 4u) + (lane >> 1u) + ((lane & 1u) << 6u);
}
