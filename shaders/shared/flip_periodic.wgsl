// Domains that join their own ends.
fn is_periodic() -> vec3<bool> {
    return (vec3u(params.periodic) & vec3u(1u, 2u, 4u)) != vec3u(0u);
}

// The place in the domain, up to its rounding, of which x is an image; `size` is the domain's, in the same unit.
fn wrapped_place(x: vec3f, size: vec3f) -> vec3f {
    return select(x, x - size * floor(x / size), is_periodic());
}

// The same of a cell or brick that is at most one domain away.
fn wrapped_cell(cell: vec3i, count: vec3i) -> vec3i {
    return select(cell, (cell + count) % count, is_periodic());
}
