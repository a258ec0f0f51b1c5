// Sums values over parts of pockets, one workgroup per part, in a fixed order.
#import "shared/pressure_pockets.wgsl"

@group(0) @binding(3) var<storage, read> values: array<real>;
@group(0) @binding(4) var<storage, read_write> pressure_pocket_sums: array<real>;

@compute @workgroup_size(256)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let index = thread_index(workgroup, workgroups, 0u, 1u);
    if index >= phase.pocket_parts {
        return;
    }
    let part = pressure_pocket_parts[index];
    var sum = real(0.0);
    for (var k = part.first + local; k < part.end; k += 256u) {
        sum += values[pressure_pocket_cells[k]];
    }
    let total = sum_256(sum, local);
    if local == 0u {
        pressure_pocket_sums[index] = total;
    }
}
