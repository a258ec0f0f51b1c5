// One curvature-flow step on one level of the depth pyramid (van der Laan 2009), with an amount of
// smoothing that depends on the distance (Bagar 2010).
//
// The paper's step is z −= dt H with dt ≤ |z| C / 2. Here every pixel runs at that limit for its
// own depth, times `fraction`: dt = fraction |z| C / 2. A step then widens the surface by a
// variance of dt C |z| = fraction (C |z|)² / 2, so the world-space width σ is reached after N(z) =
// 2 σ² / (fraction (C |z|)²) steps: Bagar's N(z). An explicit flow needs that many steps, hundreds
// nearby; variances add, so the steps are distributed over a pyramid whose cells double, at most
// `steps` on each level but the last.

struct FlowParams {
    // Standard deviation of the smoothing: metres where `world` is 1, else cells of level 0.
    width: f32,
    world: u32,
    // Fraction of the stability limit; a test uses negative values to run the flow backwards.
    fraction: f32,
    // Depth differences larger than this are edges, metres.
    edge: f32,
    steps: u32,
    levels: u32,
    pad0: u32,
    pad1: u32,
}

struct FlowLevel {
    size: vec2u,
    level: u32,
    // Index of the step on this level.
    index: u32,
}

struct Share {
    // Number of steps that this level makes at this depth, possibly fractional.
    steps: f32,
    // Whether the surface here is taken from this level at all.
    reached: bool,
}

// Crossing a level down and up also widens the surface: averaging two cells adds 1/4 cell²,
// interpolating between coarse cells 3/4. Both count towards the requested width.
const CROSSING: f32 = 1.0;

fn level_share(params: FlowParams, z: f32, focal: f32, level: u32) -> Share {
    let footprint = select(1.0, z / focal, params.world == 1u);
    let cells = params.width / footprint;
    var rest = cells * cells;
    let each = 0.5 * abs(params.fraction);
    var cell = 1.0;
    for (var m = 0u; m < level; m++) {
        let most = f32(params.steps) * each * cell;
        if rest <= most {
            return Share(0.0, false);
        }
        rest -= CROSSING * cell;
        rest -= min(rest, most);
        cell *= 4.0;
    }
    let most = f32(params.steps) * each * cell;
    if rest > most && level + 1u < params.levels {
        rest = min(rest - CROSSING * cell, most);
    }
    return Share(rest / (each * cell), true);
}

// Whether two neighbouring depths differ by more than a smooth surface may at this level.
fn is_edge(params: FlowParams, a: f32, b: f32, cell: f32) -> bool {
    return abs(a - b) > params.edge + 3.0 * cell || max(a, b) >= FAR;
}

// Value in place of a neighbour across an edge: the surface continues straight. A plane in space is
// straight in 1/z, so the extrapolation uses that; without a neighbour on either side it is level.
fn straight(here: f32, opposite: f32, opposite_is_edge: bool) -> f32 {
    if opposite_is_edge {
        return here;
    }
    return 1.0 / max(2.0 / here - 1.0 / opposite, 0.5 / here);
}
