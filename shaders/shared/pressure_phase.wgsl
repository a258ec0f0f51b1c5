// What a pressure pass works on; `PressurePhase` of solve/pressure/params.rs.
#import "shared/thread.wgsl"

struct PressurePhase {
    // Which of `levels`, and the last of them.
    level: u32,
    last_level: u32,
    // Of 2³ blocks, as on a chess board.
    colour: u32,
    // What pressure/reduce decides, and over how many sums.
    step: u32,
    sum_count: u32,
    // Of a plane of an array: 512 a slot that it holds.
    stride: u32,
    max_iterations: u32,
    // Whether the pockets stand in `pressure_pocket_cells`.
    has_pockets: u32,
    tolerance_square: f32,
    // Δx.
    cell_size: f32,
    // ρ Δx / Δt: from q to pascal.
    pressure_scale: f32,
    // 0, which no compiler knows.
    opaque_zero: u32,
    // First slot and bricks of each level, and, of the finest alone, active bricks.
    levels: array<vec4u, 8>,
}

@group(0) @binding(0) var<uniform> phase: PressurePhase;
