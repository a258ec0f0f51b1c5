// Periodic domains.
fn is_periodic() -> vec3<bool> {
    return (vec3u(params.periodic) & vec3u(1u, 2u, 4u)) != vec3u(0u);
}

// The point inside the domain of which x is a periodic image, up to rounding; `size` is the
// domain's size in the same unit.
fn wrapped_place(x: vec3f, size: vec3f) -> vec3f {
    return select(x, x - size * floor(x / size), is_periodic());
}

// The same for a cell or brick that is at most one domain length outside.
fn wrapped_cell(cell: vec3i, count: vec3i) -> vec3i {
    return select(cell, (cell + count) % count, is_periodic());
}
