// What a viscous solve knows of a cell, in a word: whether it is water; which of its lower faces move and whether water stands on
// both sides of them; and of the edges through its least corner, by the axis that they lie along, how many of the four cells about
// one are water and by what its two pairs of velocities count.
const WATER = 1u;
// From here a bit a face.
const MOVED = 1u;
const WHOLE = 4u;
// From here seven bits an edge.
const EDGES = 7u;
const EDGE_BITS = 7u;

struct Edge {
    // Part of the edge's water.
    part: f32,
    // Weights of the pair that lies along the axis after the edge's own, and of the other.
    weight: vec2f,
}

fn edge_of(word: u32, axis: u32) -> Edge {
    let bits = word >> (EDGES + EDGE_BITS * axis);
    return Edge(0.25 * f32(bits & 7u), vec2f(f32((bits >> 3u) & 3u), f32((bits >> 5u) & 3u)));
}
