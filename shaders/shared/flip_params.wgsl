// Parameters of a substep. Lengths in metres; positions relative to the domain's minimum corner.
// Mirrored by `FlipParams` of solve/params.rs.
struct FlipParams {
    // Faces of the box at the substep's end, displaced by wave makers: they confine particles.
    wall_min: vec3f,
    particle_count: u32,
    wall_max: vec3f,
    // 512 times the number of slots with water, and of slots with water or within reach of it
    // (`active_cells`); both without slot 0.
    wet_cells: u32,
    // Faces of the box at the substep's start, in cells: they cut cells.
    cut_min: vec3f,
    active_cells: u32,
    cut_max: vec3f,
    // Distance between planes of face arrays, in elements.
    stride: u32,
    // Velocities of the faces, each along its own axis, m/s.
    wall_velocity_min: vec3f,
    // Distance between planes of partial sums, in elements.
    partial_stride: u32,
    wall_velocity_max: vec3f,
    time_step: f32,
    // Gravity times `kick`, m/s.
    velocity_step: vec3f,
    cell_size: f32,
    // Cells of the domain along each axis; storage has one more for the upper faces.
    cells: vec3u,
    inverse_cell_size: f32,
    // Bricks along each axis of the brick table.
    table_dims: vec3u,
    // PIC fraction α of a substep: the share of the velocity that is taken from the grid.
    pic_blend: f32,
    // Reciprocal of the number of particles in a full cell.
    particle_share: f32,
    contact_distance: f32,
    max_displacement: f32,
    // Particles closer to each other than this are pushed apart, metres.
    apart: f32,
    // Bit mask of periodic axes: bit k for axis k.
    periodic: u32,
    // Particles closer to a wall than half of this are pushed away from it, metres.
    apart_from_walls: f32,
    // Seconds for which gravity, pressure, surface tension, confinement and drag act: half of the
    // previous substep plus half of this one.
    kick: f32,
    // Depth below the free surface to which there are particles, cells; 0 if they are everywhere.
    band: f32,
}
@group(0) @binding(0) var<uniform> params: FlipParams;

// Cell of a position given in cells; positions on or beyond the domain's faces belong to the
// outermost cells.
fn cell_of_place(p: vec3f) -> vec3u {
    return vec3u(clamp(vec3i(floor(p)), vec3i(0), vec3i(params.cells) - 1));
}

fn table_index(cell: vec3u) -> u32 {
    let brick = cell >> vec3u(3u);
    return (brick.z * params.table_dims.y + brick.y) * params.table_dims.x + brick.x;
}
