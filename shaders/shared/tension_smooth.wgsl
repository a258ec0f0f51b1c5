// One pass of the binomial filter (1 2 1)³ / 64 over the water fraction; the importing pass defines
// `share_of` and `store`.
#import "shared/tension.wgsl"

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.active_cells {
        return;
    }
    let element = thread + CELLS;
    open_mirrored(element);
    var sum = 0.0;
    for (var k = 0; k < 27; k++) {
        let step = vec3i(k % 3, k / 3 % 3, k / 9) - 1;
        let weight = select(vec3f(0.25), vec3f(0.5), step == vec3i(0));
        sum += weight.x * weight.y * weight.z * share_of(mirrored_element(step));
    }
    store(element, sum);
}
