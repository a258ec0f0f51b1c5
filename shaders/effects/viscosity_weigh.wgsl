// Sets up a viscous solve: which faces it moves, and the water fraction that weights each stress
// (Batty and Bridson 2008), in one word per cell. Also stores the initial velocities of the solve,
// and the pressure of the projection before it.
//
// A face moves if it is open and beside water. An edge has no stress if one of its faces is in the
// air: the surface is stress-free. A wall or solid is half a cell away from the face beside it: its
// velocity pair counts twice in the strain, over half the water. Solids are no-slip; walls are if
// they are no-slip walls.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_neighborhood.wgsl"
#import "shared/unit.wgsl"
#import "shared/viscous_word.wgsl"

// Bit mask of no-slip walls: the minimum faces along x, y, z, then the maximum faces.
override NO_SLIP: u32;

@group(0) @binding(2) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(3) var<storage, read> face_open: array<f32>;
@group(0) @binding(4) var<storage, read> face_velocity: array<f32>;
@group(0) @binding(5) var<storage, read> pressure: array<f32>;
@group(0) @binding(6) var<storage, read_write> viscous_word: array<u32>;
@group(0) @binding(7) var<storage, read_write> viscous_start: array<f32>;
@group(0) @binding(8) var<storage, read_write> viscous_pressure: array<f32>;

const FLUID = 1u;

// A face this far behind a wall still counts as in its plane, cells.
const BESIDE = 0.01;

const IN_AIR = 0u;
const MOVES = 1u;
const CLOSED = 2u;

var<private> cell: vec3f;

fn is_water(offset: vec3i) -> bool {
    return cell_kind[element_at(offset)] == FLUID;
}

// Bit mask of the walls that a position lies behind.
fn behind(place: vec3f) -> u32 {
    let low = select(vec3u(0u), vec3u(1u, 2u, 4u), place < params.cut_min - BESIDE);
    let high = select(vec3u(0u), vec3u(8u, 16u, 32u), place > params.cut_max + BESIDE);
    return low.x | low.y | low.z | high.x | high.y | high.z;
}

// Centre of the lower face along `axis` of the cell at `offset`, in cells.
fn middle(offset: vec3i, axis: u32) -> vec3f {
    return cell + vec3f(offset) + 0.5 - 0.5 * vec3f(unit(axis));
}

fn state_of(offset: vec3i, axis: u32) -> u32 {
    let element = element_at(offset);
    let beside = is_water(offset) || is_water(offset - unit(axis));
    let open = select(IN_AIR, MOVES, beside);
    // Cells of absent bricks lie behind a wall or far from water.
    let stored = select(CLOSED, open, face_open[axis * params.stride + element] > 0.0);
    let missing = select(IN_AIR, CLOSED, behind(middle(offset, axis)) != 0u);
    return select(stored, missing, element < CELLS);
}

// Weight of the two velocities along `axis` on both sides of an edge, one cell apart along
// `across`: 0 if both are closed, 1 if none, 2 if one is, and 3 if one is closed by a free-slip
// wall.
fn weight_of(states: vec2u, axis: u32, across: u32) -> u32 {
    let closed = vec2u(states == vec2u(CLOSED));
    let offset = select(vec3i(0), -unit(across), states.y == CLOSED);
    let walls = behind(middle(offset, axis)) & (9u << across);
    let slips = walls != 0u && (walls & NO_SLIP) == 0u;
    let one = select(2u, 3u, slips);
    return select(select(1u, one, closed.x + closed.y == 1u), 0u, closed.x + closed.y == 2u);
}

// Bits of the edge along `axis`.
fn edge_bits(axis: u32) -> u32 {
    let a = (axis + 1u) % 3u;
    let b = (axis + 2u) % 3u;
    let to_a = -unit(a);
    let to_b = -unit(b);
    let of_a = vec2u(state_of(vec3i(0), a), state_of(to_b, a));
    let of_b = vec2u(state_of(vec3i(0), b), state_of(to_a, b));
    let water = u32(is_water(vec3i(0))) + u32(is_water(to_a)) + u32(is_water(to_b))
        + u32(is_water(to_a + to_b));
    let weight_a = weight_of(of_a, a, b);
    let weight_b = weight_of(of_b, b, a);
    let is_free = any(of_a == vec2u(IN_AIR)) || any(of_b == vec2u(IN_AIR))
        || weight_a == 3u || weight_b == 3u;
    return select(water | (weight_a << 3u) | (weight_b << 5u), 0u, is_free);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.active_cells {
        return;
    }
    let element = thread + CELLS;
    open_neighborhood(element);
    cell = vec3f(own_cell(element));
    var word = select(0u, WATER, is_water(vec3i(0)));
    for (var axis = 0u; axis < 3u; axis++) {
        let moves = state_of(vec3i(0), axis) == MOVES;
        let is_whole = is_water(vec3i(0)) && is_water(-unit(axis));
        word |= select(0u, 1u << (MOVED + axis), moves);
        word |= select(0u, 1u << (WHOLE + axis), moves && is_whole);
        word |= edge_bits(axis) << (EDGES + EDGE_BITS * axis);
        let face = axis * params.stride + element;
        viscous_start[face] = face_velocity[face];
    }
    viscous_word[element] = word;
    viscous_pressure[element] = pressure[element];
}
