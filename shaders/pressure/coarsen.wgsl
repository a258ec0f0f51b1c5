// Rows of a coarser level. A coarse face's coefficient is the mean of its four fine faces (half of
// the Galerkin sum at this scale, see shared/pressure_cycle.wgsl), and the air coefficient is half
// the sum over the eight cells.
#import "shared/pressure_site.wgsl"
#import "shared/bricks.wgsl"

@group(0) @binding(2) var<storage, read_write> pressure_coefficient: array<f32>;
@group(0) @binding(3) var<storage, read_write> pressure_dirichlet: array<real>;
@group(0) @binding(4) var<storage, read_write> pressure_block: array<u32>;
@group(0) @binding(5) var<storage, read_write> pressure_residual: array<real>;
@group(0) @binding(6) var<storage, read> bricks: array<Brick>;

// Limit for a fine cell's air coefficient: a surface very close to one fine cell must not pin the
// seven others (measured: a limit of 1 costs two iterations, above 4 there is no gain).
const MOST_AIR = real(4.0);

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let range = phase.levels[phase.level];
    if i / 64u >= range.y {
        return;
    }
    let slot = range.x + i / 64u;
    let block = i & 63u;
    let at = vec3u(block & 3u, (block >> 2u) & 3u, block >> 4u);
    let half = at >> vec3u(1u);
    let child = bricks[slot].children[half.x + 2u * half.y + 4u * half.z];
    // The fine block below the first cell of this one.
    let corner = 2u * (at & vec3u(1u));
    var is_full = true;
    var is_empty = true;
    for (var c = 0u; c < 8u; c++) {
        let below = corner + vec3u(c & 1u, (c >> 1u) & 1u, c >> 2u);
        let fine_block = below.x + 4u * below.y + 16u * below.z;
        let kind = pressure_block[64u * child + fine_block] & 3u;
        is_full = is_full && kind == 1u;
        is_empty = is_empty && kind == 0u;
        let fine = blocked(child, fine_block);
        let coarse = blocked(slot, block) + 64u * c;
        for (var axis = 0u; axis < 3u; axis++) {
            let first = axis * phase.stride + fine;
            let s = select(64u, 128u, axis == 0u);
            let t = select(256u, 128u, axis == 2u);
            let sum = (pressure_coefficient[first] + pressure_coefficient[first + s])
                + (pressure_coefficient[first + t] + pressure_coefficient[first + s + t]);
            var shared_by_both = 0.25 * sum;
#ifdef PERIODIC
            // A level whose bricks do not wrap around is closed at its ends.
            let is_end = at[axis] == 0u && ((c >> axis) & 1u) == 0u
                && pressure_bricks[slot].faces[axis] == 0u;
            shared_by_both = select(shared_by_both, 0.0, is_end);
#endif
            pressure_coefficient[axis * phase.stride + coarse] = shared_by_both;
        }
        var air = real(0.0);
        for (var d = 0u; d < 8u; d++) {
            air += min(pressure_dirichlet[fine + 64u * d], MOST_AIR);
        }
        pressure_dirichlet[coarse] = 0.5 * air;
        pressure_residual[coarse] = 0.0;
    }
#ifdef PERIODIC
    // At an end that wraps around only on the finer level, coefficients of 1 may lie under closed
    // faces.
    for (var side = 0u; side < 6u; side++) {
        is_full = is_full && pressure_bricks[slot].faces[side] != 0u;
    }
#endif
    pressure_block[64u * slot + block] = select(select(2u, 1u, is_full), 0u, is_empty);
}
