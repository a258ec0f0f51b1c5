// Density that straight paths by the projected velocities add in this substep, beyond what the
// projection has made up for: flip/find_contraction knows the velocities of the substep before, and
// nothing of a first impact. The density correction takes it away before it is there.
#import "shared/thread.wgsl"
#import "shared/flip_minors.wgsl"

@group(0) @binding(2) var<storage, read> density: array<f32>;
@group(0) @binding(3) var<storage, read> face_velocity: array<f32>;
// Holds the velocity before forces here.
@group(0) @binding(4) var<storage, read> face_change: array<f32>;
@group(0) @binding(7) var<storage, read> face_open: array<f32>;
@group(0) @binding(6) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(5) var<storage, read_write> density_excess: array<f32>;

const FLUID = 1u;

// As in flip/find_excess.
const MOST_EXCESS = 0.5;

var<private> is_after: bool;

fn at_face(face: u32) -> f32 {
    return select(face_change[face], face_velocity[face], is_after);
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
    let cell = vec3f(own_cell(element));
    let is_counted = cell_kind[element] == FLUID && is_whole(element, cell);
    let rate = params.time_step * params.inverse_cell_size;
    var excess = density_excess[element];
    for (var once = 0; once < select(0, 1, is_counted); once++) {
        look_around_cell(element, cell);
        is_after = false;
        let made_up = rate * contraction_flux();
        is_after = true;
        let lost = -rate * rate * sum_of_minors();
        // What touches air is pressed together, but not drawn apart.
        let is_inner = all((is_low | is_low_shut) & (is_high | is_high_shut));
        let least = select(min(excess, 0.0), -MOST_EXCESS, is_inner);
        excess = clamp(excess + lost - made_up, least, MOST_EXCESS);
    }
    density_excess[element] = excess;
}
