// Sums over a workgroup of 64 threads, in a fixed order. The importer defines `Terms`: a real, or a
// vector of reals.
#import "shared/pressure_real.wgsl"

// Four sums per workgroup of a pass over the finest level.
@group(0) @binding(9) var<storage, read_write> pressure_sums: array<real>;

// ‖residual‖²; residual · correction, replaced by direction · product; residual · product;
// ‖product‖².
const SQUARE = 0u;
const CORRECTED = 1u;
const STEEPNESS = 1u;
const OVERLAP = 2u;
const PRODUCT_SQUARE = 3u;

var<workgroup> terms: array<Terms, 64>;

// The sum of `term` over the workgroup; valid in its first thread.
fn sum_workgroup(term: Terms, local: u32) -> Terms {
    terms[local] = term;
    workgroupBarrier();
    if local < 8u {
        var sum = Terms(0.0);
        for (var k = local; k < 64u; k += 8u) {
            sum += terms[k];
        }
        terms[local] = sum;
    }
    workgroupBarrier();
    var sum = Terms(0.0);
    if local == 0u {
        for (var k = 0u; k < 8u; k++) {
            sum += terms[k];
        }
    }
    return sum;
}
