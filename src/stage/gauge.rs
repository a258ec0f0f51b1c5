//! How a scene's wave is measured: which way it runs, and where the water stands still.

use swell_cache::{CacheError, CacheReader};
use swell_scene::Scene;
use swell_study::measure::{Direction, Gauge};

/// The wave runs away from the first wave maker; towards greater x where there is none.
pub fn direction(scene: &Scene) -> Direction {
    let makers = &mut scene.wave_makers.iter();
    let maker = makers.find(|maker| maker.wall.axis != 1);
    Direction {
        axis: maker.map_or(0, |maker| maker.wall.axis),
        is_forward: maker.is_none_or(|maker| !maker.wall.is_max),
    }
}

/// The gauge of runs of a scene whose coarsest particles are `coarsest` metres apart, so that all are measured alike.
/// `start` is a state before anything moved, its particles `spacing` metres apart.
///
/// Where a wave maker stands, the still level is that of the start; other water has none at the start, and what it would
/// settle to is taken.
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

/// One gauge for all caches of a scene.
///
/// # Errors
/// A frame that cannot be read.
pub fn of_caches(scene: &Scene, caches: &[&CacheReader]) -> Result<Gauge, CacheError> {
    let spacings = caches.iter().map(|c| c.manifest().particle_spacing);
    let coarsest = spacings.fold(0.0, f64::max);
    // A bake that began from a frame of another knows no rest: the earliest start comes nearest.
    let first = caches.iter().min_by_key(|cache| cache.first_frame());
    let first = first.unwrap_or(&caches[0]);
    let start = first.read(first.first_frame())?;
    let spacing = first.manifest().particle_spacing;
    Ok(gauge(scene, coarsest, &start.position, spacing))
}
