// Potentials of whitewater at each water particle (after Ihmsen et al. 2012, eqs. 2 to 7): air
// trapped where water at the surface meets water, crests of waves that move outward, and the energy
// that both need. W = 1 − r/h.
#import "shared/thread.wgsl"
#import "shared/predicted.wgsl"
#import "shared/vector.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/search.wgsl"
#import "shared/whitewater.wgsl"

@group(0) @binding(10) var<storage, read> share: array<f32>;
@group(0) @binding(11) var<storage, read> surface: array<vec4f>;
@group(0) @binding(12) var<storage, read> sorted_velocity: array<Vector>;
// Closing speed at the surface, wave crest, energy, water fraction.
@group(0) @binding(13) var<storage, read_write> potential: array<vec4f>;

// Cosines between velocity and normal at which a crest begins to move outward, and fully does:
// domain::whitewater.
override OUTWARD_LEAST: f32;
override OUTWARD_FULL: f32;
// Closing speed over Σ max(−v_ij · x̂_ij, 0) W: domain::whitewater.
override CLOSING: f32;

var<private> own_position: vec3f;
var<private> own_velocity: vec3f;
var<private> own_surface: vec4f;
var<private> closing: f32;
var<private> wave_crest: f32;

fn visit(i: u32, j: u32) {
#ifdef SOLIDS
    if j >= fluid_count {
        return;
    }
#endif
    let d = between(own_position, predicted_at(j).xyz);
    let r2 = dot(d, d);
    let inverse_r = inverseSqrt(max(r2, 1e-30));
    let w = max(1.0 - r2 * inverse_r * inverse_h, 0.0);
    let against = own_velocity - three(sorted_velocity[j]);
    closing += max(-dot(against, d) * inverse_r, 0.0) * w;
    // Counts neighbours that lie behind the normal's plane, where the surface is convex.
    let other = surface[j];
    let behind = clamp(4.0 * dot(d, own_surface.xyz) * inverse_r, 0.0, 1.0);
    wave_crest += (1.0 - dot(own_surface.xyz, other.xyz)) * other.w * behind * w;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i >= params.particle_count {
        return;
    }
    begin_water();
    own_position = predicted_at(i).xyz;
    own_velocity = three(sorted_velocity[i]);
    own_surface = surface[i];
    closing = 0.0;
    wave_crest = 0.0;
    search_neighbors(own_position, i);
    let speed = length(own_velocity);
    let cosine = dot(own_velocity, own_surface.xyz) / max(speed, 1e-30);
    let outward = clamp((cosine - OUTWARD_LEAST) / (OUTWARD_FULL - OUTWARD_LEAST), 0.0, 1.0);
    let crest = wave_crest * own_surface.w * outward;
    let trapped_air = CLOSING * closing * own_surface.w;
    potential[i] = vec4f(trapped_air, crest, 0.5 * speed * speed, share[i]);
}
