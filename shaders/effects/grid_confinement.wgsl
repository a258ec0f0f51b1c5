// Vorticity confinement a = ε Δx (N × ω), N = η/|η|, η = ∇|ω| (Fedkiw et al. 2001), at faces
// between two cells of water.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_neighborhood.wgsl"

override STRENGTH: f32;

@group(0) @binding(2) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(3) var<storage, read> vorticity: array<Vector>;
@group(0) @binding(6) var<storage, read> vorticity_length: array<f32>;
@group(0) @binding(4) var<storage, read> face_open: array<f32>;
@group(0) @binding(5) var<storage, read_write> face_velocity: array<f32>;

const FLUID = 1u;

fn magnitude(offset: vec3i) -> f32 {
    return vorticity_length[element_at(offset)];
}

// Twice the central difference of |ω| along `axis`, which is tangential to the face, averaged over
// the face's two cells.
fn slope_along(normal: vec3i, axis: vec3i) -> f32 {
    return 0.5 * (magnitude(axis) - magnitude(-axis) + magnitude(axis - normal)
        - magnitude(-axis - normal));
}

// N × ω at the lower face along `normal`, 1/s.
fn confinement(normal: vec3i) -> vec3f {
    let own = element_at(vec3i(0));
    let before = element_at(-normal);
    let lengths = vec2f(vorticity_length[own], vorticity_length[before]);
    let across = 2.0 * (lengths.x - lengths.y);
    let slope = vec3f(
        select(slope_along(normal, vec3i(1, 0, 0)), across, normal.x == 1),
        select(slope_along(normal, vec3i(0, 1, 0)), across, normal.y == 1),
        select(slope_along(normal, vec3i(0, 0, 1)), across, normal.z == 1),
    );
    let omega = 0.5 * (three(vorticity[own]) + three(vorticity[before]));
    let steepness = length(slope);
    // Below the rounding error of |ω| the direction is noise.
    let is_clear = steepness > 1e-5 * (lengths.x + lengths.y);
    return select(vec3f(0.0), cross(slope / max(steepness, 1e-30), omega), is_clear);
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
    for (var once = 0; once < select(0, 1, cell_kind[element] == FLUID); once++) {
        open_neighborhood(element);
        let push = params.kick * STRENGTH * params.cell_size * vec3f(
            confinement(vec3i(1, 0, 0)).x,
            confinement(vec3i(0, 1, 0)).y,
            confinement(vec3i(0, 0, 1)).z,
        );
        let before = vec3u(
            element_at(vec3i(-1, 0, 0)), element_at(vec3i(0, -1, 0)), element_at(vec3i(0, 0, -1)));
        for (var component = 0u; component < 3u; component++) {
            let face = component * params.stride + element;
            let is_between = cell_kind[before[component]] == FLUID && face_open[face] > 0.0;
            face_velocity[face] += select(0.0, push[component], is_between);
        }
    }
}
