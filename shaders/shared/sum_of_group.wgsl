// Sum over the 64 threads of a workgroup.
var<workgroup> group_terms: array<f32, 64>;

// In the first thread the sum of all threads' terms, in the order of the threads; 0 in the others.
// Every thread of the workgroup calls it.
fn sum_of_group(local: u32, term: f32) -> f32 {
    group_terms[local] = term;
    workgroupBarrier();
    var sum = 0.0;
    for (var k = 0u; k < select(0u, 64u, local == 0u); k++) {
        sum += group_terms[k];
    }
    return sum;
}
