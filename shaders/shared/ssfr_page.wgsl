// Which particles a dispatch sees: as many as a binding holds, and of those that hold air some in a row.
struct Page {
    // Of the frame's, the first that is bound, and how many are.
    first: u32,
    count: u32,
    // Of `aired`, the first that is one of these, and how many are.
    aired_first: u32,
    aired_count: u32,
}
@group(0) @binding(8) var<uniform> page: Page;
