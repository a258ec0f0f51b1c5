// Narrow-band FLIP (Ferstl et al. 2016): moves velocity and depth with the water on the grid, for
// where the next substep has no particles. Semi-Lagrangian (Stam 1999), back along the path that
// particles take, straight on by the velocity where they started, with the density correction's
// displacement. Velocities are interpolated by cubic Lagrange polynomials, within the range of the
// eight faces around, where linear ones would act as a viscosity of Δx² / (6 Δt).
#import "shared/thread.wgsl"
#import "shared/flip_velocity.wgsl"

@group(0) @binding(3) var<storage, read> bricks: array<Brick>;
@group(0) @binding(4) var<storage, read> deep_depth: array<f32>;
// Written in the layout of this substep.
@group(0) @binding(5) var<storage, read_write> deep: array<f32>;

const VALUES = 4u;

// Weights of the values at -1, 0, 1 and 2.
fn cubic(t: f32) -> vec4f {
    return vec4f(
        -t * (1.0 - t) * (2.0 - t) / 6.0,
        0.5 * (1.0 + t) * (1.0 - t) * (2.0 - t),
        0.5 * t * (1.0 + t) * (2.0 - t),
        -t * (1.0 - t) * (1.0 + t) / 6.0,
    );
}

// Position in cells, wrapped into periodic axes and kept within the others.
fn within_domain(x: vec3f) -> vec3f {
#ifdef PERIODIC
    let scaled = wrapped_place(x, vec3f(params.cells));
    return select(clamp(scaled, vec3f(0.0), vec3f(params.cells)), scaled, is_periodic());
#else
    return clamp(x, vec3f(0.0), vec3f(params.cells));
#endif
}

// The samples around a position: the cell before it, and steps from there to those at -1, 0, 1, 2,
// within the domain.
var<private> steps: array<vec3i, 4>;
var<private> between: vec3f;

// `first` is the position of sample 0, and `last` the index of the last one, along each axis.
fn look_around(x: vec3f, first: vec3f, last: vec3i) {
    let place = x - first;
    let low = floor(place);
    between = place - low;
    var cell = clamp(vec3i(low), vec3i(0), last);
#ifdef PERIODIC
    cell = select(cell, vec3i(low), is_periodic());
#endif
    find_slots(cell);
    for (var k = 0; k < 4; k++) {
        let there = vec3i(low) + k - 1;
        var sample = clamp(there, vec3i(0), last);
#ifdef PERIODIC
        sample = select(sample, there, is_periodic());
#endif
        steps[k] = sample - cell;
    }
}

// Component of the velocity at a position in cells. Cubic along z; in the inner two planes cubic
// along y, and there in the inner two rows cubic along x; otherwise linear (32 faces; Ritchie et
// al. 1995).
fn component_before(component: u32, x: vec3f) -> f32 {
    var first = vec3f(0.5);
    first[component] = 0.0;
    var last = vec3i(params.cells) - 1;
    last[component] += 1;
    look_around(x, first, last);
    let wx = cubic(between.x);
    let wy = cubic(between.y);
    let wz = cubic(between.z);
    let plane = component * params.stride;
    var sum = 0.0;
    var least = 1e30;
    var most = -1e30;
    for (var c = 0; c < 4; c++) {
        let is_inner = c == 1 || c == 2;
        var of_plane = 0.0;
        for (var b = select(1, 0, is_inner); b < select(3, 4, is_inner); b++) {
            let row_at = vec3i(0, steps[b].y, steps[c].z);
            let before = face_velocity[plane + element_at(row_at + vec3i(steps[1].x, 0, 0))];
            let after = face_velocity[plane + element_at(row_at + vec3i(steps[2].x, 0, 0))];
            let is_middle = is_inner && (b == 1 || b == 2);
            var row = before + between.x * (after - before);
            for (var once = 0; once < select(0, 1, is_middle); once++) {
                row = wx.y * before + wx.z * after
                    + wx.x * face_velocity[plane + element_at(row_at + vec3i(steps[0].x, 0, 0))]
                    + wx.w * face_velocity[plane + element_at(row_at + vec3i(steps[3].x, 0, 0))];
                least = min(least, min(before, after));
                most = max(most, max(before, after));
            }
            let linear = select(between.y, 1.0 - between.y, b == 1);
            of_plane += select(linear, wy[b], is_inner) * row;
        }
        sum += wz[c] * of_plane;
    }
    return clamp(sum, least, most);
}

fn depth_before(x: vec3f) -> f32 {
    look_around(x, vec3f(0.5), vec3i(params.cells) - 1);
    var sum = 0.0;
    for (var k = 0; k < 8; k++) {
        let side = vec3i(k & 1, (k >> 1u) & 1, k >> 2u);
        let offset = vec3i(
            steps[1 + side.x].x, steps[1 + side.y].y, steps[1 + side.z].z);
        let weight = select(1.0 - between, between, side == vec3i(1));
        sum += weight.x * weight.y * weight.z * deep_depth[element_at(offset)];
    }
    return sum;
}

// The vector at the centre of a cell, or of its least face across an axis, whose planes begin at
// `first`: means over faces around it.
fn vector_about(first: u32, cell: vec3i, axis: u32) -> vec3f {
    var back = vec3i(0);
    for (var k = 0u; k < 3u; k++) {
        // Beyond the outermost centres the vector is that of the outermost.
        let is_first = cell[k] == 0 && !is_joined(k);
        back[k] = select(0, -1, k == axis && !is_first);
    }
    var found = vec3f(0.0);
    for (var k = 0u; k < 3u; k++) {
        var step = vec3i(0);
        step[k] = select(1, 0, k == axis);
        let plane = first + k * params.stride;
        let beside = select(back, vec3i(0), k == axis);
        let here = face_velocity[plane + element_at(vec3i(0))]
            + face_velocity[plane + element_at(step)];
        let there = face_velocity[plane + element_at(beside)]
            + face_velocity[plane + element_at(beside + step)];
        found[k] = 0.25 * (here + there);
    }
    return found;
}

fn is_joined(axis: u32) -> bool {
#ifdef PERIODIC
    return is_periodic()[axis];
#else
    return false;
#endif
}

// Where the water was before the substep that is at the centre of a cell, or of its least face
// across an axis; in cells.
fn place_before(cell: vec3i, axis: u32) -> vec3f {
    find_slots(cell);
    let velocity = vector_about(0u, cell, axis);
#ifdef CORRECTION
    let displacement = vector_about(3u * params.stride, cell, axis);
#endif
    var x = vec3f(cell) + 0.5;
    for (var k = 0u; k < 3u; k++) {
        x[k] -= select(0.0, 0.5, k == axis);
    }
    let start = params.cell_size * x - params.time_step * velocity;
    var way = params.time_step * velocity_at(start, velocity);
#ifdef CORRECTION
    way += displacement;
#endif
    way *= min(1.0, params.max_displacement / max(length(way), 1e-30));
    return within_domain(x - way * params.inverse_cell_size);
}

const CENTER = 3u;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.wet_cells {
        return;
    }
    let element = thread + CELLS;
    let slot = element / CELLS;
    let brick = vec3u(
        bricks[slot].coordinate[0], bricks[slot].coordinate[1], bricks[slot].coordinate[2]);
    let cell = vec3i(8u * brick + local_cell(element % CELLS));
    let first = VALUES * slot * CELLS + element % CELLS;
    for (var component = 0u; component < 3u; component++) {
        let origin = place_before(cell, component);
        deep[first + component * CELLS] = component_before(component, origin);
    }
    deep[first + 3u * CELLS] = depth_before(place_before(cell, CENTER));
}
