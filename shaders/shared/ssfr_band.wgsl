// Rows of the picture that are shaded at once.

struct Band {
    // First picture row of this band, and how many.
    row: u32,
    rows: u32,
    pad0: u32,
    pad1: u32,
}
