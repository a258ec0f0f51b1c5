//! The scene as whitewater generation sees it.

use super::{Effects, Iteration, Pbf, PbfScene, Scene, SceneWith, Stop};
use swell_domain::whitewater::SUPPORT;

impl Scene {
    /// Returns the scene as whitewater generation sees it for either solver: the same water, walls
    /// and solids as particles of one spacing, with a support radius of [`SUPPORT`] spacings.
    #[must_use]
    pub fn of_whitewater(&self) -> PbfScene<'static> {
        let pbf = Pbf {
            particle_spacing: self.particle_spacing(),
            support_ratio: SUPPORT,
            iteration: Iteration::Jacobi,
            spectral_radius: 0.0,
            stop: Stop::Iterations(1),
            cfl: 1.0,
            relaxation: 1.0,
            artificial_pressure: 0.0,
            grid_projection: false,
            max_substeps: 1,
        };
        let scene = Self {
            effects: Effects::default(),
            probes: Vec::new(),
            ..self.clone()
        };
        SceneWith::new(scene, pbf)
    }
}
