// Foam of a whitewater stream as a layer on the water's surface: discs in columns over the level
// axes (render/foam.rs). Needs the bindings of cloud.wgsl and ssfr_light.wgsl.
#import "shared/cloud.wgsl"

// Least and greatest factor on the distances to a disc, by its random number: cells of different
// sizes, with edges that are arcs. Chosen by eye, as all constants here.
const NEARER: f32 = 0.6;
const FARTHER: f32 = 1.6;
// Part of the discs, by their random number, around which there are large holes.
const LARGE: f32 = 0.12;
// Numbers of discs within the kernel below which foam is drawn as its discs, and above which as
// threads between cells.
const FEW: vec2f = vec2f(2.0, 8.0);
// Part of its width over which a thread of foam becomes thin on either side of its edge.
const SOFT: f32 = 0.4;

// The two nearest discs of a mosaic of cells, and their number.
struct Cells {
    // Distances, in radii of the kernel.
    nearest: vec2f,
    // Discs per πR²/3 at these distances.
    count: f32,
}

fn with_disc(cells: Cells, far: f32, count: f32) -> Cells {
    let old = cells.nearest;
    let nearest = select(vec2f(old.x, min(old.y, far)), vec2f(far, old.x), far < old.x);
    return Cells(nearest, cells.count + count);
}

// Half the width of threads along the edges of a mosaic of Poisson–Voronoi cells that cover the
// fraction 1 − exp(−depth) of it, times √(π discs per area): the inverse of
// exp(−x²) − √π x erfc(x) = exp(−depth) within 0.5 % up to a depth of 15. The left side is the
// probability that of the two nearest of Poisson's points one is more than x farther than the
// other. It holds as well where each disc has a factor on its distances: they are those of a
// Poisson process again, of density Σ 1 / factor².
fn thread_width(depth: f32) -> f32 {
    return depth / (1.7724539 + 0.30484 * depth / sqrt(1.0 + 0.1394 * depth));
}

// Fraction covered by threads of a mosaic, 1 − exp(−depth) in the mean, over a footprint in radii
// of the kernel.
fn threads(cells: Cells, depth: f32, footprint: f32) -> f32 {
    // Discs per area times πR² is 3 Σ W.
    let density = sqrt(3.0 * cells.count);
    let half_width = thread_width(depth) / density;
    let blur = max(SOFT * half_width, footprint);
    let between = cells.nearest.y - cells.nearest.x;
    // A thread, blurred on both of its edges.
    let lace = smoothstep(-blur, blur, between + half_width)
        - smoothstep(-blur, blur, between - half_width);
    // Cells that a pixel does not resolve.
    return mix(lace, 1.0 - exp(-depth), smoothstep(0.15, 0.6, footprint * density));
}

// Radius of the kernel at a place along x and z, metres: linear between the columns' centres.
fn kernel_radius(place: vec2f) -> f32 {
    let last = vec2f(cloud.foam_columns - 1u);
    let at = clamp((place - cloud.foam_corner) / cloud.foam_edge - 0.5, vec2f(0.0), last);
    let low = min(floor(at), max(last - 1.0, vec2f(0.0)));
    let c = vec2u(low);
    let d = min(c + 1u, cloud.foam_columns - 1u);
    let wide = cloud.foam_columns.x;
    let radii = cloud.foam_start + wide * cloud.foam_columns.y + 1u;
    let near = bitcast<vec2f>(
        vec2u(cloud_words[radii + c.y * wide + c.x], cloud_words[radii + c.y * wide + d.x]));
    let far = bitcast<vec2f>(
        vec2u(cloud_words[radii + d.y * wide + c.x], cloud_words[radii + d.y * wide + d.x]));
    let across = mix(near, far, at.y - low.y);
    return mix(across.x, across.y, at.x - low.x);
}

// Fraction of the surface with normal `n` at `p` that foam covers, over a footprint in metres. Its
// mean is the coverage 1 − exp(−Σ πr² W) of the discs (domain/level_set/foam.rs). Where a pixel
// resolves them, it lies on the edges of two mosaics of cells around the discs, a fine one and a
// coarse one, which cover half of Σ πr² W each, or, where discs are few, on the discs themselves.
fn foam_cover(p: vec3f, n: vec3f, footprint: f32) -> f32 {
    if cloud.foam_columns.x == 0u {
        return 0.0;
    }
    let radius = kernel_radius(p.xz);
    let place = (p.xz - cloud.foam_corner) / cloud.foam_edge;
    let reach = radius / cloud.foam_edge;
    let low = max(vec2i(floor(place - reach)), vec2i(0));
    let high = min(vec2i(floor(place + reach)), vec2i(cloud.foam_columns) - 1);
    if any(low > high) {
        return 0.0;
    }
    let discs = cloud.foam_start + 2u * cloud.foam_columns.x * cloud.foam_columns.y + 1u;
    let blur = footprint / radius;
    // The discs' areas are in units of the largest kernel.
    let larger = cloud.foam_radius / radius;
    var depth = 0.0;
    // Number of discs within the kernel.
    var sites = 0.0;
    // What the discs themselves leave open.
    var bare = 1.0;
    var fine = Cells(vec2f(FAR), 0.0);
    var coarse = fine;
    for (var k = low.y; k <= high.y; k++) {
        let row = cloud.foam_start + u32(k) * cloud.foam_columns.x;
        let end = cloud_words[row + u32(high.x) + 1u];
        for (var i = cloud_words[row + u32(low.x)]; i < end; i++) {
            let at = discs + 4u * i;
            let centre = bitcast<vec3f>(
                vec3u(cloud_words[at], cloud_words[at + 1u], cloud_words[at + 2u]));
            let d = (centre - p) / radius;
            let beside = dot(d, n);
            let along = max(dot(d, d) - beside * beside, 0.0);
            let s = 1.0 - along;
            // In largest radii, whatever the kernel's own is.
            let off = beside / larger;
            if s <= 0.0 || abs(off) >= 1.0 {
                continue;
            }
            let word = cloud_words[at + 3u];
            let mirrored = vec3f((vec3u(word) >> vec3u(16u, 17u, 18u)) & vec3u(1u));
            let across = 1.0 - mirrored * n * n;
            let weight = s * s * (1.0 - smoothstep(0.5, 1.0, abs(off)))
                * across.x * across.y * across.z;
            let random = f32(word >> 24u) / 255.0;
            let grown = max(f32(word >> 19u & 31u) / 31.0, 1e-2);
            // Three times the square of the disc's radius.
            let area = grown * grown * larger * larger * cloud_value(at + 3u, 0u);
            depth += weight * area;
            sites += 3.0 * weight;
            // Discs smaller than the footprint become fainter instead.
            let size = max(sqrt(area / 3.0), blur);
            bare *= 1.0 - area / (3.0 * size * size)
                * (1.0 - smoothstep(1.0 - SOFT, 1.0 + SOFT, sqrt(along) / size));
            let factor = mix(NEARER, FARTHER, fract(random / LARGE)) / grown;
            let far = factor * sqrt(along);
            fine = with_disc(fine, far, weight / (factor * factor));
            if random < LARGE {
                coarse = with_disc(coarse, far, weight / (factor * factor));
            }
        }
    }
    if depth <= 0.0 {
        return 0.0;
    }
    var open = 1.0;
    if coarse.count > 0.0 {
        depth *= 0.5;
        open = 1.0 - threads(coarse, depth, blur);
    }
    open *= 1.0 - threads(fine, depth, blur);
    return 1.0 - mix(bare, open, smoothstep(FEW.x, FEW.y, sites));
}

// Radiance of foam at `p` on a surface whose normal points into the air: a Lambertian white layer,
// seen from the air or, as what it lets through, from below.
fn foam_radiance(p: vec3f, n: vec3f, from_below: bool) -> vec3f {
    let facing = max(dot(n, shading.sun_direction), 0.0);
    let light = shading.sun_irradiance * facing * sunlit(p, n) + sky_irradiance(n);
    return light / PI * select(cloud.foam_albedo, 1.0 - cloud.foam_albedo, from_below);
}
