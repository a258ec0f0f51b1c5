//! Faults at walls that move, and at walls that cut cells.

use super::{Control, control, flip::SYSTEM};

/// Faults in a scene with moving walls.
pub const FLIP_WALLS: &[Control] = &[control(
    "flip/boundary_work",
    "for (var k = 0u;",
    "for (var k = 16u;",
    "flip/boundary_work",
    &["shares of the work"],
)];

const fn of_water(from: &'static str, to: &'static str) -> Control {
    let fields = &["distance of the surface"];
    control("flip/find_water", from, to, "flip/find_water", fields).and(SYSTEM)
}

/// Faults at the upper walls.
pub const FLIP_FAR_WALLS: &[Control] = &[
    of_water(
        "select(vec3i(-1), vec3i(1), !is_plane_open(cell))",
        "select(vec3i(1), vec3i(-1), !is_plane_open(cell))",
    ),
    of_water(
        "near + clamp(near - far, far - 1.0, far)",
        "near + 0.9 * clamp(near - far, far - 1.0, far)",
    ),
];
