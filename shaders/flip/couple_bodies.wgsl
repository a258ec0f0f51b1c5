// How the pressure of each cell pushes a body: the area of its surface in the cell, as a vector and
// as a moment about the centre of mass (Batty et al. 2007). By symmetry the same six numbers times
// the body's velocity are its flux out of the cell.
//
// The pressure of a cell is that at its centre, and the body's surface lies elsewhere in it. Where
// the pressure grows with depth as in still water, that makes a difference by ρ g times what the
// cell's solid volume is less than the mean of its closed faces; without it the body would displace
// whole layers of cells, and bob between them. The solid volume is that behind a plane that is
// moved outward, by what gives all cells together the volume of the mesh: a plane cuts off edges.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_cell.wgsl"
#import "shared/flip_faces.wgsl"
#import "shared/bodies.wgsl"
#import "shared/brick_solids.wgsl"
#import "shared/pressure_real.wgsl"

// For each pair six arrays of 512 cells: area over Δx², then moment over Δx², metres.
@group(0) @binding(4) var<storage, read_write> body_coupling: array<f32>;
// For each pair six sums of that difference, as pressures q.
@group(0) @binding(5) var<storage, read_write> body_sums: array<real>;
@group(0) @binding(6) var<storage, read> cell_kind: array<u32>;

const FLUID = 1u;

var<workgroup> terms: array<array<real, 6>, 64>;

// Area of the body in a face, over Δx²; 0 where another solid is nearer.
fn share(of_walls: vec3f, open: vec3f, nearest: vec3u, solid: u32) -> vec3f {
    return select(vec3f(0.0), of_walls - open, nearest == vec3u(solid));
}

// Fraction of a corner of a unit cube within a tetrahedron of height `a`.
fn tip(a: f32, m: vec3f) -> f32 {
    return (a / m.x) * (a / m.y) * (a / m.z) / 6.0;
}

// Fraction of a cube below the plane through values at its corners, where they are negative
// (Scardovelli and Zaleski 2000).
fn inside_part(c: Corners) -> f32 {
    let slopes = abs(vec3f(
        dot(c.near.yw + c.far.yw - c.near.xz - c.far.xz, vec2f(0.25)),
        dot(c.near.zw + c.far.zw - c.near.xy - c.far.xy, vec2f(0.25)),
        dot(c.far - c.near, vec4f(0.25)),
    ));
    let rise = max(slopes.x + slopes.y + slopes.z, 1e-20);
    let height = clamp(0.5 - dot(c.near + c.far, vec4f(0.125)) / rise, 0.0, 1.0);
    let low = min(slopes.x, slopes.y);
    let high = max(slopes.x, slopes.y);
    let rising = vec3f(min(low, slopes.z), max(low, min(high, slopes.z)), max(high, slopes.z));
    let m = max(rising / rise, vec3f(1e-20));
    let a = min(height, 1.0 - height);
    var smaller = (a - 0.5 * (m.x + m.y)) / m.z;
    if a <= m.x {
        smaller = tip(a, m);
    } else if a <= m.x + m.y {
        let both = (a / m.y * (a - m.x) + m.x / m.y * m.x / 3.0) / (2.0 * m.z);
        smaller = both - tip(max(a - m.y, 0.0), m) - tip(max(a - m.z, 0.0), m);
    }
    return select(smaller, 1.0 - smaller, height > 0.5);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let pair = thread_index(workgroup, workgroups, 0u, 1u);
    let is_due = pair < pair_count();
    let body = body_pairs[select(0u, pair, is_due)].body;
    look_about(select(0u, pair, is_due));
    let solid = body_states[body].solid;
    let centre = body_states[body].centre;
    let offset = posed_solids.solids[solid].offset;
    var sums = array<real, 6>(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (var inner = local; inner < select(0u, CELLS, is_due); inner += 64u) {
        let element = CELLS * body_pairs[pair].slot + inner;
        let cell = vec3f(own_cell(element));
        let extent = open_extent(cell);
        let cut = cut_faces(cell, extent.yzx * extent.zxy);
        let low = share(cut.lower_of_walls, cut.lower, cut.lower_solid, solid);
        let high = share(cut.upper_of_walls, cut.upper, cut.upper_solid, solid);
        let area = high - low;
        // Moments of the faces' middles.
        let arm = (cell + 0.5) * params.cell_size - centre;
        let way = cross(arm, area);
        let first = 6u * CELLS * pair + inner;
        for (var k = 0u; k < 3u; k++) {
            body_coupling[first + CELLS * k] = area[k];
            body_coupling[first + CELLS * (k + 3u)] = way[k];
        }
        // In a cell that other solids cut as well, the volume is not the body's alone.
        let closed_low = cut.lower_of_walls - cut.lower;
        let closed_high = cut.upper_of_walls - cut.upper;
        let is_own = all(low == closed_low) && all(high == closed_high);
        let is_alone = is_own && cell_kind[element] == FLUID;
        // From the distances to the body alone: those of all solids are moved outward as well.
        var filled = 0.0;
        for (var once = 0; once < select(0, 1, may_cut_by(solid, cell)); once++) {
            let own = corner_distances(cell);
            let moved = Corners(own.near - offset, own.far - offset);
            filled = extent.x * extent.y * extent.z * inside_part(moved);
        }
        let missing = 0.5 * (low + high) - filled;
        let push = params.velocity_step * select(vec3f(0.0), missing, is_alone);
        let turn = cross(arm, push);
        for (var k = 0u; k < 3u; k++) {
            sums[k] += real(push[k]);
            sums[k + 3u] += real(turn[k]);
        }
    }
    terms[local] = sums;
    workgroupBarrier();
    if local < 6u && is_due {
        var sum = real(0.0);
        for (var k = 0u; k < 64u; k++) {
            sum += terms[k][local];
        }
        body_sums[6u * pair + local] = sum;
    }
}
