// Solids that move, each with the distances that were sampled where it stood at the start; those that do not, if there
// are any, come first as one. One is looked at, at a time.
struct SolidGrids {
    // At the substep's start.
    grids: array<SolidGrid, 8>,
    // m/s
    velocities: array<vec4f, 8>,
    count: u32,
    // Of their speeds the greatest.
    fastest: f32,
    padding: vec2u,
}
@group(0) @binding(7) var<uniform> solid_grids: SolidGrids;

var<private> solid_grid: SolidGrid;
var<private> solid_velocity: vec3f;

// Turns to solid k as it stands `time` seconds after the substep's start.
fn look_at_solid(k: u32, time: f32) {
    solid_velocity = solid_grids.velocities[k].xyz;
    solid_grid = solid_grids.grids[k];
    solid_grid.origin += time * solid_velocity;
}
