// Work of the scene's forces in a substep, over a particle's mass, per workgroup: impulse times the
// mean of the velocities before and after the substep's accelerations, so that it adds up with the
// work of gravity and pressure to the change of the kinetic energy.
//
// A cell's water has the velocities of its faces; an isolated droplet has its own.
#import "shared/thread.wgsl"
#import "shared/sum_of_group.wgsl"
#import "shared/vector.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_beside.wgsl"
#import "shared/forces.wgsl"

@group(0) @binding(2) var<storage, read> cell_start: array<u32>;
@group(0) @binding(3) var<storage, read> sorted_position: array<Vector>;
// Three floats per particle, and behind those of all particles, 1 for each isolated droplet.
@group(0) @binding(4) var<storage, read> sorted_velocity: array<f32>;
@group(0) @binding(5) var<storage, read> face_open: array<f32>;
@group(0) @binding(6) var<storage, read> face_velocity: array<f32>;
@group(0) @binding(9) var<storage, read> face_change: array<f32>;
@group(0) @binding(10) var<storage, read_write> force_work: array<f32>;

fn work_at_face(element: u32, component: u32, place: vec3f) -> f32 {
    let face = component * params.stride + element;
    let velocity = face_velocity[face] - 0.5 * face_change[face];
    let pushed = params.kick * force_at(place)[component] * velocity;
    return select(0.0, pushed, face_open[face] > 0.0);
}

// Work on a particle of a cell that moves with the faces.
fn work_in_cell(element: u32) -> f32 {
    open_beside(element);
    let corner = vec3f(8u * vec3u(
        bricks[own_slot].coordinate[0],
        bricks[own_slot].coordinate[1],
        bricks[own_slot].coordinate[2],
    ) + vec3u(own_local));
    var sum = 0.0;
    for (var component = 0u; component < 3u; component++) {
        var step = vec3i(0);
        step[component] = 1;
        var place = corner + 0.5;
        place[component] = corner[component];
        let beyond = place + vec3f(step);
        sum += work_at_face(element, component, place * params.cell_size);
        sum += work_at_face(element_beside(step), component, beyond * params.cell_size);
    }
    return 0.5 * sum;
}

fn work_on_drop(i: u32) -> f32 {
    let change = params.kick * force_at(three(sorted_position[i]));
    let after = vec3f(
        sorted_velocity[3u * i], sorted_velocity[3u * i + 1u], sorted_velocity[3u * i + 2u]);
    return dot(change, after - 0.5 * (params.velocity_step + change));
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    let is_inside = thread < params.wet_cells;
    let element = select(0u, thread + CELLS, is_inside);
    let first = select(0u, cell_start[element], is_inside);
    let end = select(0u, cell_start[element + 1u], is_inside);
    var water = 0u;
    var work = 0.0;
    for (var i = first; i < end; i++) {
        let is_drop = sorted_velocity[3u * params.particle_count + i] > 0.0;
        water += u32(!is_drop);
        for (var once = 0; once < select(0, 1, is_drop); once++) {
            work += work_on_drop(i);
        }
    }
    for (var once = 0; once < select(0, 1, water > 0u); once++) {
        work += f32(water) * work_in_cell(element);
    }
    let sum = sum_of_group(local, work);
    if local == 0u && is_inside {
        force_work[thread / 64u] = sum;
    }
}
