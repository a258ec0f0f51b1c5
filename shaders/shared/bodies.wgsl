// Bodies that the water moves, and the bricks that they may touch. Mirrored by `DeviceBodies` of
// solve/bodies.rs.
struct DeviceBody {
    // Centre of mass at the substep's start, relative to the domain's minimum corner, metres.
    centre: vec3f,
    // Its pairs are `body_order[first]` up to `body_order[end - 1]`.
    first: u32,
    // Change of the six velocities for each pressure sum, rows of six: ρ Δx³ times the inverse of
    // the mass matrix within its freedom.
    response: array<vec4f, 9>,
    end: u32,
    padding: array<u32, 3>,
}

struct DeviceBodies {
    bodies: array<DeviceBody, 7>,
    // Number of bodies, and of the solid that is the first of them.
    count: u32,
    first_solid: u32,
    // Number of pairs, and of bricks in `body_bricks`.
    pairs: u32,
    bricks: u32,
}

// A brick and a body that may touch it.
struct BodyPair {
    slot: u32,
    body: u32,
}
