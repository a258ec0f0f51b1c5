// XSPH: c Σ_j m/ρ (v_j − v_i) W, the neighbours' mean velocity relative to the particle's own, with
// the poly6 kernel.
#import "shared/thread.wgsl"
#import "shared/predicted.wgsl"
#import "shared/vector.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/phase.wgsl"
#import "shared/neighbors.wgsl"

override XSPH: f32;

@group(0) @binding(10) var<storage, read> position: array<Vector>;
@group(0) @binding(11) var<storage, read> velocity: array<Vector>;
@group(0) @binding(12) var<storage, read_write> viscosity_change: array<Vector>;

var<private> own_position: vec3f;
var<private> own_velocity: vec3f;
var<private> change: vec3f;

fn visit(i: u32, j: u32) {
    if j >= fluid_count {
        return;
    }
    let d = between(own_position, predicted_at(j).xyz);
    let p = max(1.0 - dot(d, d) * inverse_h * inverse_h, 0.0);
    change += (three(velocity[j]) - own_velocity) * (p * p * p);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= phase.count {
        return;
    }
    let i = phase_particle(thread);
    own_velocity = three(velocity[i]);
    change = vec3f(0.0);
    own_position = three(position[i]);
    begin_phase();
    for_each_neighbor(own_position, i);
    viscosity_change[i] = packed(XSPH * params.density_scale * change);
}
