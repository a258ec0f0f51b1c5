// Unit step along an axis, in cells.
fn unit(axis: u32) -> vec3i {
    return select(vec3i(0), vec3i(1), vec3u(axis) == vec3u(0u, 1u, 2u));
}
