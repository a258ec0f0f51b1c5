//! Faults in surface tension.

use super::{Control, control};

pub const TENSION: &[Control] = &[
    control(
        "effects/tension_share",
        "clamp(density[element], 0.0, 1.0)",
        "clamp(density[element], 0.0, 1.01)",
        "effects/tension_share",
        &["share"],
    ),
    control(
        "effects/tension_smooth",
        "return tension_share[element]",
        "return 1.0001 * tension_share[element]",
        "effects/tension_smooth",
        &["share"],
    ),
    control(
        "effects/tension_smooth_again",
        "return tension_between[element]",
        "return 1.0001 * tension_between[element]",
        "effects/tension_smooth_again",
        &["share"],
    ),
    control(
        "effects/tension_curvature",
        "(off - SHIFT * bend)",
        "(off + SHIFT * bend)",
        "effects/tension_curvature",
        &["curvature"],
    ),
    control(
        "effects/tension_curvature",
        "mean += 0.125 * slope",
        "mean += 0.126 * slope",
        "effects/tension_curvature",
        &["curvature", "slope"],
    ),
    control(
        "effects/tension_push",
        "select(-pushed, pushed, is_water)",
        "select(-pushed, 1.001 * pushed, is_water)",
        "effects/tension_push",
        &["velocity at faces"],
    ),
];
