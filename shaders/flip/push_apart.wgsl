// Moves particles apart that are closer to each other, or to a wall, than in water at rest: by half
// of what each pair lacks, shared between the two (the weak springs of Ando and Tsuruno 2011,
// without their velocity). The density correction only sees cells: within one, particles may gather
// at the surface, at walls, or in one point.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/flip_slots.wgsl"
#import "shared/hash.wgsl"

@group(0) @binding(2) var<storage, read> cell_start: array<u32>;
@group(0) @binding(3) var<storage, read> sorted_position: array<Vector>;
// In storage order, and behind that in sorted order.
@group(0) @binding(4) var<storage, read> id: array<u32>;
// Velocities, and behind them the displacements.
@group(0) @binding(5) var<storage, read_write> carried: array<Vector>;
// Three floats per particle, and behind those of all particles, 1 for each isolated droplet.
@group(0) @binding(6) var<storage, read> sorted_velocity: array<f32>;
#ifdef PLACES
#import "shared/place.wgsl"
@group(0) @binding(7) var<storage, read> place: array<u32>;
#endif

// Fraction of the missing distance that each of a pair moves.
const SHARE = 0.25;
// Largest displacement in a substep, as a fraction of the target distance.
const MOST = 0.25;

// From j to x, or to its nearest periodic image.
fn way_from(j: u32, x: vec3f) -> vec3f {
    let way = x - three(sorted_position[j]);
#ifdef PERIODIC
    let size = vec3f(params.cells) * params.cell_size;
    return select(way, way - size * round(way / size), is_periodic());
#else
    return way;
#endif
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i >= params.particle_count {
        return;
    }
    let x = three(sorted_position[i]);
    let p = clamp(x * params.inverse_cell_size, vec3f(0.0), vec3f(params.cells));
    let cell = vec3i(cell_of_place(p));
    find_slots(cell);
    // The target distance is below half a cell: closer particles lie in one of eight cells.
    let side = select(vec3i(1), vec3i(-1), p - vec3f(cell) < vec3f(0.5));
    let own = id[params.particle_count + i];
    let apart = params.apart;
    let of_walls = params.apart_from_walls;
    // Uses the walls at the substep's start, when the particles are at these positions. With the
    // walls at its end, water in front of an approaching wall left a gap.
    var push = max(of_walls - 2.0 * (x - params.cut_min * params.cell_size), vec3f(0.0))
        - max(of_walls - 2.0 * (params.cut_max * params.cell_size - x), vec3f(0.0));
    // An isolated droplet may rest as close to a wall as it can: if pushed off, it would fall again
    // in each step.
    let is_drop = sorted_velocity[3u * params.particle_count + i] > 0.0;
    push = select(push, vec3f(0.0), is_drop);
#ifdef PERIODIC
    push = select(push, vec3f(0.0), is_periodic());
#endif
#ifdef PLACES
    let own_place = place[i];
    let reach = apart * params.inverse_cell_size * STEPS + UNSURE;
#endif
    for (var k = 0u; k < 8u; k++) {
        let element = element_at(side * vec3i(vec3u(k & 1u, (k >> 1u) & 1u, k >> 2u)));
        let is_wet = element >= CELLS && element < params.wet_cells + CELLS;
        let end = select(0u, cell_start[element + 1u], is_wet);
        for (var base = select(0u, cell_start[element], is_wet); base < end; base += 32u) {
            // First finds candidates as bits: llvmpipe runs the body of a branch for every
            // candidate.
            let stop = min(base + 32u, end);
            var found = 0u;
            var bit = 1u;
            for (var j = base; j < stop; j++) {
#ifdef PLACES
                let is_near = square_between(own_place, place[j]) < reach * reach;
#else
                let way = way_from(j, x);
                let is_near = dot(way, way) < apart * apart;
#endif
                found |= select(0u, bit, is_near && j != i);
                bit <<= 1u;
            }
            for (; found != 0u; found &= found - 1u) {
                let j = base + firstTrailingBit(found);
                let way = way_from(j, x);
                let square = dot(way, way);
                let distance = sqrt(square);
                let other = id[params.particle_count + j];
                let direction = select(
                    way / max(distance, 1e-20), pair_direction(own, other), square == 0.0);
                push += max(apart - distance, 0.0) * direction;
            }
        }
    }
    push *= SHARE;
    push *= min(1.0, MOST * apart / max(length(push), 1e-20));
    let own_push = params.particle_count + i;
    carried[own_push] = packed(three(carried[own_push]) + push);
}
