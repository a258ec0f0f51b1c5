// Δx_i = Σ_j (λ_i + λ_j + s_corr) ∇W / ρ0 (Macklin and Müller 2013, eq. 14), bounded: physical masses
// with the formula verbatim blow up.
#import "shared/thread.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/phase.wgsl"
#import "shared/neighbors.wgsl"
#import "shared/walls.wgsl"
#import "shared/confine.wgsl"
#import "shared/hash.wgsl"

@group(0) @binding(1) var<storage, read_write> predicted: array<vec4f>;
@group(0) @binding(10) var<storage, read> lambda: array<f32>;
#ifdef ARTIFICIAL_PRESSURE
// W at Δq = 0.2 h over W(0): (1 − 0.04)³.
const REFERENCE_KERNEL = 0.884736;
#endif

var<private> own_lambda: f32;
var<private> delta: vec3f;

fn visit(xi: vec3f, i: u32, j: u32) {
    let other = predicted[stored_index(j)];
    let d = xi - other.xyz;
    let inverse_h = 1.0 / params.support_radius;
    let r2 = dot(d, d);
    let inverse_r = inverseSqrt(max(r2, 1e-30));
    let s = max(1.0 - r2 * inverse_r * inverse_h, 0.0);
    var scale = own_lambda;
    if j < params.particle_count {
        scale += lambda[j];
#ifdef ARTIFICIAL_PRESSURE
        let p = max(1.0 - r2 * inverse_h * inverse_h, 0.0);
        let w = p * p * p / REFERENCE_KERNEL;
        scale -= params.artificial_pressure * w * w * w * w;
#endif
    }
    var direction = d * inverse_r;
    if r2 < 1e-12 * params.support_radius * params.support_radius {
        direction = pair_direction(i, j);
    }
    delta += direction * (scale * other.w * s * s);
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
    let current = predicted[stored_index(i)];
    own_lambda = lambda[i];
    delta = vec3f(0.0);
    for_each_neighbor(current.xyz, i);
    delta = -params.gradient_scale * delta + own_lambda * wall_term(current.xyz).gradient;
    delta *= params.relaxation;
    delta *= min(1.0, params.max_correction / max(length(delta), 1e-30));
    predicted[phase.write + i] = vec4f(confine(current.xyz + delta), current.w);
}
