// Accelerates isolated droplets by the scene's forces: they fall freely, so that the change of the
// grid's velocity does not reach them.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/bricks.wgsl"
#import "shared/forces.wgsl"

@group(0) @binding(2) var<storage, read> cell_start: array<u32>;
@group(0) @binding(3) var<storage, read> sorted_position: array<Vector>;
// Three floats per particle, and behind those of all particles, 1 for each isolated droplet.
@group(0) @binding(4) var<storage, read_write> sorted_velocity: array<f32>;
@group(0) @binding(5) var<storage, read_write> carried: array<f32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.wet_cells {
        return;
    }
    let element = thread + CELLS;
    for (var i = cell_start[element]; i < cell_start[element + 1u]; i++) {
        let is_drop = sorted_velocity[3u * params.particle_count + i] > 0.0;
        for (var once = 0; once < select(0, 1, is_drop); once++) {
            let change = params.kick * force_at(three(sorted_position[i]));
            for (var axis = 0u; axis < 3u; axis++) {
                let k = 3u * i + axis;
                let v = sorted_velocity[k] + change[axis];
                sorted_velocity[k] = v;
                carried[k] = v;
            }
        }
    }
}
