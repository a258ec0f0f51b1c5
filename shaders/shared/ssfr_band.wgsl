// Rows of the picture that are shaded in one dispatch.

struct Band {
    // First picture row of this band, and number of rows.
    row: u32,
    rows: u32,
    pad0: u32,
    pad1: u32,
}
