// Gaps that close within the substep, for example under a slab of water that falls on a floor. Air
// has no pressure: the water would penetrate what lies beyond the gap by its displacement in a
// substep and be compressed there, and the density correction would lift it again. The cells of
// such a gap count as water with the divergence that fills them, so that the projection stops the
// water at the end of the gap.
//
// A surface that water is about to hit moves on with it: near a cell's centre, where the pressure
// is 0, it would let all inflow out through the faces towards air, at a speed that grows without
// bound as θ and the substep shrink. Such a cell counts as full, in proportion to its least open
// face: beside a wall that would stop a whole cell of water at once where part of one arrives.
#import "shared/thread.wgsl"
#import "shared/flip_neighborhood.wgsl"
#import "shared/flip_buried.wgsl"

@group(0) @binding(2) var<storage, read> density: array<f32>;
@group(0) @binding(3) var<storage, read> face_open: array<f32>;
@group(0) @binding(4) var<storage, read> face_velocity: array<f32>;
@group(0) @binding(5) var<storage, read_write> cell_kind: array<u32>;
@group(0) @binding(6) var<storage, read_write> solid_flux: array<f32>;
#ifdef MOVING_SOLIDS
@group(0) @binding(8) var<storage, read> closed_velocity: array<f32>;
#endif
#ifdef GHOST_FLUID
@group(0) @binding(7) var<storage, read_write> liquid_distance: array<f32>;
#endif

const AIR = 0u;
const FLUID = 1u;

// Most cells of a gap: the reach of the neighbourhood's elements.
const MOST_GAP = 4;

// A gap closes if its ends approach by more than this fraction of it.
const CLOSES = 0.75;

// They must also approach by more than this fraction of a cell: the density correction handles
// less.
const LEAST_CLOSING = 0.25;

// A face with a smaller open fraction ends a gap: all the water that fills the gap would have to
// pass it.
const LEAST_WAY = 0.5;

const OPEN = 0u;
const WATER = 1u;
const CLOSED = 2u;
const UNKNOWN = 3u;

struct End {
    kind: u32,
    // m/s, along the axis.
    velocity: f32,
    // Number of air cells up to the end, and the volume that all of them lack, in cells.
    cells: i32,
    gap: f32,
    // Volume that the water beside the cell lacks, in cells.
    beside: f32,
}

// Volume that a cell lacks, per area across the axis, in cells.
fn lack_of(element: u32, cell: vec3f, axis: u32) -> f32 {
    let extent = open_extent(cell);
    var room = extent[axis];
#ifdef SOLIDS
    room = min(open_volume[element] * room / max(extent.x * extent.y * extent.z, 1e-6), 1.0);
#endif
    return room * clamp(1.0 - density[element], 0.0, 1.0);
}

// Area of a cell's faces across an axis that walls leave open.
fn across(cell: vec3f, axis: u32) -> f32 {
    let extent = open_extent(cell);
    return extent[(axis + 1u) % 3u] * extent[(axis + 2u) % 3u];
}

fn end_of(cell: vec3f, axis: u32, side: i32) -> End {
    var end = End(OPEN, 0.0, 0, 0.0, 0.0);
    var step = vec3i(0);
    step[axis] = side;
    for (var k = 0; k < MOST_GAP && end.kind == OPEN; k++) {
        let here = element_at(k * step);
        let there = element_at((k + 1) * step);
        let is_there = there >= CELLS;
        let face = axis * params.stride + select(here, there, side > 0);
        let open = face_open[face];
        let is_closed = (side < 0 || is_there)
            && open < LEAST_WAY * across(cell + vec3f(k * step), axis);
        let is_water = density[there] >= 0.5;
        let lack = lack_of(there, cell + vec3f((k + 1) * step), axis);
        end.kind = select(
            select(select(OPEN, WATER, is_water), UNKNOWN, !is_there), CLOSED, is_closed);
        // On a partly closed face the velocity is that of the water.
#ifdef MOVING_SOLIDS
        let of_solid = closed_velocity[face];
#else
        let of_solid = 0.0;
#endif
        end.velocity = select(face_velocity[face], of_solid, is_closed && open > 0.0);
        end.cells += select(1, 0, is_closed || is_water);
        end.gap += select(lack, 0.0, is_closed);
        end.beside = select(end.beside, lack, is_water && !is_closed && k == 0);
    }
    return end;
}

// Volume of a cell that fills in this substep because the ends of a gap meet, in cells: the missing
// length times the area across; negative if no gap closes.
fn filled(element: u32, cell: vec3f) -> f32 {
    var most = -1.0;
    for (var axis = 0u; axis < 3u; axis++) {
        let own = lack_of(element, cell, axis);
        let low = end_of(cell, axis, -1);
        for (var once = 0; once < select(0, 1, low.kind == WATER || low.kind == CLOSED); once++) {
            let high = end_of(cell, axis, 1);
            let gap = own + low.gap + high.gap;
            let closing = (low.velocity - high.velocity) * params.time_step
                * params.inverse_cell_size;
            let is_held = high.kind == WATER || (high.kind == CLOSED && low.kind == WATER);
            let is_near = low.cells + high.cells < MOST_GAP;
            let closes = is_held && is_near && closing > max(CLOSES * gap, LEAST_CLOSING);
            let part = clamp(closing / max(gap, 1e-6), 0.0, 1.0);
            let lack = across(cell, axis) * (own + low.beside + high.beside);
            most = select(most, max(most, lack * part), closes);
        }
    }
    return most;
}

#ifdef GHOST_FLUID
// Inflow, in units of gravity's velocity change, from which a surface starts to count as that of a
// full cell; from twice as much it does. Water at rest on a floor has 1.
const LEAST_INFLOW = 2.0;

struct Hit {
    // Velocity that the projection has to stop, m/s: the right-hand side of the cell's row, before
    // inlets, wall friction and effects.
    inflow: f32,
    // Smallest open fraction of the cell's faces.
    open: f32,
}

fn hit(element: u32) -> Hit {
    var found = Hit(-solid_flux[element], 1.0);
    for (var axis = 0u; axis < 3u; axis++) {
        var step = vec3i(0);
        step[axis] = 1;
        let lower = axis * params.stride + element;
        let upper = axis * params.stride + element_at(step);
        found.inflow += face_open[lower] * face_velocity[lower];
        found.inflow -= face_open[upper] * face_velocity[upper];
        found.open = min(found.open, min(face_open[lower], face_open[upper]));
    }
    return found;
}

// Distance of the surface by which the projection finds the pressure in a cell of water.
fn hit_distance(element: u32) -> f32 {
    let own = liquid_distance[element];
    let found = hit(element);
    let least = LEAST_INFLOW * length(params.velocity_step);
    let part = select(0.0, clamp(found.inflow / least - 1.0, 0.0, 1.0), least > 0.0);
    return mix(own, min(own, -params.cell_size), part * found.open);
}
#endif

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
    let kind = cell_kind[element];
#ifdef GHOST_FLUID
    for (var once = 0; once < select(0, 1, kind == FLUID); once++) {
        open_neighborhood(element);
        liquid_distance[element] = hit_distance(element);
    }
#endif
    var most = -1.0;
    for (var once = 0; once < select(0, 1, kind == AIR); once++) {
        open_neighborhood(element);
        most = filled(element, vec3f(own_cell(element)));
    }
    if most >= 0.0 {
        cell_kind[element] = FLUID;
        solid_flux[element] += most * params.cell_size / params.time_step;
#ifdef GHOST_FLUID
        liquid_distance[element] = -params.cell_size;
#endif
    }
}
