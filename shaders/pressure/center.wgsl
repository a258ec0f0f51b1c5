// Removes the mean over each pocket, where the system is singular, from the sums of its parts
// (pressure/sum_pockets). One workgroup per part. Beside bodies that squeeze a pocket, the solids'
// flux lets the mean of its right-hand side leave.
#import "shared/pressure_pockets.wgsl"
#import "shared/pressure_stats.wgsl"

alias note = atomic<u32>;

@group(0) @binding(3) var<storage, read_write> values: array<real>;
@group(0) @binding(4) var<storage, read> pressure_pocket_sums: array<real>;
@group(0) @binding(5) var<storage, read_write> pressure_stats: PressureStats;
#ifdef BODIES
@group(0) @binding(6) var<storage, read_write> solid_flux: array<f32>;
#endif

#ifdef PERIODIC
#ifdef F64
const UNIT = real(1.2e-16);
#else
const UNIT = real(6e-8);
#endif
#endif

#ifdef BODIES
// Whether the values are a projection's right-hand side.
fn is_leaking() -> bool {
    return phase.step == 1u && phase.body_bricks > 0u;
}

// Element of arrays in natural order from that of blocked ones.
fn natural_cell(element: u32) -> u32 {
    let block = element & 63u;
    let within = (element >> 6u) & 7u;
    let x = 2u * (block & 3u) + (within & 1u);
    let y = 2u * ((block >> 2u) & 3u) + ((within >> 1u) & 1u);
    let z = 2u * (block >> 4u) + (within >> 2u);
    return (element & ~511u) + x + 8u * y + 64u * z;
}
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
#ifdef BODIES
    for (var k = part.first + local; k < select(part.first, part.end, is_leaking()); k += 256u) {
        solid_flux[natural_cell(pressure_pocket_cells[k])] += f32(mean);
    }
#endif
    if local == 0u && phase.step == 1u {
        atomicMax(&pressure_stats.incompatible, bitcast<u32>(f32(abs(mean)) / phase.cell_size));
    }
}
