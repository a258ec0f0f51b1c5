// Finds the cells of water and the distance to the surface. A cell is water if the density at its
// centre is at least half that of full water, the value at a surface through the centre. The
// presence of particles does not decide: a full cell may have none for a moment, for example beside
// a moving wall, and as air it would drain all of the water's pressure; and isolated droplets have
// no pressure.
//
// A cell whose centre lies inside a wall is judged by the density before it, continued. A cell cut
// by solids is judged by the volume that they leave open, and a film on a floor that passes above
// the centre is water too: where water runs up a slope, or rests on it, its edge lies in cells
// whose centres are inside the slope. As air, they could not support the water or keep it apart.
#import "shared/thread.wgsl"
#import "shared/flip_neighborhood.wgsl"
#import "shared/flip_buried.wgsl"

@group(0) @binding(2) var<storage, read> density: array<f32>;
@group(0) @binding(3) var<storage, read> face_open: array<f32>;
@group(0) @binding(4) var<storage, read_write> cell_kind: array<u32>;
#ifdef GHOST_FLUID
// Metres, negative in water.
@group(0) @binding(5) var<storage, read_write> liquid_distance: array<f32>;
#endif

#ifdef SOLIDS
@group(0) @binding(6) var<storage, read> open_hats: array<f32>;
@group(0) @binding(7) var<storage, read> open_layers: array<vec2u>;
#endif

const AIR = 0u;
const FLUID = 1u;
const SOLID = 2u;

// Least distance of the surface from the centre of a cell of water, in cells. It determines the
// pressure in the cell, so all directions towards air have to use the same distance: with a lower
// bound on θ per direction instead, water whose surface passes a cell centre was pushed sideways by
// up to half of gravity.
const LEAST_DEPTH = 0.02;

// Density where walls and solids contain a cell's centre. Walls: continued from the two cells
// inward of them, so that the surface keeps its slope. A wall that accelerates inclines it; if it
// were level there, its distance would contradict the pressure's slope, and water at the wall would
// be thrown up. It rises by at most what the second cell holds and falls by at most what that
// lacks: a film along the wall stays a film. Otherwise, or if the centre inward is inside too: the
// mean over the cell's faces to other cells, weighted by their open fractions.
fn density_before(element: u32, cell: vec3f) -> f32 {
    let is_thin = open_extent(cell) < vec3f(HALF);
    let inward = select(vec3i(0), select(vec3i(-1), vec3i(1), !is_plane_open(cell)), is_thin);
    let there = element_at(inward);
    if any(is_thin) && !is_buried(there, cell + vec3f(inward)) {
        let further = element_at(2 * inward);
        let near = clamp(density[there], 0.0, 1.0);
        let far = clamp(density[further], 0.0, 1.0);
        let sloped = near + clamp(near - far, far - 1.0, far);
        let has_second = further >= CELLS && !is_buried(further, cell + 2.0 * vec3f(inward));
        return select(density[there], sloped, has_second);
    }
    var sum = 0.0;
    var weights = 0.0;
    for (var k = 0u; k < 6u; k++) {
        let axis = k >> 1u;
        var step = vec3i(0);
        step[axis] = 2 * i32(k & 1u) - 1;
        let other = element_at(step);
        let open = face_open[axis * params.stride + select(element, other, (k & 1u) == 1u)];
        let weight = select(open, 0.0, other < CELLS || is_buried(other, cell + vec3f(step)));
        sum += weight * density[other];
        weights += weight;
    }
    return select(density[element], sum / weights, weights > 0.0);
}

#ifdef SOLIDS
// Lower bound for a cell's open fraction of the hat function.
const LEAST_ROOM = 0.02;

// Least fraction of its open volume that a film fills.
const LEAST_FILM = 0.1;

// Least open fraction, over all faces together, through which a gap fills from beside it.
const LEAST_OPEN = 0.02;

// Water at a centre relative to the open volume there. If the centre is inside a solid, the small
// open volume may hold no particle for a while, or one too many, so that cells beyond the open
// faces count as well. A gap closed above is as full as the cells beside it, the mean over its open
// faces: particles, at their distance from solids, may not fit into it, and as air, without
// pressure, it would draw in the water around it without end.
fn share_of_room(element: u32) -> f32 {
    let room = open_hats[element];
    let up = -params.velocity_step;
    var is_roofed = room < 0.5 && dot(up, up) > 0.0;
    // Sums over the open faces beside: open fraction times density, and open fraction.
    var beside = vec2f(0.0);
    var water = density[element] * max(room, params.particle_share);
    var rooms = max(room, LEAST_ROOM);
    let own = water / rooms;
    for (var k = 0u; k < select(0u, 6u, room < 0.5); k++) {
        let axis = k >> 1u;
        var step = vec3i(0);
        step[axis] = 2 * i32(k & 1u) - 1;
        let other = element_at(step);
        let face = axis * params.stride + select(element, other, (k & 1u) == 1u);
        let open = select(0.0, face_open[face], other >= CELLS);
        // Faces up to 60° off the direction are above, others beside or below. No brick is air.
        let upward = dot(vec3f(step), up);
        let is_beside = abs(upward) <= 0.5 * length(up);
        is_roofed &= upward <= 0.5 * length(up) || (other >= CELLS && open == 0.0);
        beside += select(0.0, open, is_beside) * vec2f(density[other], 1.0);
        water += open * density[other] * max(open_hats[other], params.particle_share);
        rooms += open * open_hats[other];
    }
    let is_fed = is_roofed && beside.y >= LEAST_OPEN;
    return max(max(own, water / rooms), select(0.0, beside.x / max(beside.y, 1e-6), is_fed));
}

// Integrals of the hat function over its four layers.
const LAYERS = vec4f(0.125, 0.375, 0.375, 0.125);

// Fraction of the hat function at the centre that lies below a level surface, solids included;
// `of_room` is that fraction of the open part. Water fills the open part layer by layer, from the
// lowest up: beside a solid that leans over it, or that it leans on, the surface is where the open
// volume below it holds the water. Within a layer, the part of a solid counts like the open part if
// it is a wall; like the layer below if it is a floor; like the layer above if it is a ceiling.
fn below_surface(element: u32, of_room: f32) -> f32 {
    let room = open_hats[element];
    let up = -params.velocity_step;
    if room <= LEAST_ROOM || dot(up, up) == 0.0 {
        return of_room;
    }
    var to_open = vec3f(0.0);
    for (var axis = 0u; axis < 3u; axis++) {
        var step = vec3i(0);
        step[axis] = 1;
        let after = element_at(step);
        let before = element_at(-step);
        to_open[axis] = select(open_hats[after], room, after < CELLS)
            - select(open_hats[before], room, before < CELLS);
    }
    let along = dot(to_open, up);
    let level = along * along / max(dot(to_open, to_open) * dot(up, up), 1e-30);
    let packed = open_layers[element];
    let open = vec4f(unpack2x16unorm(packed.x), unpack2x16unorm(packed.y));
    let shares = LAYERS * open;
    var left = of_room * dot(shares, vec4f(1.0));
    var filled = vec4f(0.0);
    for (var k = 0u; k < 4u; k++) {
        filled[k] = clamp(left / (LAYERS[k] * max(open[k], LEAST_ROOM)), 0.0, 1.0);
        left = max(left - shares[k], 0.0);
    }
    let above = vec4f(filled.yzw, 0.0);
    var beneath = 1.0;
    var below = 0.0;
    for (var k = 0u; k < 4u; k++) {
        let beside = select(above[k], beneath, along > 0.0);
        // Not `mix`, for which drivers compute x + a (y - x): a result near 0 then errs by a
        // rounding of x, and the distance to the surface by the square root of that.
        let of_solid = filled[k] * (1.0 - level) + beside * level;
        beneath = of_solid * (1.0 - open[k]) + filled[k] * open[k];
        below += LAYERS[k] * beneath;
    }
    return below;
}
#endif

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
    let cell = vec3f(own_cell(element));
    var share = density[element];
    let is_in_wall = any(open_extent(cell) < vec3f(HALF));
    for (var once = 0; once < select(0, 1, is_in_wall); once++) {
        open_neighborhood(element);
        share = density_before(element, cell);
    }
    var below = clamp(share, 0.0, 1.0);
    var is_film = false;
#ifdef SOLIDS
    for (var once = 0; once < select(0, 1, open_hats[element] < 1.0); once++) {
        open_neighborhood(element);
        share = select(share_of_room(element), share, is_in_wall);
        below = below_surface(element, clamp(share, 0.0, 1.0));
        is_film = share > LEAST_FILM && below >= 0.5;
    }
#endif
    // Water lies in bricks that hold particles, or next to a wall beside them.
    let is_water = (share >= 0.5 || is_film) && thread < params.wet_cells;
    let is_open = cell_kind[element] != SOLID;
    cell_kind[element] = select(SOLID, select(AIR, FLUID, is_water), is_open);
#ifdef GHOST_FLUID
    // Across a flat surface the density is 1/2 at the surface, and falls as s - s²/2 with the
    // distance s in cells. If a dry floor passes above the centre of an air cell, the surface is
    // the floor: the distance is negative, as in water.
    let off = below - 0.5;
    let inside = sign(off) * (1.0 - sqrt(max(1.0 - 2.0 * abs(off), 0.0)));
    let depth = select(inside, max(inside, LEAST_DEPTH), is_water);
    liquid_distance[element] = -depth * params.cell_size;
#endif
}
