// Vorticity confinement a = ε h (N × ω), N = η/|η|; η = ∇|ω| by differences, so that uniform
// vorticity gives 0.
#import "shared/thread.wgsl"
#import "shared/predicted.wgsl"
#import "shared/vector.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/phase.wgsl"
#import "shared/neighbors.wgsl"

override STRENGTH: f32;

@group(0) @binding(10) var<storage, read> position: array<Vector>;
@group(0) @binding(11) var<storage, read> vorticity: array<Vector>;
@group(0) @binding(13) var<storage, read> vorticity_length: array<f32>;
@group(0) @binding(12) var<storage, read_write> velocity: array<Vector>;

var<private> own_position: vec3f;
var<private> own_strength: f32;
var<private> slope: vec3f;

fn visit(i: u32, j: u32) {
    if j >= fluid_count {
        return;
    }
    let d = between(own_position, predicted_at(j).xyz);
    let r = length(d);
    let s = max(1.0 - r * inverse_h, 0.0);
    slope -= d
        * ((vorticity_length[j] - own_strength) * params.gradient_scale * s * s / max(r, 1e-15));
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
    own_strength = vorticity_length[i];
    slope = vec3f(0.0);
    own_position = three(position[i]);
    begin_phase();
    for_each_neighbor(own_position, i);
    let steepness = length(slope);
    // Below the rounding error of |ω| over h the direction is noise.
    if steepness * params.support_radius < 1e-5 * own_strength || own_strength == 0.0 {
        return;
    }
    let force = cross(slope / steepness, three(vorticity[i]));
    velocity[i] = packed(
        three(velocity[i]) + params.time_step * STRENGTH * params.support_radius * force);
}
