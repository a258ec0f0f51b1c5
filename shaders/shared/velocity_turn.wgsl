// Rotation of velocities by Coriolis's acceleration over half a step.

// Mirrored by `DeviceTurn` of solve/params.rs.
struct VelocityTurn {
    // Unit vector along the axis.
    axis: vec3f,
    sine: f32,
    // 1 − cosine.
    rest: f32,
    unused: u32,
    padding: vec2u,
}

@group(0) @binding(28) var<storage, read> velocity_turn: VelocityTurn;

fn change_by_turn(v: vec3f) -> vec3f {
    let across = cross(velocity_turn.axis, v);
    return velocity_turn.sine * across + velocity_turn.rest * cross(velocity_turn.axis, across);
}
