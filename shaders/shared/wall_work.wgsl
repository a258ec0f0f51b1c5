// Work of moving walls and solids on a particle, over m / Δt²: the displacement that they cause
// times their own displacement. For a clamped position, `push` is the displacement; for a
// correction by λ, `wall_rate` is the density gradient along the walls' motion.
@group(0) @binding(13) var<storage, read_write> wall_work: array<f32>;

fn work_of_push(push: vec3f) -> f32 {
    return dot(max(push, vec3f(0.0)), params.wall_velocity_min)
        + dot(min(push, vec3f(0.0)), params.wall_velocity_max);
}

// Call it after confine.
fn work_of_pushes() -> f32 {
#ifdef MOVING_SOLIDS
    return work_of_push(wall_push) + solids_work;
#else
    return work_of_push(wall_push);
#endif
}
