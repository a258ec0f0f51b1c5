// Position correction Δx_i = Σ_j (λ_i + λ_j + s_corr) ∇W / ρ0 (Macklin and Müller 2013, eq. 14),
// bounded in length: the unbounded formula with physical masses is unstable.
#import "shared/thread.wgsl"
#import "shared/predicted.wgsl"
#import "shared/vector.wgsl"
#import "shared/counters.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/phase.wgsl"
#import "shared/neighbors.wgsl"
#import "shared/walls.wgsl"
#import "shared/confine.wgsl"
#import "shared/hash.wgsl"
#import "shared/finite.wgsl"
#ifdef WALL_WORK
#import "shared/wall_work.wgsl"
#ifdef MOVING_SOLIDS
// Index of the velocity of the first boundary sample in `solid_distance`.
var<private> first_velocity: u32;
// Sum over boundary samples: density gradient towards each, times its velocity.
var<private> sample_rate: f32;
#endif
#endif

// Other particles do not read it before pbf/exchange.
@group(0) @binding(10) var<storage, read_write> corrected: array<Vector>;
// Counts non-finite values, which clamping would hide.
@group(0) @binding(11) var<storage, read_write> counters: Counters;
#ifdef PRESSURE
#ifndef WALL_WORK
@group(0) @binding(12) var<storage, read_write> lambda_sum: array<f32>;
#endif
#endif
#ifdef ARTIFICIAL_PRESSURE
// W at Δq = 0.2 h over W(0): (1 − 0.04)³.
const REFERENCE_KERNEL = 0.884736;
#endif

var<private> own_position: vec3f;
var<private> own_lambda: f32;
var<private> delta: vec3f;
// A neighbour at the same position, or i itself if there is none. The hash is evaluated after the
// loop, because llvmpipe runs both sides of a branch.
var<private> coincident: u32;
#ifdef ARTIFICIAL_PRESSURE
var<private> artificial_pressure: f32;
#endif

fn visit(i: u32, j: u32) {
    let other = predicted_at(j);
    let d = between(own_position, other.xyz);
    let r2 = dot(d, d);
    let inverse_r = inverseSqrt(max(r2, 1e-30));
    let s = max(1.0 - r2 * inverse_r * inverse_h, 0.0);
    var scale = own_lambda + min(other.w, 0.0);
#ifdef ARTIFICIAL_PRESSURE
    let p = max(1.0 - r2 * inverse_h * inverse_h, 0.0);
    let w = p * p * p / REFERENCE_KERNEL;
    scale -= artificial_pressure * w * w * w * w;
#endif
    delta += d * (inverse_r * scale * weight(other.w) * s * s);
#ifdef WALL_WORK
#ifdef MOVING_SOLIDS
    let sample = select(0u, j - fluid_count, other.w > 0.0);
    let slope = select(0.0, inverse_r * other.w * s * s, other.w > 0.0);
    let first = first_velocity + 3u * sample;
    let velocity = vec3f(
        solid_distance[first], solid_distance[first + 1u], solid_distance[first + 2u]);
    sample_rate += slope * dot(d, velocity);
#endif
#endif
    coincident = select(coincident, j, r2 * inverse_h * inverse_h < 1e-12);
}

fn bounded(step: vec3f) -> vec3f {
    return step * min(1.0, params.max_correction / max(length(step), 1e-30));
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
    let current = predicted_at(i);
    own_position = current.xyz;
    own_lambda = current.w;
#ifdef ARTIFICIAL_PRESSURE
    artificial_pressure = params.artificial_pressure;
#endif
    delta = vec3f(0.0);
    coincident = i;
#ifdef WALL_WORK
#ifdef MOVING_SOLIDS
    first_velocity = solids_end();
    sample_rate = 0.0;
#endif
#endif
    for_each_neighbor(own_position, i);
    if coincident != i {
        delta += pair_direction(i, coincident) * 2.0 * own_lambda;
    }
    delta = -params.gradient_scale * delta + own_lambda * wall_term(own_position).gradient;
    delta *= params.relaxation;
#ifdef PRESSURE
    // Σ λ over the substep's corrections, which is proportional to the pressure.
#ifdef WALL_WORK
    wall_work[2u * params.particle_count + i] += own_lambda;
#else
    lambda_sum[i] += own_lambda;
#endif
#endif
    if !is_finite(own_position + delta) {
        atomicAdd(&counters.not_finite, 1u);
    }
#ifdef WALL_WORK
    let kept = min(1.0, params.max_correction / max(length(delta), 1e-30));
    var rate = wall_rate(own_position);
#ifdef MOVING_SOLIDS
    rate -= params.gradient_scale * sample_rate;
#endif
    var work = kept * params.relaxation * own_lambda * rate;
#endif
    delta = bounded(delta);
#ifdef CHEBYSHEV
    // Wang 2015, eq. 9. `corrected` still holds this particle's position of one iteration before.
    let last = own_position - three(corrected[i]);
    if dot(delta, last) > 0.0 {
        delta = bounded(phase.acceleration * delta + (phase.acceleration - 1.0) * last);
#ifdef WALL_WORK
        // Assumes that the walls' share of the last step was that of this one.
        work *= 2.0 * phase.acceleration - 1.0;
#endif
    }
#endif
    corrected[i] = packed(confine(own_position + delta));
#ifdef WALL_WORK
    wall_work[i] += work + work_of_pushes();
#endif
}
