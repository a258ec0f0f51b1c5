// All solids, in order.
fn solids_about() -> u32 {
    return solid_count();
}

fn solid_about(index: u32) -> u32 {
    return index;
}
