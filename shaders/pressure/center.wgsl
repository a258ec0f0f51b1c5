// Removes the mean over each pocket, where the system is singular. One workgroup per pocket; sums
// in a fixed order.
#import "shared/pressure_phase.wgsl"
#import "shared/pressure_real.wgsl"
#import "shared/pressure_stats.wgsl"

alias note = atomic<u32>;

@group(0) @binding(1) var<storage, read> pressure_pocket_cells: array<u32>;
// Half-open range of each pocket's cells.
@group(0) @binding(2) var<storage, read> pressure_pocket_ranges: array<vec2u>;
@group(0) @binding(3) var<storage, read_write> values: array<real>;
@group(0) @binding(4) var<storage, read_write> pressure_stats: PressureStats;

#ifdef PERIODIC
#ifdef F64
const UNIT = real(1.2e-16);
#else
const UNIT = real(6e-8);
#endif
#endif

var<workgroup> terms: array<real, 256>;

@compute @workgroup_size(256)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let range = pressure_pocket_ranges[thread_index(workgroup, workgroups, 0u, 1u)];
    var sum = real(0.0);
    for (var k = range.x + local; k < range.y; k += 256u) {
        sum += values[pressure_pocket_cells[k]];
    }
    terms[local] = sum;
    workgroupBarrier();
    for (var half = 128u; half > 0u; half /= 2u) {
        if local < half {
            terms[local] += terms[local + half];
        }
        workgroupBarrier();
    }
    let mean = terms[0] / max(real(range.y - range.x), 1.0);
#ifdef PERIODIC
    // Without any wall all values can be equal; then only the rounding error of their mean is left,
    // which no solve can reduce. The bound counts 256 partial sums, each over one thread's values,
    // and 14 further operations.
    let slack = abs(mean) * (real(range.y - range.x) / 256.0 + 14.0) * UNIT;
    for (var k = range.x + local; k < range.y; k += 256u) {
        let left = values[pressure_pocket_cells[k]] - mean;
        values[pressure_pocket_cells[k]] = select(left, 0.0, abs(left) <= slack);
    }
#else
    for (var k = range.x + local; k < range.y; k += 256u) {
        values[pressure_pocket_cells[k]] -= mean;
    }
#endif
    if local == 0u && phase.step == 1u {
        atomicMax(&pressure_stats.incompatible, bitcast<u32>(f32(abs(mean)) / phase.cell_size));
    }
}
