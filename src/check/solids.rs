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
}
