// Faces in a generation zone go a part of the way from the velocity that particles gave them to that of the waves at the
// substep's start. What gravity added stays, and the pressure makes of it what it makes of waves.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_cell.wgsl"
#import "shared/zone.wgsl"
#import "shared/open_waves.wgsl"

@group(0) @binding(3) var<storage, read> face_open: array<f32>;
@group(0) @binding(4) var<storage, read_write> face_velocity: array<f32>;
// Here still the velocities before gravity.
@group(0) @binding(5) var<storage, read> face_change: array<f32>;

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
    let corner = vec3f(own_cell(element));
    for (var component = 0u; component < 3u; component++) {
        let face = component * params.stride + element;
        var place = corner + 0.5;
        place[component] = corner[component];
        let part = led(place * params.cell_size, params.time_step);
        if part > 0.0 && face_open[face] > 0.0 {
            let wanted = wave_velocity(place * params.cell_size)[component];
            face_velocity[face] += part * (wanted - face_change[face]);
        }
    }
}
