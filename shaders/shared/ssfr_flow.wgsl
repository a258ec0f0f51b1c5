// One curvature-flow step on one level of the depth pyramid (van der Laan 2009), with the amount of
// smoothing that the distance asks for (Bagar 2010).
//
// The paper's step is z −= dt H with dt ≤ |z| C / 2. Here every pixel runs at that limit for its own depth,
// times `fraction`: dt = fraction |z| C / 2. A step then widens the surface by a variance of
// dt C |z| = fraction (C |z|)² / 2, so the world-space width σ is reached after N(z) = 2 σ² / (fraction (C |z|)²)
// steps: Bagar's N(z). An explicit flow needs that many steps, hundreds close by; variances add, so
// the steps are dealt out over a pyramid whose cells double, at most `steps` on each level but the last.

struct FlowParams {
    // Standard deviation of the smoothing: metres where `world` is 1, else cells of level 0.
    width: f32,
    world: u32,
    // Of the stability limit; negative runs the flow backwards, which a test asks for.
    fraction: f32,
    // Depth steps larger than this are edges, metres.
    edge: f32,
    steps: u32,
    levels: u32,
    pad0: u32,
    pad1: u32,
}

struct FlowLevel {
    size: vec2u,
    level: u32,
    // Which step of this level.
    index: u32,
}

struct Share {
    // How many steps, in fractions of a step, this level makes at this depth.
    steps: f32,
    // Whether the surface here is taken from this level at all.
    reached: bool,
}

// Going down and up one level widens the surface too: averaging two cells by 1/4 cell², interpolating
// between the coarse ones by 3/4. Both are part of what was asked for.
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

// A depth step that a smooth surface at this level may have between neighbours.
fn is_edge(params: FlowParams, a: f32, b: f32, cell: f32) -> bool {
    return abs(a - b) > params.edge + 3.0 * cell || max(a, b) >= FAR;
}

// What stands in for a neighbour across an edge: the surface goes on straight. A plane in space is straight
// in 1/z, so that is where it is extrapolated; with no neighbour on either side it is level.
fn straight(here: f32, opposite: f32, opposite_is_edge: bool) -> f32 {
    if opposite_is_edge {
        return here;
    }
    return 1.0 / max(2.0 / here - 1.0 / opposite, 0.5 / here);
}
