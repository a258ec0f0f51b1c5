// Bodies of water that no air touches, as lists of cells in parts of at most 4096.
#import "shared/pressure_phase.wgsl"
#import "shared/pressure_real.wgsl"

// Mirrored by `PocketPart` of solve/pressure/params.rs.
struct PocketPart {
    // Half-open range in `pressure_pocket_cells`.
    first: u32,
    end: u32,
    // Half-open range of the parts of the same pocket.
    first_part: u32,
    end_part: u32,
}

@group(0) @binding(1) var<storage, read> pressure_pocket_cells: array<u32>;
@group(0) @binding(2) var<storage, read> pressure_pocket_parts: array<PocketPart>;

var<workgroup> terms: array<real, 256>;

// The sum over a workgroup of 256 threads, in a fixed order.
fn sum_256(term: real, local: u32) -> real {
    terms[local] = term;
    workgroupBarrier();
    for (var half = 128u; half > 0u; half /= 2u) {
        if local < half {
            terms[local] += terms[local + half];
        }
        workgroupBarrier();
    }
    return terms[0];
}
