// Removes the mean over each pocket, where the system is singular, from the sums of its parts
// (pressure/sum_pockets). One workgroup per part.
#import "shared/pressure_pockets.wgsl"
#import "shared/pressure_stats.wgsl"

alias note = atomic<u32>;

@group(0) @binding(3) var<storage, read_write> values: array<real>;
@group(0) @binding(4) var<storage, read> pressure_pocket_sums: array<real>;
@group(0) @binding(5) var<storage, read_write> pressure_stats: PressureStats;

#ifdef PERIODIC
#ifdef F64
const UNIT = real(1.2e-16);
#else
const UNIT = real(6e-8);
#endif
#endif

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
    for (var k = part.first_part + local; k < part.end_part; k += 256u) {
        sum += pressure_pocket_sums[k];
    }
    let total = sum_256(sum, local);
    let cells = pressure_pocket_parts[part.end_part - 1u].end
        - pressure_pocket_parts[part.first_part].first;
    let mean = total / real(cells);
#ifdef PERIODIC
    // Without any wall all values can be equal; then only the rounding error of their mean is left,
    // which no solve can reduce. The bound counts the 16 values of a thread, the parts that a
    // thread adds up, two trees of 8 sums, and 6 further operations.
    let parts = real(part.end_part - part.first_part);
    let slack = abs(mean) * (parts / 256.0 + 38.0) * UNIT;
    for (var k = part.first + local; k < part.end; k += 256u) {
        let left = values[pressure_pocket_cells[k]] - mean;
        values[pressure_pocket_cells[k]] = select(left, 0.0, abs(left) <= slack);
    }
#else
    for (var k = part.first + local; k < part.end; k += 256u) {
        values[pressure_pocket_cells[k]] -= mean;
    }
#endif
    if local == 0u && phase.step == 1u {
        atomicMax(&pressure_stats.incompatible, bitcast<u32>(f32(abs(mean)) / phase.cell_size));
    }
}
