// What a substep knows. Lengths in metres, positions relative to the domain's least corner.
struct FlipParams {
    // Faces of the box at the substep's end: where particles are kept.
    wall_min: vec3f,
    particle_count: u32,
    wall_max: vec3f,
    // 512 times the slots that hold water, and those within reach as well; slot 0 not counted.
    wet_cells: u32,
    // Faces of the box at its start, in cells: what cuts cells.
    cut_min: vec3f,
    active_cells: u32,
    cut_max: vec3f,
    // Between planes of face arrays, in elements.
    stride: u32,
    // Each wall's, along its own axis, m/s.
    wall_velocity_min: vec3f,
    // Between planes of partial sums.
    partial_stride: u32,
    wall_velocity_max: vec3f,
    time_step: f32,
    // Gravity times time_step.
    velocity_step: vec3f,
    cell_size: f32,
    // Cells that the domain takes along each axis; one more is stored, for its lower faces.
    cells: vec3u,
    inverse_cell_size: f32,
    // Bricks along each axis.
    table_dims: vec3u,
    // Of a substep: the part of the velocity taken from the grid.
    pic_blend: f32,
    // One over the particles of a full cell.
    particle_share: f32,
    contact_distance: f32,
    max_displacement: f32,
    // Particles that are nearer to each other are pushed apart.
    apart: f32,
    // A bit an axis along which the domain joins its own end.
    periodic: u32,
    // Water is pushed off walls that are nearer than half of this.
    apart_from_walls: f32,
    // Seconds for which gravity, pressure, surface tension, confinement and drag act: half of the substep before and half of this one.
    kick: f32,
    padding: u32,
}
@group(0) @binding(0) var<uniform> params: FlipParams;

// Cell of a place given in cells; places at or beyond the faces count to the outermost cells.
fn cell_of_place(p: vec3f) -> vec3u {
    return vec3u(clamp(vec3i(floor(p)), vec3i(0), vec3i(params.cells) - 1));
}

fn table_index(cell: vec3u) -> u32 {
    let brick = cell >> vec3u(3u);
    return (brick.z * params.table_dims.y + brick.y) * params.table_dims.x + brick.x;
}
