// Work of walls and solids that move on a particle, over m / Δt²: what they add to its way, times their own. Of a position that
// was clamped `push` is that, and of a correction by λ `wall_rate` is the density's gradient along the walls' ways.
@group(0) @binding(13) var<storage, read_write> wall_work: array<f32>;

fn work_of_push(push: vec3f) -> f32 {
    return dot(max(push, vec3f(0.0)), params.wall_velocity_min) + dot(min(push, vec3f(0.0)), params.wall_velocity_max);
}

// After confine.
fn work_of_pushes() -> f32 {
#ifdef MOVING_SOLIDS
    return work_of_push(wall_push) + solids_work;
#else
    return work_of_push(wall_push);
#endif
}
