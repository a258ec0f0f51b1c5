// λ_i = −max(C_i, 0) / (Σ_k |∇_k C_i|² + ε) (Macklin and Müller 2013, eq. 11). Only compression is
// corrected: correcting a density deficit at the free surface makes particles clump.
#import "shared/thread.wgsl"
#import "shared/predicted_written.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/phase.wgsl"
#import "shared/neighbors.wgsl"
#import "shared/walls.wgsl"

#ifdef DENSITY
@group(0) @binding(11) var<storage, read_write> density: array<f32>;
#endif

// Stores λ in w. Other threads may read this w meanwhile, but only its sign, which λ ≤ 0 does not
// change.
fn set_lambda(i: u32, lambda: f32) {
#ifdef PAGED
    if i < PAGE {
        predicted[i].w = lambda;
    } else {
        predicted_high[i - PAGE].w = lambda;
    }
#else
    predicted[i].w = lambda;
#endif
}

var<private> own_position: vec3f;
var<private> kernel_sum: f32;
var<private> gradient_sum: vec3f;
var<private> gradient_squares: f32;

fn visit(i: u32, j: u32) {
    let other = predicted_at(j);
    let d = between(own_position, other.xyz);
    let r2 = dot(d, d);
    let p = max(1.0 - r2 * inverse_h * inverse_h, 0.0);
    let mass = weight(other.w);
    kernel_sum += mass * p * p * p;
    let inverse_r = inverseSqrt(max(r2, 1e-30));
    let s = max(1.0 - r2 * inverse_r * inverse_h, 0.0);
    let slope = mass * s * s;
    gradient_sum += d * (slope * inverse_r);
#ifdef SOLIDS
    // Boundary samples are not moved by corrections: they contribute no gradient of their own.
    gradient_squares += select(slope * slope, 0.0, other.w > 0.0);
#else
    gradient_squares += slope * slope;
#endif
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
    begin_phase();
    let xi = predicted_at(i).xyz;
    own_position = xi;
    kernel_sum = 1.0;
    gradient_sum = vec3f(0.0);
    gradient_squares = 0.0;
    for_each_neighbor(xi, i);
    let wall = wall_term(xi);
    let relative_density = params.density_scale * kernel_sum + wall.density;
    let own = wall.gradient - params.gradient_scale * gradient_sum;
    let squares = dot(own, own) + params.gradient_scale * params.gradient_scale * gradient_squares;
    let lambda = -max(relative_density - 1.0, 0.0) / (squares + params.regularization);
    set_lambda(i, lambda);
#ifdef DENSITY
    density[i] = relative_density;
#endif
}
