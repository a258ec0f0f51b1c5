// Sample pairs of the narrow-range filter (Truong and Yuksel 2018). Depths are positive here, so
// the paper's inequalities are reversed. The importing shader must bind `params`, `source` and
// `solid_depth`.
#import "shared/camera.wgsl"

struct NarrowParams {
    // Standard deviation, metres in the world.
    width: f32,
    // Half of the range that counts as one surface (δ), metres.
    range: f32,
    // Distance behind the centre at which a sample beyond the range is placed (μ), metres.
    offset: f32,
    // 0 along x, 1 along y.
    axis: u32,
}

// Range that counts as one surface, metres in front of and behind the centre.
struct NarrowRange {
    near: f32,
    far: f32,
}

struct NarrowPair {
    // 1, or 0 where the pair is dropped.
    weight: f32,
    // Sum of 1/z of both, in which a slanted plane is straight and stays in place.
    inverse: f32,
}

// Standard deviation of the weights of the last pass, pixels, at most half of the filter's.
const CLEAN_SIGMA: f32 = 1.5;
// Variance of these weights over that of an untruncated Gaussian: they end three pixels from the
// centre.
const CLEAN_VARIANCE: f32 = 0.881;

fn clean_sigma(wide: f32) -> f32 {
    return min(CLEAN_SIGMA, 0.5 * wide);
}

// Standard deviation of the passes along the axes, such that all three passes together have `wide`
// pixels: variances add.
fn axis_sigma(wide: f32) -> f32 {
    let clean = clean_sigma(wide);
    return sqrt(wide * wide - CLEAN_VARIANCE * clean * clean);
}

// Whether a solid in front of the water or in it hides a pixel's water, so that the surface there
// is unknown.
fn is_hidden(at: i32, z: f32, far: f32) -> bool {
    return source[at] >= FAR && solid_depth[at] <= z + far;
}

fn narrow_pair(range: ptr<function, NarrowRange>, at_a: i32, at_b: i32, z: f32) -> NarrowPair {
    var a = source[at_a];
    var b = source[at_b];
    // Another object is in front: drops the sample and its mirror image.
    if min(a, b) < z - (*range).near || is_hidden(at_a, z, (*range).far)
        || is_hidden(at_b, z, (*range).far)
    {
        return NarrowPair(0.0, 0.0);
    }
    let in_a = a <= z + (*range).far;
    let in_b = b <= z + (*range).far;
    // The range grows with the accepted samples.
    if in_a && in_b {
        (*range).near = max((*range).near, z - min(a, b) + params.range);
        (*range).far = max((*range).far, max(a, b) - z + params.range);
    }
    a = select(z + params.offset, a, in_a);
    b = select(z + params.offset, b, in_b);
    return NarrowPair(1.0, 1.0 / a + 1.0 / b);
}
