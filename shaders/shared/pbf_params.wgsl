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
    // Lengths of the domain along the axes along which it joins its own end, else 0.
    period_x: f32,
    // Of the least faces and of the greatest, m/s.
    wall_velocity_min: vec3f,
    period_y: f32,
    wall_velocity_max: vec3f,
    period_z: f32,
}
@group(0) @binding(0) var<uniform> params: Params;

#ifdef PERIODIC
fn period() -> vec3f {
    return vec3f(params.period_x, params.period_y, params.period_z);
}

// The place in the domain, up to its rounding, of which x is an image.
fn wrapped_place(x: vec3f) -> vec3f {
    let p = period();
    return select(x, x - p * floor(x / max(p, vec3f(1e-30))), p > vec3f(0.0));
}

// The same of a cell that is at most one domain away.
fn wrapped_cell(cell: vec3i) -> vec3i {
    let dims = vec3i(params.grid_dims);
    return select(cell, (cell + dims) % dims, period() > vec3f(0.0));
}

// The k-th of the 27 cells about one; where a wall is before it, none, which is `false`.
fn cell_about(centre: vec3i, k: i32, cell: ptr<function, vec3i>) -> bool {
    *cell = wrapped_cell(centre + vec3i(k % 3, (k / 3) % 3, k / 9) - 1);
    return all(*cell >= vec3i(0)) && all(*cell < vec3i(params.grid_dims));
}
#endif

// From b to a, or to the image of it that is nearer; nobody stays far.
fn between(a: vec3f, b: vec3f) -> vec3f {
#ifdef PERIODIC
    // The one near the greater end is carried below the lesser one: no rounding.
    let p = period();
    return (a - select(vec3f(0.0), p, a - b > 0.5 * p)) - (b - select(vec3f(0.0), p, b - a > 0.5 * p));
#else
    return a - b;
#endif
}

// Cells have the edge h; x is fastest, so the three cells of a row are one run.
fn cell_coordinate(x: vec3f) -> vec3i {
#ifdef PERIODIC
    let fitted = vec3f(params.grid_dims) / max(period(), vec3f(1e-30));
    let inverse_edge = select(vec3f(params.inverse_support_radius), fitted, period() > vec3f(0.0));
    let cell = wrapped_cell(vec3i(floor(x * inverse_edge)));
#else
    let cell = vec3i(floor(x * params.inverse_support_radius));
#endif
    return clamp(cell, vec3i(0), vec3i(params.grid_dims) - 1);
}

fn cell_index(cell: vec3i) -> u32 {
    let dims = vec3i(params.grid_dims);
    return u32((cell.z * dims.y + cell.y) * dims.x + cell.x);
}
