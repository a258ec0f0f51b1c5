// Range of particles of a dispatch: as many as a binding holds, and the contiguous range of those
// that hold air.
struct Page {
    // First of the frame's particles that is bound, and number of bound particles.
    first: u32,
    count: u32,
    // First entry of `aired` in this range, and number of entries.
    aired_first: u32,
    aired_count: u32,
}
@group(0) @binding(8) var<uniform> page: Page;
