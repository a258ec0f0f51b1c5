// Motion of solids and wave makers to the next frame. The importing shader must bind `carried`, an
// entry for each material code.

// Rows of the map from a position at the frame to that at the next frame.
struct Carried {
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

// Position at the next frame of a point with a material code.
fn carried_to_next(code: u32, position: vec3f) -> vec3f {
    let at = vec4f(position, 1.0);
    let it = carried[code];
    return vec3f(dot(it.x, at), dot(it.y, at), dot(it.z, at));
}
