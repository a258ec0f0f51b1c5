//! Zones on the GPU.

use swell_scene::{Scene, effects::zone::Zone};

/// Returns the constants of shared/zone.wgsl.
pub(super) fn constants(zone: Zone<'_>, scene: &Scene) -> Vec<(&'static str, f64)> {
    let size = scene.domain.size();
    vec![
        ("ZONE_WALLS", f64::from(zone.bits())),
        ("ZONE_RATE", zone.rate),
        ("ZONE_INVERSE_LENGTH", 1.0 / zone.length),
        ("ZONE_SIZE_X", size.x),
        ("ZONE_SIZE_Y", size.y),
        ("ZONE_SIZE_Z", size.z),
        ("CURRENT_X", scene.water.current.x),
        ("CURRENT_Z", scene.water.current.z),
    ]
}
