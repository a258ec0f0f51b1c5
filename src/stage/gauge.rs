//! How a scene's wave is measured: its direction and its still level.

use swell_cache::{CacheError, CacheReader};
use swell_scene::Scene;
use swell_study::measure::{Direction, Gauge};

/// Direction of the wave: away from the first wave maker, or towards greater x if there is none.
pub fn direction(scene: &Scene) -> Direction {
    let makers = &mut scene.wave_makers.iter();
    let maker = makers.find(|maker| maker.wall.axis != 1);
    Direction {
        axis: maker.map_or(0, |maker| maker.wall.axis),
        is_forward: maker.is_none_or(|maker| !maker.wall.is_max),
    }
}

/// A gauge for runs of a scene whose coarsest particle spacing is `coarsest` metres, so that all
/// are measured alike. `start` is a state at rest with a particle spacing of `spacing` metres.
///
/// With a wave maker, the still level is that of the start. Other scenes are not at rest at the
/// start, so the level to which their water would settle is used.
pub fn gauge(scene: &Scene, coarsest: f64, start: &[[f32; 3]], spacing: f64) -> Gauge {
    let gauge = Gauge::new(scene.domain, direction(scene), coarsest);
    let still = if scene.wave_makers.is_empty() {
        let size = scene.domain.size();
        start.len() as f64 * spacing.powi(3) / (size.x * size.z)
    } else {
        gauge.depth(start, spacing)
    };
    gauge.with_still_level(still)
}

/// One gauge for several caches of a scene.
///
/// # Errors
/// A frame that cannot be read.
pub fn of_caches(scene: &Scene, caches: &[&CacheReader]) -> Result<Gauge, CacheError> {
    let spacings = caches.iter().map(|c| c.manifest().particle_spacing);
    let coarsest = spacings.fold(0.0, f64::max);
    // A bake that began from a frame of another has no state at rest: the earliest start comes
    // closest.
    let first = caches.iter().min_by_key(|cache| cache.first_frame());
    let first = first.unwrap_or(&caches[0]);
    let start = first.read(first.first_frame())?;
    let spacing = first.manifest().particle_spacing;
    Ok(gauge(scene, coarsest, &start.position, spacing))
}
