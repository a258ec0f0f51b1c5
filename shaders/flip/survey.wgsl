// Data from which the host chooses a step and lays out bricks: which bricks hold water, the largest
// speed, and whether a value is non-finite. Non-negative floats sort like their bit patterns.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/finite.wgsl"
#import "shared/flip_params.wgsl"

@group(0) @binding(1) var<storage, read> position: array<Vector>;
@group(0) @binding(2) var<storage, read> velocity: array<Vector>;

// Mirrored by `SurveyHead` of solve/params.rs.
struct SurveyHead {
    // Bits of the largest squared speed.
    speed_square: atomic<u32>,
    not_finite: atomic<u32>,
    padding: vec2u,
}

struct Survey {
    head: SurveyHead,
    // One flag per brick.
    is_wet: array<atomic<u32>>,
}
@group(0) @binding(3) var<storage, read_write> survey: Survey;

// Particles per thread: this reduces the number of atomics, and in sorted order these particles lie
// in few bricks.
const RUN = 16u;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let first = thread_index(workgroup, workgroups, local, 64u) * RUN;
    let end = min(first + RUN, params.particle_count);
    var fastest = 0.0;
    var not_finite = 0u;
    var last = 0xffffffffu;
    for (var i = first; i < end; i++) {
        let x = three(position[i]);
        let v = three(velocity[i]);
        not_finite += u32(!is_finite(x) || !is_finite(v));
        fastest = max(fastest, dot(v, v));
        let cell = cell_of_place(x * params.inverse_cell_size);
        let index = table_index(cell);
        if index != last {
            atomicStore(&survey.is_wet[index], 1u);
            last = index;
        }
    }
    if first < end {
        atomicMax(&survey.head.speed_square, bitcast<u32>(fastest));
        if not_finite > 0u {
            atomicAdd(&survey.head.not_finite, not_finite);
        }
    }
}
