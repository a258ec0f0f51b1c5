//! The grid on which PBF's velocities are made free of divergence, as the FLIP scene whose projection that is.

use super::{
    Method, Scene, Solver, Water,
    effects::Grain,
    flip::{Flip, Precision, Preconditioner, Pressure, Surface, Transfer},
};

/// Edge of a cell, in particle spacings: eight particles fill it, as FLIP's do.
pub(super) const PROJECTION_CELL: f64 = 2.0;

/// Rate r at which particles take on the grid's velocity, over √(g / Δx): a viscosity of r Δx² / 6 (Zhu and Bridson 2005),
/// the same at any scale and length of a step. Without it what the grid does not see of a splash, particles against each
/// other, hardly calms down.
const PIC_RATE: f64 = 0.17;

/// What the projection stops at, and after.
const PRESSURE: Pressure = Pressure {
    preconditioner: Preconditioner::Multigrid,
    precision: Precision::F32Refined,
    tolerance: 1e-5,
    max_iterations: 400,
};

impl Scene {
    /// The same water, walls and solids with FLIP on cells of twice the particle spacing, of which PBF takes the velocities
    /// alone; `None` where it does not.
    pub fn of_projection(&self) -> Option<Self> {
        if self.solver.method != Method::Pbf || !self.solver.pbf().grid_projection {
            return None;
        }
        let pbf = self.solver.pbf();
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
            pressure: PRESSURE,
        };
        let mut scene = self.clone();
        scene.solver.method = Method::Flip;
        scene.solver.flip = Some(flip);
        scene.effects = self.effects.on_projection();
        Some(scene)
    }

    /// What its effects are judged by.
    pub(super) fn grain(&self) -> Grain {
        grain(&self.water, &self.solver)
    }

    /// What gravity adds to a velocity in a second as PBF predicts with it, m/s²: nothing where the projection has done so.
    pub fn predicted_gravity(&self) -> glam::DVec3 {
        match self.solver.pbf().grid_projection {
            true => glam::DVec3::ZERO,
            false => self.water.gravity,
        }
    }

    /// Whether pressures are read from PBF's multipliers, rather than from a projection.
    pub fn reads_multipliers(&self) -> bool {
        !self.solver.pbf().grid_projection && !self.pressure_points().is_empty()
    }
}

/// What effects in such water are judged by.
pub(super) fn grain(water: &Water, solver: &Solver) -> Grain {
    let (spacing, cell) = match solver.method {
        Method::Pbf => {
            let spacing = solver.pbf().particle_spacing;
            (spacing, PROJECTION_CELL * spacing)
        }
        Method::Flip => {
            let flip = solver.flip();
            (flip.particle_spacing(), flip.cell_size)
        }
    };
    Grain {
        density: water.rest_density,
        gravity: water.gravity.length(),
        spacing,
        cell,
    }
}
