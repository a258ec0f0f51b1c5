// A packed vector of three words, as particle arrays hold them: an array of vec3f would take 16
// bytes per vector.
struct Vector {
    x: f32,
    y: f32,
    z: f32,
}

fn three(v: Vector) -> vec3f {
    return vec3f(v.x, v.y, v.z);
}

fn packed(v: vec3f) -> Vector {
    return Vector(v.x, v.y, v.z);
}
