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

// Integral of the hat function over the volume outside solids, relative to that outside walls only,
// sampled over 4³ half cells, each cut by a plane. If particles are mirrored at walls, so are
// solids. `rise` is the growth of the distance over a cell, summed over x, y and z, metres;
// `solids` has the bit k % 32 for each solid k that comes close enough.
fn open_part_of_hat(cell: vec3f, rise: f32, solids: u32) -> f32 {
    let width = max(0.5 * rise, 1e-20);
    let skin = 1e-4 * params.cell_size;
#ifdef CORRECTION
    let is_mirrored = (cell + 0.5 >= params.cut_min) & (cell + 0.5 <= params.cut_max);
#endif
    var open = 0.0;
    var all = 0.0;
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
        all += weight;
        open += weight * clamp(0.5 + distance / width, 0.0, 1.0);
    }
    return select(1.0, open / all, all > 0.0);
}
