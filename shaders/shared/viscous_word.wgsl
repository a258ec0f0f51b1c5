// Bit field of a cell for the viscous solve: whether it is water; which of its lower faces move,
// and which have water on both sides; and for each of the three edges through its minimum corner,
// by the axis of the edge, how many of the four cells around the edge are water, and the weights of
// its two pairs of velocities.
const WATER = 1u;
// One bit per face from here.
const MOVED = 1u;
const WHOLE = 4u;
// Seven bits per edge from here.
const EDGES = 7u;
const EDGE_BITS = 7u;

struct Edge {
    // Water fraction of the four cells around the edge.
    part: f32,
    // Weights of the pair along the axis after the edge's own, and of the other pair.
    weight: vec2f,
}

fn edge_of(word: u32, axis: u32) -> Edge {
    let bits = word >> (EDGES + EDGE_BITS * axis);
    return Edge(0.25 * f32(bits & 7u), vec2f(f32((bits >> 3u) & 3u), f32((bits >> 5u) & 3u)));
}
