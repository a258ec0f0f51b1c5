// Replaces each cell's label by the root of its body, 0 if air touches the body, and counts the
// bodies that no air touches.
#import "shared/pressure_phase.wgsl"
#import "shared/pressure_stats.wgsl"

alias note = atomic<u32>;

@group(0) @binding(1) var<storage, read_write> pressure_label: array<atomic<u32>>;
@group(0) @binding(2) var<storage, read_write> pressure_stats: PressureStats;

const MOST = 1u << 26u;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let range = phase.levels[0];
    if i / 64u >= range.y {
        return;
    }
    let first = 512u * (range.x + i / 64u) + (i & 63u);
    for (var e = first; e < first + 512u; e += 64u) {
        var at = e;
        for (var step = 0u; step < MOST; step++) {
            let next = atomicLoad(&pressure_label[at]);
            if next == at {
                break;
            }
            at = next;
        }
        // Other threads may follow labels through this cell meanwhile: the root leads them to the
        // same end.
        atomicStore(&pressure_label[e], at);
        if at == e {
            atomicAdd(&pressure_stats.pockets, 1u);
        }
    }
}
