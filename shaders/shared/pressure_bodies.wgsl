// Bodies in the pressure's system: for each brick that bodies may touch, the cells' coupling.
#import "shared/pressure_phase.wgsl"
#import "shared/pressure_real.wgsl"
#import "shared/bodies.wgsl"

// Slot, first pair, pair after the last, unused.
@group(0) @binding(1) var<storage, read> body_bricks: array<vec4u>;
@group(0) @binding(2) var<storage, read> body_coupling: array<f32>;
// Kinds of blocks, with one bit per row from bit 8 on.
@group(0) @binding(3) var<storage, read> pressure_block: array<u32>;

const CELLS = 512u;

// Cell `inner` of a brick, in natural order, as an element of blocked arrays.
fn blocked_cell(slot: u32, inner: u32) -> u32 {
    let x = inner & 7u;
    let y = (inner >> 3u) & 7u;
    let z = inner >> 6u;
    let within = (x & 1u) + 2u * (y & 1u) + 4u * (z & 1u);
    let block = (x >> 1u) + 4u * (y >> 1u) + 16u * (z >> 1u);
    return CELLS * slot + 64u * within + block;
}

// Whether the cell of a blocked element has a row.
fn has_row(element: u32) -> bool {
    let slot = element / CELLS;
    let within = (element >> 6u) & 7u;
    let rows = pressure_block[64u * slot + (element & 63u)] >> 8u;
    return ((rows >> within) & 1u) != 0u;
}
