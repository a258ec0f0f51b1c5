// Index of this thread in a dispatch that may be spread over two dimensions.
fn thread_index(workgroup: vec3u, workgroups: vec3u, local: u32, size: u32) -> u32 {
    return (workgroup.y * workgroups.x + workgroup.x) * size + local;
}
