// Colours and textures of solids. The importing shader must bind `camera`, `set_triangles`,
// `materials` and `solid_texels`.

struct Material {
    colour: vec3f,
    // 1 where the material may have rows of windows.
    windows: f32,
    // Texture: index of the first texel in `solid_texels`, counted row by row, and size in texels.
    first: u32,
    size_x: u32,
    size_y: u32,
    // Number of mip levels including the picture itself; 0 without a texture.
    levels: u32,
}

// Largest number of taps along the longer side of a footprint.
const MOST_TAPS: f32 = 8.0;

// Linear texel from the sequence of all pictures and their mip levels. The texture's rows have a
// power of two of texels, because division takes longer than everything else on adapters that
// divide lane by lane.
fn solid_texel(index: u32) -> vec3f {
    let across = textureDimensions(solid_texels).x;
    let place = vec2u(index & (across - 1u), index >> firstTrailingBit(across));
    return textureLoad(solid_texels, place, 0).rgb;
}

// Bilinear lookup in a repeating mip level; `at` is in pictures, with rows from the top.
fn level_at(first: u32, size: vec2u, at: vec2f) -> vec3f {
    let p = fract(at) * vec2f(size) - 0.5;
    let low = floor(p);
    let part = p - low;
    // `low` may be -1.
    let a = select(vec2u(low), size - 1u, low < vec2f(0.0));
    let b = select(a + 1u, vec2u(0u), a + 1u >= size);
    let above = mix(
        solid_texel(first + a.y * size.x + a.x), solid_texel(first + a.y * size.x + b.x), part.x);
    let below = mix(
        solid_texel(first + b.y * size.x + a.x), solid_texel(first + b.y * size.x + b.x), part.x);
    return mix(above, below, part.y);
}

// Two successive mip levels: their offsets and sizes, and the interpolation weight of the second
// one.
struct Levels {
    first: u32,
    size: vec2u,
    next: u32,
    next_size: vec2u,
    part: f32,
}

// Levels for texels about `width` texels of the picture wide (Williams 1983).
fn levels_for(material: Material, width: f32) -> Levels {
    let level = clamp(log2(max(width, 1.0)), 0.0, f32(material.levels - 1u));
    var first = material.first;
    var size = vec2u(material.size_x, material.size_y);
    for (var k = 0u; k < u32(level); k++) {
        first += size.x * size.y;
        size = max(size / 2u, vec2u(1u));
    }
    return Levels(first, size, first + size.x * size.y, max(size / 2u, vec2u(1u)), fract(level));
}

// Number of samples from which each one reads a single level; the share of samples that read the
// second one equals its weight.
const SHARED: u32 = 4u;

// The loop also tests its condition at the end, as in ssfr/shade.
fn picture_at(levels: Levels, at: vec2f) -> vec3f {
    // A single level suffices where the weight is 0. This test also keeps lavapipe from compiling
    // the pass again for each sample (docs/performance.md).
    let count = select(2u, 1u, sample_count(camera) >= SHARED || levels.part == 0.0);
    let share = fract((f32(camera.sample_index) + 0.5) * 0.618034);
    var sum = vec3f(0.0);
    for (var k = 0u; k < count; k++) {
        var is_next = k == 1u;
        var part = select(1.0 - levels.part, levels.part, is_next);
        if count == 1u {
            is_next = share < levels.part;
            part = 1.0;
        }
        sum += part * level_at(
            select(levels.first, levels.next, is_next),
            select(levels.size, levels.next_size, is_next), at);
        if k + 1u == count {
            break;
        }
    }
    return sum;
}

// Number of a triangle's material, from 1; 0 for the look's own colour.
fn paint_of(triangle: u32) -> u32 {
    if triangle == NO_TRIANGLE {
        return 0u;
    }
    return set_triangles[triangle].paint;
}

// Reflectance of a textured triangle at `p`. A pixel's footprint there is `footprint` wide across
// the line of sight and elongated along it on slanted faces, where several taps are averaged.
fn painted(triangle: u32, p: vec3f, n: vec3f, view: vec3f, footprint: f32) -> vec3f {
    let face = set_triangles[triangle];
    let material = materials[face.paint - 1u];
    if material.levels == 0u {
        return material.colour;
    }
    // Texture mapping: `a` and `b` are the gradients of the two coordinates, whose values at `c`
    // are the words beside them.
    let lie = set_triangles[face.place];
    let from_c = p - lie.c;
    let at = vec2f(
        bitcast<f32>(lie.material) + dot(lie.a, from_c),
        bitcast<f32>(lie.paint) + dot(lie.b, from_c));
    let size = vec2f(vec2u(material.size_x, material.size_y));
    let facing = dot(view, n);
    let slant = view - n * facing;
    var along = cross(n, select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(n.x) > 0.5));
    if dot(slant, slant) > 1e-6 {
        along = slant;
    }
    along = normalize(along);
    let across = cross(n, along) * footprint;
    along *= footprint / max(abs(facing), 0.02);
    var long = vec2f(dot(lie.a, along), dot(lie.b, along));
    var short = vec2f(dot(lie.a, across), dot(lie.b, across));
    if length(short * size) > length(long * size) {
        let other = long;
        long = short;
        short = other;
    }
    let length_of = length(long * size);
    let taps = clamp(ceil(length_of / max(length(short * size), 1.0)), 1.0, MOST_TAPS);
    let width = max(length(short * size), length_of / taps);
    let levels = levels_for(material, width);
    // The samples divide the taps among themselves, interleaved.
    let samples = f32(sample_count(camera));
    let own = ceil(taps / samples);
    let part = (f32(camera.sample_index) + 0.5) / samples;
    var sum = vec3f(0.0);
    for (var k = 0.0; k < own; k += 1.0) {
        sum += picture_at(levels, at + long * ((k + part) / own - 0.5));
        if k + 1.0 >= own {
            break;
        }
    }
    return material.colour * sum / own;
}
