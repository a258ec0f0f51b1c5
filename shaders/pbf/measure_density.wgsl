// Relative density at the sorted positions by a full search: the figure of the frame's report,
// which does not depend on neighbour lists.
#import "shared/thread.wgsl"
#import "shared/predicted.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/phase.wgsl"
#import "shared/search.wgsl"
#import "shared/walls.wgsl"

@group(0) @binding(10) var<storage, read_write> density: array<f32>;

var<private> own_position: vec3f;
var<private> kernel_sum: f32;

fn visit(i: u32, j: u32) {
    let other = predicted_at(j);
    let d = between(own_position, other.xyz);
    let p = max(1.0 - dot(d, d) * inverse_h * inverse_h, 0.0);
    kernel_sum += weight(other.w) * p * p * p;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.particle_count {
        return;
    }
    begin_phase();
    let xi = predicted_at(thread).xyz;
    own_position = xi;
    kernel_sum = 1.0;
    search_neighbors(xi, thread);
    density[thread] = params.density_scale * kernel_sum + wall_term(xi).density;
}
