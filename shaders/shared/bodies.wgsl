// A body that the water moves, and the bricks that it may touch. Mirrored by `DeviceBody` of
// solve/pressure/bodies.rs.
struct DeviceBody {
    // Centre of mass at the substep's start, relative to the domain's minimum corner, metres.
    centre: vec3f,
    // Its pairs are `body_order[first]` up to `body_order[end - 1]`; those of the last body end
    // with the last pair of all.
    first: u32,
    // Change of the six velocities for each pressure sum, rows of six: ρ Δx³ times the inverse of
    // the mass matrix within its freedom.
    response: array<vec4f, 9>,
    end: u32,
    // Its number among the solids.
    solid: u32,
    padding: array<u32, 2>,
}

// A brick and a body that may touch it.
struct BodyPair {
    slot: u32,
    body: u32,
}
