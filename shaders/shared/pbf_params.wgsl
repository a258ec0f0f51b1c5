// Parameters of a substep. Lengths in metres; positions relative to the domain's minimum corner.
// Mirrored by `Params` of solve/params.rs.
struct Params {
    // Gravity times time step, m/s.
    velocity_step: vec3f,
    particle_count: u32,
    grid_dims: vec3u,
    max_correction: f32,
    // Faces of the box, displaced by wave makers.
    wall_min: vec3f,
    time_step: f32,
    wall_max: vec3f,
    inverse_time_step: f32,
    support_radius: f32,
    inverse_support_radius: f32,
    // Index of a dummy particle far from everything, which pads neighbour lists.
    nobody: u32,
    // Kernel factors that give the bulk lattice a relative density of 1; see `domain::sph`.
    density_scale: f32,
    gradient_scale: f32,
    wall_density_scale: f32,
    // ε in the denominator of λ, 1/m².
    regularization: f32,
    // Relaxation factor ω of the corrections.
    relaxation: f32,
    contact_distance: f32,
    max_displacement: f32,
    // k of s_corr times the natural scale of λ, m².
    artificial_pressure: f32,
    // Period of the domain along each axis; 0 if the axis is not periodic.
    period_x: f32,
    // Velocities of the minimum and the maximum faces, each along its own axis, m/s.
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

// The point inside the domain of which x is a periodic image, up to rounding.
fn wrapped_place(x: vec3f) -> vec3f {
    let p = period();
    return select(x, x - p * floor(x / max(p, vec3f(1e-30))), p > vec3f(0.0));
}

// The same for a cell that is at most one domain length outside.
fn wrapped_cell(cell: vec3i) -> vec3i {
    let dims = vec3i(params.grid_dims);
    return select(cell, (cell + dims) % dims, period() > vec3f(0.0));
}

// Finds the k-th of the 27 cells around `centre`; returns false if that cell lies beyond a wall.
fn cell_about(centre: vec3i, k: i32, cell: ptr<function, vec3i>) -> bool {
    *cell = wrapped_cell(centre + vec3i(k % 3, (k / 3) % 3, k / 9) - 1);
    return all(*cell >= vec3i(0)) && all(*cell < vec3i(params.grid_dims));
}
#endif

// Vector from b to the nearest periodic image of a. The dummy particle stays far away.
fn between(a: vec3f, b: vec3f) -> vec3f {
#ifdef PERIODIC
    // Shifts the point near the upper end to below the lower end, which does not round.
    let p = period();
    return (a - select(vec3f(0.0), p, a - b > 0.5 * p))
        - (b - select(vec3f(0.0), p, b - a > 0.5 * p));
#else
    return a - b;
#endif
}

// Cells have edge h. x varies fastest, so the three cells of a row are contiguous.
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
