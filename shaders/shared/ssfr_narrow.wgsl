// What the narrow-range filter (Truong and Yuksel 2018) makes of two samples on either side of a centre; depths here are positive, so
// the paper's inequalities are turned round. Needs the bindings `params`, `source` and `solid_depth` of whoever imports it.
#import "shared/camera.wgsl"

struct NarrowParams {
    // Standard deviation, metres in the world.
    width: f32,
    // Half of the range that counts as one surface (δ).
    range: f32,
    // How far behind the centre a sample beyond the range is placed (μ).
    offset: f32,
    // 0 along x, 1 along y.
    axis: u32,
}

// What counts as one surface, metres before and behind the centre.
struct NarrowRange {
    near: f32,
    far: f32,
}

struct NarrowPair {
    // 1, or 0 where the two are dropped.
    weight: f32,
    // Sum of 1/z of both: in it a plane seen at a slant is straight and stays where it is.
    inverse: f32,
}

// Standard deviation of the weights of the last pass, pixels, where the filter is that wide; over narrower ones it has half of theirs.
const CLEAN_SIGMA: f32 = 1.5;
// Their variance over that of a whole Gaussian: weights end three pixels from the centre.
const CLEAN_VARIANCE: f32 = 0.881;

fn clean_sigma(wide: f32) -> f32 {
    return min(CLEAN_SIGMA, 0.5 * wide);
}

// Standard deviation of the passes along the axes, so that all three together are `wide` pixels wide: variances add.
fn axis_sigma(wide: f32) -> f32 {
    let clean = clean_sigma(wide);
    return sqrt(wide * wide - CLEAN_VARIANCE * clean * clean);
}

// Whether a pixel shows no water because something solid stands there, before the water or in it: what is behind, nobody knows.
fn is_hidden(at: i32, z: f32, far: f32) -> bool {
    return source[at] >= FAR && solid_depth[at] <= z + far;
}

fn narrow_pair(range: ptr<function, NarrowRange>, at_a: i32, at_b: i32, z: f32) -> NarrowPair {
    var a = source[at_a];
    var b = source[at_b];
    // Something else stands in front: it goes, and its mirror with it.
    if min(a, b) < z - (*range).near || is_hidden(at_a, z, (*range).far) || is_hidden(at_b, z, (*range).far) {
        return NarrowPair(0.0, 0.0);
    }
    let in_a = a <= z + (*range).far;
    let in_b = b <= z + (*range).far;
    // The range widens with what was accepted.
    if in_a && in_b {
        (*range).near = max((*range).near, z - min(a, b) + params.range);
        (*range).far = max((*range).far, max(a, b) - z + params.range);
    }
    a = select(z + params.offset, a, in_a);
    b = select(z + params.offset, b, in_b);
    return NarrowPair(1.0, 1.0 / a + 1.0 / b);
}
