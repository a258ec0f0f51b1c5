// Lists who is within h at the predicted positions, once a substep. A particle with more neighbours
// than a list holds keeps its true count, and every pass then searches for it instead.
#import "shared/thread.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/phase.wgsl"
#import "shared/neighbor_list.wgsl"

@group(0) @binding(1) var<storage, read> predicted: array<vec4f>;
@group(0) @binding(2) var<storage, read> cell_start: array<u32>;
#ifdef SOLIDS
@group(0) @binding(3) var<storage, read> boundary_cell_start: array<u32>;
#endif
@group(0) @binding(4) var<storage, read_write> neighbor_list: array<u32>;
@group(0) @binding(5) var<storage, read_write> neighbor_count: array<u32>;
@group(0) @binding(10) var<storage, read_write> counters: array<atomic<u32>>;

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
    let xi = predicted[i].xyz;
    let h2 = params.support_radius * params.support_radius;
    let dims = vec3i(params.grid_dims);
    let centre = cell_coordinate(xi);
    let low = max(centre - 1, vec3i(0));
    let high = min(centre + 1, dims - 1);
    let base = list_base(i);
    var count = 0u;
    for (var z = low.z; z <= high.z; z++) {
        for (var y = low.y; y <= high.y; y++) {
            let row = (z * dims.y + y) * dims.x;
            let first = u32(row + low.x);
            let last = u32(row + high.x) + 1u;
            let end = cell_start[last];
            for (var j = cell_start[first]; j < end; j++) {
                let d = xi - predicted[j].xyz;
                if dot(d, d) < h2 && j != i {
                    if count < LIST_CAPACITY {
                        neighbor_list[base + count * LIST_STRIDE] = j;
                    }
                    count++;
                }
            }
#ifdef SOLIDS
            let boundary_end = boundary_cell_start[last];
            for (var b = boundary_cell_start[first]; b < boundary_end; b++) {
                let d = xi - predicted[2u * params.particle_count + b].xyz;
                if dot(d, d) < h2 {
                    if count < LIST_CAPACITY {
                        neighbor_list[base + count * LIST_STRIDE] = params.particle_count + b;
                    }
                    count++;
                }
            }
#endif
        }
    }
    neighbor_count[i] = count;
    if count > LIST_CAPACITY {
        atomicAdd(&counters[1], 1u);
    }
}
