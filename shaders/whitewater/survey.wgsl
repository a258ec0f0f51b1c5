// Water fraction around each water particle, and the surface normal there, opposite to the
// density's gradient.
#import "shared/thread.wgsl"
#import "shared/predicted.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/search.wgsl"
#import "shared/walls.wgsl"
#import "shared/whitewater.wgsl"

@group(0) @binding(10) var<storage, read_write> share: array<f32>;
// Outward normal, and in w the confidence that there is a surface, 0 to 1.
@group(0) @binding(11) var<storage, read_write> surface: array<vec4f>;

// Lengths of the gradient times h at which a surface begins to be detected, and fully is:
// domain::whitewater.
override SURFACE_LEAST: f32;
override SURFACE_FULL: f32;

var<private> own_position: vec3f;
var<private> kernel_sum: f32;
var<private> solid_sum: f32;
var<private> gradient_sum: vec3f;

fn visit(i: u32, j: u32) {
    let other = predicted_at(j);
    let d = between(own_position, other.xyz);
    let r2 = dot(d, d);
    let p = max(1.0 - r2 * inverse_h * inverse_h, 0.0);
    let inverse_r = inverseSqrt(max(r2, 1e-30));
    let s = max(1.0 - r2 * inverse_r * inverse_h, 0.0);
    var mass = 1.0;
#ifdef SOLIDS
    if j >= fluid_count {
        mass = other.w;
        solid_sum += mass * p * p * p;
    } else {
        kernel_sum += p * p * p;
    }
#else
    kernel_sum += p * p * p;
#endif
    gradient_sum += d * (mass * s * s * inverse_r);
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
    kernel_sum = 1.0;
    solid_sum = 0.0;
    gradient_sum = vec3f(0.0);
    search_neighbors(own_position, i);
    let wall = wall_term(own_position);
    share[i] = share_of(kernel_sum, solid_sum, wall.density);
    // The density falls in the direction from j to i.
    let outward = params.gradient_scale * gradient_sum - wall.gradient;
    let steepness = length(outward);
    let sure = (steepness * params.support_radius - SURFACE_LEAST) / (SURFACE_FULL - SURFACE_LEAST);
    surface[i] = vec4f(outward / max(steepness, 1e-30), clamp(sure, 0.0, 1.0));
}
