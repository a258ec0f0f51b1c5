// Part of the hat function around a cell's centre that solids leave open.
#import "shared/flip_solid.wgsl"

// Distance to the nearest of the solids k whose bits k % 32 are set, metres.
fn nearest_distance(x: vec3f, solids: u32) -> f32 {
#ifdef MOVING_SOLIDS
    var least = 1e15;
    for (var left = solids; left != 0u; left &= left - 1u) {
        for (var k = firstTrailingBit(left); k < solid_count(); k += 32u) {
            look_at_solid(k, 0.0);
            least = min(least, solid_distance_at(x));
        }
    }
    return least;
#else
    return solid_distance_at(x);
#endif
}

// What solids leave open of the hat function around a cell's centre.
struct OpenHat {
    // Integral over the volume outside solids, relative to that outside walls only.
    part: f32,
    // The same for each of four layers, half a cell thick, from the lowest up.
    layers: vec4f,
}

// Samples 4³ half cells, each cut by a plane. If particles are mirrored at walls, so are solids.
// `rise` is the growth of the distance over a cell, summed over x, y and z, metres; `solids` has
// the bit k % 32 for each solid k that comes close enough. Layers are along the axis closest to
// gravity.
fn open_hat(cell: vec3f, rise: f32, solids: u32) -> OpenHat {
    let width = max(0.5 * rise, 1e-20);
    let skin = 1e-4 * params.cell_size;
    let steep = abs(params.velocity_step);
    let is_z = steep.z >= max(steep.x, steep.y);
    let axis = select(select(0u, 1u, steep.y >= steep.x), 2u, is_z);
    let is_down = params.velocity_step[axis] > 0.0;
#ifdef CORRECTION
    let is_mirrored = (cell + 0.5 >= params.cut_min) & (cell + 0.5 <= params.cut_max);
#endif
    var open = vec4f(0.0);
    var all = vec4f(0.0);
    for (var k = 0u; k < 64u; k++) {
        let way = 0.5 * vec3f(vec3u(k & 3u, (k >> 2u) & 3u, k >> 4u));
        var size = max(
            min(cell + way, params.cut_max) - max(cell - 0.5 + way, params.cut_min), vec3f(0.0));
        var place = cell - 0.25 + way;
#ifdef CORRECTION
        size = select(size, vec3f(0.5), is_mirrored);
        place = select(place, max(place, 2.0 * params.cut_min - place), is_mirrored);
        place = select(place, min(place, 2.0 * params.cut_max - place), is_mirrored);
#endif
        let hat = (1.0 - abs(way - 0.75)) * size;
        let weight = hat.x * hat.y * hat.z;
        let distance = nearest_distance(place * params.cell_size, solids) - skin;
        let half = (k >> (2u * axis)) & 3u;
        let layer = vec4u(0u, 1u, 2u, 3u) == vec4u(select(half, 3u - half, is_down));
        all += select(vec4f(0.0), vec4f(weight), layer);
        let part = weight * clamp(0.5 + distance / width, 0.0, 1.0);
        open += select(vec4f(0.0), vec4f(part), layer);
    }
    let whole = dot(all, vec4f(1.0));
    return OpenHat(
        select(1.0, dot(open, vec4f(1.0)) / whole, whole > 0.0),
        select(vec4f(1.0), open / all, all > vec4f(0.0)),
    );
}
