// Sums over a workgroup of 64 threads, in a fixed order.
#import "shared/pressure_real.wgsl"

@group(0) @binding(9) var<storage, read_write> pressure_sums: array<real>;

var<workgroup> terms: array<real, 64>;

// Stores the sum of `term` over the workgroup in `pressure_sums[place]`.
fn sum_workgroup(term: real, local: u32, place: u32) {
    terms[local] = term;
    workgroupBarrier();
    if local < 8u {
        var sum = real(0.0);
        for (var k = local; k < 64u; k += 8u) {
            sum += terms[k];
        }
        terms[local] = sum;
    }
    workgroupBarrier();
    if local == 0u {
        var sum = real(0.0);
        for (var k = 0u; k < 8u; k++) {
            sum += terms[k];
        }
        pressure_sums[place] = sum;
    }
}
