// Parameters of a pressure pass; mirrored by `PressurePhase` of solve/pressure/params.rs.
#import "shared/thread.wgsl"

struct PressurePhase {
    // Index into `levels`, and index of the coarsest level.
    level: u32,
    last_level: u32,
    // Decision of pressure/reduce, and the number of workgroups whose partial sums it adds up.
    step: u32,
    sum_count: u32,
    // Distance between planes of an array, in elements: 512 times its slots.
    stride: u32,
    max_iterations: u32,
    // Parts of pockets in `pressure_pocket_parts`; 0 until the pockets are listed.
    pocket_parts: u32,
    tolerance_square: f32,
    // Cell size Δx, metres.
    cell_size: f32,
    // ρ Δx over the time for which the pressure acts: turns q into pascals.
    pressure_scale: f32,
    // Always 0, but unknown to the shader compiler.
    opaque_zero: u32,
    // Bricks with water in which bodies move with the pressure; 0 in the density correction.
    body_bricks: u32,
    // For each level: first slot, bricks, active bricks (finest level only), 0.
    levels: array<vec4u, 8>,
}

@group(0) @binding(0) var<uniform> phase: PressurePhase;

// Slot of a workgroup's brick on a level. Slot 0, which holds nothing, if the workgroup has none.
fn brick_slot(group: u32, level: u32) -> u32 {
    let range = phase.levels[level];
    return select(0u, range.x + group, group < range.y);
}

fn last_slot(level: u32) -> u32 {
    let range = phase.levels[level];
    return range.x + range.y - 1u;
}
