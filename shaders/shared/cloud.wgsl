// Layout of the drops, bubbles and foam in `cloud_words` (render/cloud.rs). The importing shader
// must bind `cloud` and `cloud_words`.

struct Cloud {
    // Least corner, metres from the domain's least corner.
    corner: vec3f,
    // Edge length of a voxel, metres.
    voxel: f32,
    // Number of bricks along each axis.
    bricks: vec3u,
    // Depth behind the water's surface at which a ray still meets what floats on it, metres.
    skin: f32,
    // Number of nodes along each axis of the lattice of optical depths towards the sun.
    nodes: vec3u,
    // Distance between the nodes, metres.
    pitch: f32,
    // Least corner of the columns of foam along x and z, and their numbers; none without foam.
    foam_corner: vec2f,
    foam_columns: vec2u,
    // Edge of a column, metres.
    foam_edge: f32,
    // Index in `cloud_words` of the columns' starts.
    foam_start: u32,
    foam_albedo: f32,
    // Largest radius of the kernel, metres.
    foam_radius: f32,
}

// Decodes a half-precision value: its bits, shifted to their positions in an f32, represent the
// number times 2⁻¹¹².
fn cloud_value(at: u32, kind: u32) -> f32 {
    let bits = cloud_words[at] >> (16u * kind) & 0x7fffu;
    return bitcast<f32>(bits << 13u) * 5.192296858534828e33;
}
