// Differences of q across the lower faces of a block's cells.
#import "shared/pressure_site.wgsl"

@group(0) @binding(2) var<storage, read> pressure_solution: array<real>;
@group(0) @binding(3) var<storage, read> cell_kind: array<u32>;
@group(0) @binding(4) var<storage, read> face_open: array<f32>;
#ifdef GHOST_FLUID
@group(0) @binding(5) var<storage, read> liquid_distance: array<f32>;
#endif

const AIR = 0u;
const FLUID = 1u;
const LEAST_THETA = 0.01;
const MOST_THETA = 100.0;

// Whether a slot holds water; other slots have no q.
fn is_wet(slot: u32) -> bool {
    let range = phase.levels[0];
    return slot - range.x < range.y;
}

// Element of q of cell `c` of a block; in slot 0 if the brick is dry.
fn q_element(slot: u32, block: u32, c: u32) -> u32 {
    return select(0u, blocked(slot, block) + 64u * c, is_wet(slot));
}

struct Face {
    // Element in a plane of faces.
    element: u32,
    // Whether water may flow through it.
    is_open: bool,
    // q of its cell − q of the cell before it, divided by θ at the surface.
    difference: real,
}

// Lower face of cell `c` along `axis`.
fn face_at(s: Site, c: u32, axis: u32) -> Face {
    let own = natural(s.slot, s.block) + (c & 1u) + 8u * ((c >> 1u) & 1u) + 64u * (c >> 2u);
    let bit = 1u << axis;
    let is_inside = (c & bit) != 0u;
    let slot = select(s.lower_slot[axis], s.slot, is_inside);
    let block = select(s.lower_block[axis], s.block, is_inside);
    let d = c ^ bit;
    let before = natural(slot, block) + (d & 1u) + 8u * ((d >> 1u) & 1u) + 64u * (d >> 2u);
    let kind = cell_kind[own];
    let kind_before = cell_kind[before];
    let is_open = (kind == FLUID && kind_before <= FLUID) || (kind_before == FLUID && kind == AIR);
    let q = q_element(s.slot, s.block, c);
    let q_before = q_element(slot, block, d);
    var difference = pressure_solution[q] - pressure_solution[q_before];
#ifdef TWO_WORDS
    // The difference of the small words, added after that of the large ones.
    difference += pressure_solution[phase.stride + q] - pressure_solution[phase.stride + q_before];
#endif
#ifdef GHOST_FLUID
    let phi = vec2<real>(vec2f(liquid_distance[own], liquid_distance[before]));
    let ordered = select(phi.yx, phi, kind == FLUID);
    let inside = max(-ordered.x, 0.0);
    let outside = ordered.y;
    let theta = select(MOST_THETA, inside / (inside + outside), inside + outside > 0.0);
    difference *= select(1.0, 1.0 / clamp(theta, LEAST_THETA, MOST_THETA), kind != kind_before);
#endif
    let element = axis * phase.stride + own;
    return Face(element, is_open && face_open[element] > 0.0, difference);
}
