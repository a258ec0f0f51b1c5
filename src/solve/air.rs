//! Constants of shaders/shared/air.wgsl.

use swell_domain::air::{DENSITY, VISCOSITY};

/// Returns the constants for droplets of `drop_radius` metres in a wind of `wind` m/s.
pub(super) fn constants(drop_radius: f64, wind: [f64; 3]) -> Vec<(&'static str, f64)> {
    vec![
        ("AIR_DENSITY", DENSITY),
        ("AIR_VISCOSITY", VISCOSITY),
        ("DROP_RADIUS", drop_radius),
        ("WIND_X", wind[0]),
        ("WIND_Y", wind[1]),
        ("WIND_Z", wind[2]),
    ]
}
