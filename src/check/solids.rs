//! Rounding bounds of the solids' distance grids, which both solvers look up.

use swell_compare::{rounding::U, tolerance::bounds};

bounds! {
    /// Error of a distance grid on the device, metres.
    pub(crate) GRID = [offset: "a place's distance to the grid's origin", origin: "|origin|",
        spacing: "the grid's"]
        U * (7.0 * offset + origin + 48.0 * spacing),
        "differences and quotients of a place in the grid";
    pub(crate) TURNED = [grid: "" GRID,
        radius: "how far places within a turning solid's grid are from its point of rest",
        centre: "|that point|"]
        grid + U * (40.0 * radius + centre),
        "a place is turned back by a quaternion that is a mean of two, normalised";
    pub(crate) SHAPED = [grid: "" GRID, reach: "the largest distance that counts"]
        grid + 4.0 * U * reach,
        "a distance is the start's plus a part of the difference to the end's";
    pub(crate) FLOWED = [fastest: "the fastest node of a shape that changes",
        moved: "what the f64 reference's velocity changes by as nodes move by " SHAPED]
        12.0 * U * fastest + 3.0 * moved,
        "three products for each of eight nodes, and their sum";
}
