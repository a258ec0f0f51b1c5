// Rows of the finest level (Batty et al. 2007, Enright et al. 2003); reference:
// `domain::poisson::System`.
#import "shared/pressure_site.wgsl"
#import "shared/pressure_stats.wgsl"

alias note = atomic<u32>;

@group(0) @binding(2) var<storage, read_write> pressure_coefficient: array<f32>;
@group(0) @binding(3) var<storage, read_write> pressure_dirichlet: array<real>;
@group(0) @binding(4) var<storage, read_write> pressure_block: array<u32>;
@group(0) @binding(5) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(6) var<storage, read> face_open: array<f32>;
#ifdef GHOST_FLUID
@group(0) @binding(7) var<storage, read> liquid_distance: array<f32>;
#endif
@group(0) @binding(8) var<storage, read_write> pressure_stats: PressureStats;
#ifdef DIAGONAL
@group(0) @binding(9) var<storage, read_write> pressure_inverse_diagonal: array<real>;
#endif

const AIR = 0u;
const FLUID = 1u;
// Lower bound for θ, the fraction of the distance to the air cell's centre at which the surface
// lies.
const LEAST_THETA = 0.01;
// Upper bound for θ. It exceeds 1 if the surface lies beyond the air cell's centre, over a floor
// that passes above that centre.
const MOST_THETA = 100.0;

struct Row {
    dirichlet: real,
    diagonal: real,
    // Coefficients of the lower faces.
    coefficient: vec3f,
    // Whether all six coefficients are 1.
    is_full: bool,
}

// The six neighbours of cell `c` in natural order, lower ones first.
fn neighbors_of(s: Site, c: u32) -> array<u32, 6> {
    let own = natural(s.slot, s.block);
    let lower = natural_lower(s);
    let upper = natural_upper(s);
    var out: array<u32, 6>;
    let bit = vec3u(c & 1u, (c >> 1u) & 1u, c >> 2u);
    for (var axis = 0u; axis < 3u; axis++) {
        let across = dot(
            select(NATURAL * bit, vec3u(0u), vec3u(0u, 1u, 2u) == vec3u(axis)), vec3u(1u));
        let step = NATURAL[axis];
        out[axis] = select(lower[axis] + step, own, bit[axis] == 1u) + across;
        out[axis + 3u] = select(own + step, upper[axis], bit[axis] == 1u) + across;
    }
    return out;
}

// 1 / θ for a surface between a cell of water and a cell of air.
fn inverse_theta(water: u32, air: u32) -> real {
#ifdef GHOST_FLUID
    let inside = max(-real(liquid_distance[water]), 0.0);
    let outside = real(liquid_distance[air]);
    let theta = select(MOST_THETA, inside / (inside + outside), inside + outside > 0.0);
    return 1.0 / clamp(theta, LEAST_THETA, MOST_THETA);
#else
    return 1.0;
#endif
}

fn row_of(s: Site, c: u32) -> Row {
    let own = natural(s.slot, s.block) + (c & 1u) + 8u * ((c >> 1u) & 1u) + 64u * (c >> 2u);
    let neighbor = neighbors_of(s, c);
    let is_fluid = cell_kind[own] == FLUID;
    var row = Row(0.0, 0.0, vec3f(0.0), is_fluid);
    for (var k = 0u; k < 6u; k++) {
        let axis = k % 3u;
        let other = cell_kind[neighbor[k]];
        let open = select(
            0.0, face_open[axis * phase.stride + select(neighbor[k], own, k < 3u)], is_fluid);
        let coefficient = select(0.0, open, other == FLUID);
        let air = real(select(0.0, open, other == AIR)) * inverse_theta(own, neighbor[k]);
        row.dirichlet += air;
        row.diagonal += real(coefficient) + air;
        row.is_full = row.is_full && coefficient == 1.0;
        if k < 3u {
            row.coefficient[k] = coefficient;
        }
    }
    return row;
}

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
    // Cells of air may also lie in active bricks after the wet ones.
    let s = site_at(range.x + i / 64u, i & 63u, range.z);
    var rows = 0u;
    var full = 0u;
    var dropped = 0u;
    for (var c = 0u; c < 8u; c++) {
        let row = row_of(s, c);
        let e = blocked(s.slot, s.block) + 64u * c;
        for (var axis = 0u; axis < 3u; axis++) {
            pressure_coefficient[axis * phase.stride + e] = row.coefficient[axis];
        }
        pressure_dirichlet[e] = row.dirichlet;
#ifdef DIAGONAL
        pressure_inverse_diagonal[e] = select(0.0, 1.0 / row.diagonal, row.diagonal > 0.0);
#endif
        let own = natural(s.slot, s.block) + (c & 1u) + 8u * ((c >> 1u) & 1u) + 64u * (c >> 2u);
        dropped += u32(cell_kind[own] == FLUID && !(row.diagonal > 0.0));
        rows |= select(0u, 1u << c, row.diagonal > 0.0);
        full += u32(row.is_full);
    }
    let kind = select(select(2u, 1u, full == 8u), 0u, rows == 0u);
    pressure_block[64u * s.slot + s.block] = kind | (rows << 8u);
    if dropped > 0u {
        atomicAdd(&pressure_stats.dropped, dropped);
    }
}
