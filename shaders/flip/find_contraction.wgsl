// Water that strains contracts when its particles go straight on: the paths x + Δt u multiply
// volumes by 1 + Δt ∇·u − ½ Δt² tr (∇u)² + …, where ∇·u = O(Δt). The projection makes up for it
// with ∇·u = ½ Δt tr (∇u)². The gradient is that of the velocities before forces, which would only
// fall short of closed faces; without their divergence, which the projection replaces. It moves
// with the water: a current adds nothing.
// Cells that walls or solids cut have none, because their closed faces do not have the velocity of
// the water that slides along them.
#import "shared/thread.wgsl"
#import "shared/flip_neighborhood.wgsl"
#import "shared/flip_buried.wgsl"

@group(0) @binding(2) var<storage, read> density: array<f32>;
@group(0) @binding(3) var<storage, read> face_velocity: array<f32>;
// Holds the velocity before forces here.
@group(0) @binding(4) var<storage, read> face_change: array<f32>;
@group(0) @binding(7) var<storage, read> face_open: array<f32>;
@group(0) @binding(6) var<storage, read> cell_kind: array<u32>;
// With WORKED_ON the contraction alone follows, which is no work by boundaries.
@group(0) @binding(5) var<storage, read_write> solid_flux: array<f32>;

const FLUID = 1u;

// Walls and solids cut a cell that they leave less of.
const WHOLE = 0.999;

// Most that a cell contracts by in a substep: bounds what noise of neighbouring particles does.
const MOST = 0.1;

fn unit(axis: u32) -> vec3i {
    return select(vec3i(0), vec3i(1), vec3u(axis) == vec3u(0u, 1u, 2u));
}

// Whether a cell is full of water that nothing cuts.
fn is_whole(element: u32, cell: vec3f) -> bool {
#ifdef SOLIDS
    let volume = open_volume[element];
#else
    let extent = open_extent(cell);
    let volume = extent.x * extent.y * extent.z;
#endif
    return density[element] >= 0.5 && volume >= WHOLE;
}

// Whether the cells before and after along each axis are whole.
var<private> is_low: vec3<bool>;
var<private> is_high: vec3<bool>;

// A component on the lower face of the cell at `offset`: that of the wall or solid if it is closed.
fn on_face(component: u32, offset: vec3i) -> f32 {
    let face = component * params.stride + element_at(offset);
    return select(face_change[face], face_velocity[face], face_open[face] == 0.0);
}

// Sum of a component on both of its faces of the cell at `offset`.
fn on_faces(component: u32, offset: vec3i) -> f32 {
    return on_face(component, offset) + on_face(component, offset + unit(component));
}

// Derivative of a component along another axis, per cell; one-sided beside cells that are not
// whole.
fn slope_along(component: u32, axis: u32) -> f32 {
    let own = on_faces(component, vec3i(0));
    let low = select(own, on_faces(component, -unit(axis)), is_low[axis]);
    let high = select(own, on_faces(component, unit(axis)), is_high[axis]);
    let steps = u32(is_low[axis]) + u32(is_high[axis]);
    return 0.5 * (high - low) / f32(max(steps, 1u));
}

// tr (∇u)² without the divergence, over the square of a cell, (m/s)².
fn trace_of_square() -> f32 {
    var along = vec3f(0.0);
    var cross = 0.0;
    for (var a = 0u; a < 3u; a++) {
        let b = (a + 1u) % 3u;
        along[a] = on_face(a, unit(a)) - on_face(a, vec3i(0));
        cross += slope_along(a, b) * slope_along(b, a);
    }
    along -= (along.x + along.y + along.z) / 3.0;
    return dot(along, along) + 2.0 * cross;
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
    let has_water = cell_kind[element] == FLUID && is_whole(element, cell);
    var flux = 0.0;
    for (var once = 0; once < select(0, 1, has_water); once++) {
        open_neighborhood(element);
        for (var axis = 0u; axis < 3u; axis++) {
            let step = unit(axis);
            is_low[axis] = is_whole(element_at(-step), cell - vec3f(step));
            is_high[axis] = is_whole(element_at(step), cell + vec3f(step));
        }
        let most = MOST * params.cell_size / params.time_step;
        let rate = 0.5 * params.time_step * params.inverse_cell_size;
        flux = clamp(rate * trace_of_square(), -most, most);
    }
    solid_flux[element] -= flux;
#ifdef WORKED_ON
    solid_flux[params.stride + element] = -flux;
#endif
}
