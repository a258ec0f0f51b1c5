// What a substep knows. Lengths in metres, positions relative to the domain's least corner.
struct Params {
    // Gravity times time_step.
    velocity_step: vec3f,
    particle_count: u32,
    grid_dims: vec3u,
    max_correction: f32,
    // Faces of the box now, wave-makers included.
    wall_min: vec3f,
    time_step: f32,
    wall_max: vec3f,
    inverse_time_step: f32,
    support_radius: f32,
    inverse_support_radius: f32,
    // Index of a particle that is far from everything: what fills up a list.
    nobody: u32,
    // Kernel values that make the bulk lattice have density 1: see domain::sph.
    density_scale: f32,
    gradient_scale: f32,
    wall_density_scale: f32,
    // epsilon of the lambda's denominator, 1/m²
    regularization: f32,
    // omega
    relaxation: f32,
    contact_distance: f32,
    max_displacement: f32,
    // k of s_corr times lambda's natural scale, m²
    artificial_pressure: f32,
    padding: f32,
    // Of the least faces and of the greatest, m/s.
    wall_velocity_min: vec3f,
    padding_min: f32,
    wall_velocity_max: vec3f,
    padding_max: f32,
}
@group(0) @binding(0) var<uniform> params: Params;

// Cells have the edge h; x is fastest, so the three cells of a row are one run.
fn cell_coordinate(x: vec3f) -> vec3i {
    let cell = vec3i(floor(x * params.inverse_support_radius));
    return clamp(cell, vec3i(0), vec3i(params.grid_dims) - 1);
}

fn cell_index(cell: vec3i) -> u32 {
    let dims = vec3i(params.grid_dims);
    return u32((cell.z * dims.y + cell.y) * dims.x + cell.x);
}
