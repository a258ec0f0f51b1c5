// The next search direction: correction + β direction.
#import "shared/pressure_phase.wgsl"
#import "shared/pressure_control.wgsl"

@group(0) @binding(1) var<storage, read> pressure_control: PressureControl;
@group(0) @binding(2) var<storage, read> pressure_correction: array<real>;
@group(0) @binding(3) var<storage, read_write> pressure_direction: array<real>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let range = phase.levels[0];
    if i / 64u >= range.y {
        return;
    }
    let beta = pressure_control.beta;
    let first = 512u * (range.x + i / 64u) + (i & 63u);
    for (var c = 0u; c < 512u; c += 64u) {
        let z = pressure_correction[first + c];
        pressure_direction[first + c] = select(
            z + beta * pressure_direction[first + c], z, beta == 0.0);
    }
}
