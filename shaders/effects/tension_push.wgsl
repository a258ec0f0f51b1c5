// The pressure jump σ κ across the surface, as a velocity change of the faces between water and
// air: Δt σ κ / (ρ θ Δx), directed against the air. The projection then finds the pressure
// including the jump: its right-hand side gets the ghost-fluid term, and faces lose the gradient
// towards σ κ at the surface instead of that towards 0 (Kang, Fedkiw and Liu 2000).
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_neighborhood.wgsl"

// σ / ρ, m³/s².
override TENSION: f32;

@group(0) @binding(2) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(3) var<storage, read> face_open: array<f32>;
@group(0) @binding(4) var<storage, read_write> face_velocity: array<f32>;
@group(0) @binding(5) var<storage, read> tension_curvature: array<vec2f>;
#ifdef GHOST_FLUID
@group(0) @binding(6) var<storage, read> liquid_distance: array<f32>;
#endif

const AIR = 0u;
const FLUID = 1u;
// As in the projection.
const LEAST_THETA = 0.01;
const MOST_THETA = 100.0;
// If the water fraction is flatter than this on both sides, κ is unknown.
const LEAST_WEIGHT = 1e-6;

fn theta_of(water: u32, air: u32) -> f32 {
#ifdef GHOST_FLUID
    let inside = max(-liquid_distance[water], 0.0);
    let outside = liquid_distance[air];
    let theta = select(MOST_THETA, inside / (inside + outside), inside + outside > 0.0);
    return clamp(theta, LEAST_THETA, MOST_THETA);
#else
    return 1.0;
#endif
}

// κ Δx at the surface between two cells, over θ.
fn jump(water: u32, air: u32) -> f32 {
    let theta = theta_of(water, air);
    let inside = tension_curvature[water];
    let outside = tension_curvature[air];
    // Also weighted by the gradient: in the middle of a thin sheet the water fraction is flat, and
    // its κ says nothing about the surface.
    let part = min(theta, 1.0);
    let weights = vec2f((1.0 - part) * inside.y, part * outside.y);
    let sum = weights.x * inside.x + weights.y * outside.x;
    return sum / max(weights.x + weights.y, LEAST_WEIGHT) / theta;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.active_cells {
        return;
    }
    let element = thread + CELLS;
    let scale = params.kick * TENSION * params.inverse_cell_size * params.inverse_cell_size;
    let kind = cell_kind[element];
    open_neighborhood(element);
    for (var component = 0u; component < 3u; component++) {
        var step = vec3i(0);
        step[component] = -1;
        let before = element_at(step);
        let face = component * params.stride + element;
        let is_surface = face_open[face] > 0.0 && kind + cell_kind[before] == AIR + FLUID;
        for (var once = 0; once < select(0, 1, is_surface); once++) {
            let is_water = kind == FLUID;
            let pushed = scale
                * jump(select(before, element, is_water), select(element, before, is_water));
            face_velocity[face] += select(-pushed, pushed, is_water);
        }
    }
}
