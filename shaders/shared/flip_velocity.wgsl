// The grid's velocity, and other fields of faces, at any position.
#import "shared/flip_slots.wgsl"
#import "shared/flip_params.wgsl"
#ifdef PERIODIC
#import "shared/flip_periodic.wgsl"
#endif

// Velocities, and with CORRECTION displacements behind them.
@group(0) @binding(2) var<storage, read> face_velocity: array<f32>;

fn component_at(plane: u32, low: vec3i, high: vec3i, t: vec3f) -> f32 {
    var sum = 0.0;
    for (var z = 0; z < 2; z++) {
        for (var y = 0; y < 2; y++) {
            for (var x = 0; x < 2; x++) {
                let is_high = vec3i(x, y, z) == vec3i(1);
                let weight = select(1.0 - t, t, is_high);
                let face = element_at(select(low, high, is_high));
                sum += weight.x * weight.y * weight.z * face_velocity[plane + face];
            }
        }
    }
    return sum;
}

// The vector at x, metres, of which the planes begin at `first`; `otherwise` if there is no brick.
fn vector_at(first: u32, x: vec3f, otherwise: vec3f) -> vec3f {
#ifdef PERIODIC
    let scaled = wrapped_place(x * params.inverse_cell_size, vec3f(params.cells));
#else
    let scaled = x * params.inverse_cell_size;
#endif
    let p = clamp(scaled, vec3f(0.0), vec3f(params.cells));
    let cell = vec3i(cell_of_place(p));
    let f = p - vec3f(cell);
    find_slots(cell);
    // Interpolates between face centres; beyond the outermost ones, the velocity is that of the
    // outermost.
    let is_before = f < vec3f(0.5);
    let t = select(f - 0.5, f + 0.5, is_before);
    var low = max(select(vec3i(0), vec3i(-1), is_before), -cell);
    var high = min(select(vec3i(1), vec3i(0), is_before), vec3i(params.cells) - 1 - cell);
#ifdef PERIODIC
    low = select(low, select(vec3i(0), vec3i(-1), is_before), is_periodic());
    high = select(high, select(vec3i(1), vec3i(0), is_before), is_periodic());
#endif
    let sampled = vec3f(
        component_at(first, vec3i(0, low.yz), vec3i(1, high.yz), vec3f(f.x, t.yz)),
        component_at(
            first + params.stride, vec3i(low.x, 0, low.z), vec3i(high.x, 1, high.z),
            vec3f(t.x, f.y, t.z)),
        component_at(
            first + 2u * params.stride, vec3i(low.xy, 0), vec3i(high.xy, 1), vec3f(t.xy, f.z)),
    );
    return select(sampled, otherwise, slots_near.x == 0u);
}

fn velocity_at(x: vec3f, otherwise: vec3f) -> vec3f {
    return vector_at(0u, x, otherwise);
}
