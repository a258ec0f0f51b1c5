// Boxes of cells where water enters; mirrored by `Inlets` of solve/params.rs.
struct Inlets {
    count: u32,
    unused: u32,
    padding: vec2u,
    // First and last cell of each box; the fourth component is unused.
    low: array<vec4u, 8>,
    high: array<vec4u, 8>,
    // Rate at which excess water flows out, 1/s, in the first component.
    rate: array<vec4f, 8>,
}
@group(0) @binding(7) var<uniform> inlets: Inlets;

// Outflow rate of the box that contains the cell, 1/s; 0 outside all boxes.
fn rate_in_inlet(cell: vec3u) -> f32 {
    var rate = 0.0;
    for (var k = 0u; k < inlets.count; k++) {
        let is_in = all(cell >= inlets.low[k].xyz) && all(cell <= inlets.high[k].xyz);
        rate = max(rate, select(0.0, inlets.rate[k].x, is_in));
    }
    return rate;
}
