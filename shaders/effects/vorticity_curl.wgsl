// Vorticity ω_i = Σ_j m/ρ (v_j − v_i) × ∇_j W with the spiky gradient, and its length.
#import "shared/thread.wgsl"
#import "shared/predicted.wgsl"
#import "shared/vector.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/phase.wgsl"
#import "shared/neighbors.wgsl"

@group(0) @binding(10) var<storage, read> position: array<Vector>;
@group(0) @binding(11) var<storage, read> velocity: array<Vector>;
@group(0) @binding(12) var<storage, read_write> vorticity: array<Vector>;
@group(0) @binding(13) var<storage, read_write> vorticity_length: array<f32>;

var<private> own_position: vec3f;
var<private> own_velocity: vec3f;
var<private> curl: vec3f;

fn visit(i: u32, j: u32) {
    if j >= fluid_count {
        return;
    }
    let d = between(own_position, predicted_at(j).xyz);
    let r = length(d);
    let s = max(1.0 - r * inverse_h, 0.0);
    // ∇_j W points from j to i.
    let gradient = d * (params.gradient_scale * s * s / max(r, 1e-15));
    curl += cross(three(velocity[j]) - own_velocity, gradient);
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
    curl = vec3f(0.0);
    own_position = three(position[i]);
    begin_phase();
    for_each_neighbor(own_position, i);
    vorticity[i] = packed(curl);
    vorticity_length[i] = length(curl);
}
