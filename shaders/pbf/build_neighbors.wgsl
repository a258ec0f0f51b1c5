// Lists the neighbours within h at the predicted positions, once per substep. With quantized
// positions the list also holds a few slightly farther ones, whose kernels are 0 until they come
// close. A particle with more neighbours than its list holds keeps the true count, and every pass
// then searches its neighbours instead.
#import "shared/thread.wgsl"
#import "shared/predicted.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/phase.wgsl"
#import "shared/neighbor_list.wgsl"
#import "shared/counters.wgsl"
#ifdef PLACES
#import "shared/place.wgsl"
// h in steps, plus the uncertainty of quantized positions.
const REACH = STEPS + UNSURE;
@group(0) @binding(11) var<storage, read> place: array<u32>;
#endif

@group(0) @binding(2) var<storage, read> cell_start: array<u32>;
#ifdef SOLIDS
@group(0) @binding(3) var<storage, read> boundary_cell_start: array<u32>;
#endif
@group(0) @binding(4) var<storage, read_write> neighbor_list: array<vec4u>;
@group(0) @binding(5) var<storage, read_write> neighbor_count: array<u32>;
@group(0) @binding(10) var<storage, read_write> counters: Counters;

var<private> word: u32;
var<private> four: vec4u;
var<private> count: u32;

// Writes a word when it is full: stores cost as much as loads.
fn append(j: u32) {
    four = vec4u(j, four.xyz);
    count++;
    if (count & 3u) == 0u && count <= LIST_CAPACITY {
        neighbor_list[word] = four;
        word += LIST_STRIDE;
    }
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= phase.count {
        return;
    }
    let i = phase_particle(thread);
    let xi = predicted_at(i).xyz;
    let h2 = params.support_radius * params.support_radius;
#ifdef PLACES
    let own = place[i];
#endif
    let fluid_end = params.particle_count;
    let dims = vec3i(params.grid_dims);
    let centre = cell_coordinate(xi);
    let low = max(centre - 1, vec3i(0));
    let high = min(centre + 1, dims - 1);
    word = list_base(i);
    four = vec4u(params.nobody);
    count = 0u;
#ifdef PERIODIC
    for (var k = 0; k < 27; k++) {
        var cell: vec3i;
        if cell_about(centre, k, &cell) {
            let first = cell_index(cell);
            let last = first + 1u;
#else
    for (var z = low.z; z <= high.z; z++) {
        for (var y = low.y; y <= high.y; y++) {
            let row = (z * dims.y + y) * dims.x;
            let first = u32(row + low.x);
            let last = u32(row + high.x) + 1u;
#endif
            let end = cell_start[last];
#ifdef PLACES
            // First finds candidates as bits and then appends them: llvmpipe runs the body of a
            // branch for every candidate.
            for (var base = cell_start[first]; base < end; base += 32u) {
                let stop = min(base + 32u, end);
                var found = 0u;
                var bit = 1u;
                for (var j = base; j < stop; j++) {
                    found |= select(
                        0u, bit, square_between(own, place[j]) < REACH * REACH && j != i);
                    bit <<= 1u;
                }
                for (; found != 0u; found &= found - 1u) {
                    append(base + firstTrailingBit(found));
                }
            }
#else
            for (var j = cell_start[first]; j < end; j++) {
                let d = between(xi, predicted_at(j).xyz);
                if dot(d, d) < h2 && j != i {
                    append(j);
                }
            }
#endif
#ifdef SOLIDS
            let boundary_end = boundary_cell_start[last];
            for (var b = boundary_cell_start[first]; b < boundary_end; b++) {
                let d = between(xi, predicted_at(fluid_end + b).xyz);
                if dot(d, d) < h2 {
                    append(fluid_end + b);
                }
            }
#endif
        }
    }
    if (count & 3u) != 0u && count < LIST_CAPACITY {
        // The newest neighbour comes first; the rest of the word is padding, or repeats neighbours
        // of a full word before it.
        let held = count & 3u;
        neighbor_list[word] = select(
            vec4u(params.nobody), four, vec4u(0u, 1u, 2u, 3u) < vec4u(held));
    }
    neighbor_count[i] = count;
    if count > LIST_CAPACITY {
        atomicAdd(&counters.searched, 1u);
    }
}
