// Spreads the light between four neighbouring rays of the sun over the map: over the quad between
// their landing points or, where the rays separate, a quarter of it around each of them. Light is
// conserved.
#import "shared/caustics.wgsl"
#import "shared/caustics_sums.wgsl"

@group(0) @binding(0) var<uniform> caustics: Caustics;
@group(0) @binding(1) var<storage, read> sun_hits: array<vec4f>;
@group(0) @binding(2) var<storage, read_write> light_sums: array<atomic<u32>>;

// Distance of landing points, relative to that in flat water, from which rays count as separated.
const PARTED: f32 = 6.0;
// Largest number of points along each side of a quad.
const MOST_POINTS: f32 = 32.0;

// Distributes light at a position to the four surrounding texels.
fn add_light(place: vec2f, light: f32, layer: u32) {
    let q = place - 0.5;
    let low = floor(q);
    let part = q - low;
    for (var k = 0u; k < 4u; k++) {
        let bit = vec2u(k & 1u, k >> 1u);
        let texel = vec2i(low) + vec2i(bit);
        let along = select(1.0 - part, part, bit == vec2u(1u));
        if all(texel >= vec2i(0)) && all(texel < vec2i(caustics.size)) {
            let at = (layer * caustics.size.y + u32(texel.y)) * caustics.size.x + u32(texel.x);
            atomicAdd(&light_sums[at], u32(light * along.x * along.y * LIGHT_SCALE + 0.5));
        }
    }
}

fn longest(a: vec2f, b: vec2f) -> f32 {
    let most = max(abs(a), abs(b));
    return max(most.x, most.y);
}

// Adds the light of a quad with corners (0, 0), (1, 0), (0, 1), (1, 1) and their light.
fn add_quad(corners: array<vec2f, 4>, lights: vec4f, layer: u32) {
    // Two points per texel along each side, so that evenly lit ground is even to a thousandth.
    let across = longest(corners[1] - corners[0], corners[3] - corners[2]);
    let up = longest(corners[2] - corners[0], corners[3] - corners[1]);
    let points = clamp(ceil(2.0 * vec2f(across, up) - 1e-3), vec2f(1.0), vec2f(MOST_POINTS));
    let share = 1.0 / (points.x * points.y);
    for (var j = 0.0; j < points.y; j += 1.0) {
        for (var i = 0.0; i < points.x; i += 1.0) {
            let at = (vec2f(i, j) + 0.5) / points;
            let low = mix(corners[0], corners[1], at.x);
            let high = mix(corners[2], corners[3], at.x);
            let light = mix(mix(lights.x, lights.y, at.x), mix(lights.z, lights.w, at.x), at.y);
            add_light(mix(low, high, at.y), light * share, layer);
        }
    }
}

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy + 1u >= caustics.rays) {
        return;
    }
    let at = id.y * caustics.rays.x + id.x;
    let hits = array<vec4f, 4>(
        sun_hits[at], sun_hits[at + 1u], sun_hits[at + caustics.rays.x],
        sun_hits[at + caustics.rays.x + 1u]);
    // Texels between rays in flat water, and the light of the quad in units of a texel's.
    let edge = caustics.step / caustics.texel;
    let lights = vec4f(hits[0].z, hits[1].z, hits[2].z, hits[3].z) * edge.x * edge.y;
    let layers = vec4f(hits[0].w, hits[1].w, hits[2].w, hits[3].w);
    let apart = max(
        max(longest(hits[1].xy - hits[0].xy, hits[3].xy - hits[2].xy),
            longest(hits[2].xy - hits[0].xy, hits[3].xy - hits[1].xy)),
        longest(hits[3].xy - hits[0].xy, hits[2].xy - hits[1].xy) * 0.5);
    let is_whole = all(lights > vec4f(0.0)) && all(layers == vec4f(layers.x))
        && apart < PARTED * max(edge.x, edge.y);
    let count = select(4u, 1u, is_whole);
    for (var k = 0u; k < count; k++) {
        var corners = array<vec2f, 4>(hits[0].xy, hits[1].xy, hits[2].xy, hits[3].xy);
        var own = lights;
        if !is_whole {
            let middle = hits[k].xy;
            let half_edge = 0.25 * edge;
            corners = array<vec2f, 4>(
                middle - half_edge, middle + vec2f(half_edge.x, -half_edge.y),
                middle + vec2f(-half_edge.x, half_edge.y), middle + half_edge);
            own = vec4f(0.25 * lights[k]);
        }
        if own.x > 0.0 {
            add_quad(corners, own, u32(layers[k]));
        }
    }
}
