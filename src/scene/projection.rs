//! PBF's projection grid, represented as the FLIP scene whose projection it is.

use super::{
    FlipScene, PbfScene, Scene, SceneWith, Solver, Water,
    effects::Grain,
    flip::{Flip, Precision, Preconditioner, Pressure, Surface, Transfer},
};

/// Edge of a cell, particle spacings; eight particles fill it, as with FLIP.
pub const PROJECTION_CELL: f64 = 2.0;

/// Rate r at which particles adopt the grid's velocity, over √(g / Δx): a viscosity of r Δx² / 6
/// (Zhu and Bridson 2005), at any scale and step length. Without it, the relative motion of
/// particles that the grid cannot see hardly decays after a splash.
const PIC_RATE: f64 = 0.17;

/// Settings of the projection's pressure solve.
const PRESSURE: Pressure = Pressure {
    preconditioner: Preconditioner::Multigrid,
    precision: Precision::F32Refined,
    tolerance: 1e-5,
    max_iterations: 400,
};

impl PbfScene<'_> {
    /// Returns the same water, walls and solids with FLIP on cells of twice the particle spacing,
    /// of which PBF uses only the velocities; `None` without grid projection.
    pub fn of_projection(&self) -> Option<FlipScene<'static>> {
        let pbf = self.settings();
        if !pbf.grid_projection {
            return None;
        }
        let cell_size = PROJECTION_CELL * pbf.particle_spacing;
        let rate = PIC_RATE * (self.water.gravity.length() / cell_size).sqrt();
        let flip = Flip {
            cell_size,
            particles_per_cell: 8,
            transfer: Transfer::Flip,
            pic_blend: -(-rate * self.shot.frame_seconds()).exp_m1(),
            cfl: 1.0,
            max_substeps: pbf.max_substeps,
            surface: Surface::GhostFluid,
            density_correction: false,
            band: None,
            pressure: PRESSURE,
        };
        let scene = Scene {
            effects: self.effects.on_projection(),
            ..Scene::clone(self)
        };
        Some(SceneWith::new(scene, flip))
    }

    /// Returns the gravity in PBF's prediction, m/s²; zero if the projection has applied it.
    pub fn predicted_gravity(&self) -> glam::DVec3 {
        match self.settings().grid_projection {
            true => glam::DVec3::ZERO,
            false => self.water.gravity,
        }
    }

    /// Whether pressures are read from PBF's multipliers instead of from a projection.
    pub fn reads_multipliers(&self) -> bool {
        !self.settings().grid_projection && !self.pressure_points().is_empty()
    }
}

impl Scene {
    /// Returns the scales by which effects are judged.
    pub(super) fn grain(&self) -> Grain {
        grain(&self.water, &self.solver)
    }
}

/// Returns the scales by which effects in this water are judged.
pub fn grain(water: &Water, solver: &Solver) -> Grain {
    Grain {
        density: water.rest_density,
        gravity: water.gravity.length(),
        spacing: solver.particle_spacing(),
        cell: solver.cell_size(),
    }
}
