//! Pressure projection of face velocities on sparse bricks.
//!
//! The unknown is q = p Δt / (ρ Δx), a velocity, so that nothing is scaled: for each cell of water
//! Σ f (q − q') over its six faces = −(Σ ± f u + `solid_flux`), with f the face's open fraction (Batty et
//! al. 2007), and each open face is then corrected by u −= q − q'. Air is q' = 0, at its cell's centre or
//! where the surface crosses (ghost fluid).
//!
//! # What the caller's program holds
//! Buffers that the caller fills before [`PressureSolver::project`], `slots` = capacity in slots, slot 0
//! included; cell arrays are `slots * 512` values, planes three such arrays one after the other, so that
//! component c of element e is at `c * 512 * slots + e`:
//!
//! | name | type | holds |
//! | --- | --- | --- |
//! | `bricks` | `Brick` | the records of `domain::bricks` |
//! | `cell_kind` | `u32` cells | [`AIR`], [`FLUID`] or [`SOLID`] (no open volume); of active slots |
//! | `face_open` | `f32` planes | open fraction of the lower faces, 0..1; slot 0 stays 0, so the box is closed |
//! | `face_velocity` | `f32` planes | m/s; a face with fraction 0 holds the solid's velocity and keeps it |
//! | `solid_flux` | `f32` cells | Σ ± (1 − f) u_solid over the six faces, outward positive, m/s |
//! | `liquid_distance` | `f32` cells | metres, negative inside; with [`Surface::GhostFluid`] alone |
//! | `density_excess` | `f32` cells | ρ/ρ_target − 1 as it is to be corrected; with the correction alone |
//!
//! What the room fills, of [`buffers`]: `face_velocity` in place; `pressure`, Pa, natural cell order, 0 where
//! there is no water; `face_displacement`, planes in metres, 0 on faces that touch no water or are closed.
//! Only cells of wet slots are FLUID. Only faces between water and water or water and air change.
//!
//! # Use
//! ```text
//! specs += pressure::buffers(..); passes += pressure::passes(..);      plan
//! let mut pressure = PressureSolver::new(&program, ..);                once, and again when slots grow
//! pressure.set_topology(&program, &bricks, cell_size)                  each substep, after `bricks` is uploaded
//! pressure.project(&program, Step { .. }, timer)                       builds, solves, subtracts; waits once
//! pressure.correct(&program, timer)                                    same system, density_excess -> face_displacement
//! ```

use crate::{
    domain::bricks::Bricks,
    gpu::{
        program::{BufferSpec, PassSpec, Program},
        recording::Timer,
    },
    scene::flip::{Pressure, Surface},
};

use super::SolveError;

/// `cell_kind` of a cell without water.
pub const AIR: u32 = 0;
/// `cell_kind` of a cell of water.
pub const FLUID: u32 = 1;
/// `cell_kind` of a cell without open volume.
pub const SOLID: u32 = 2;

/// Levels of bricks that the multigrid uses at most: pass it to [`Bricks::new`] as depth.
pub const LEVELS: usize = 8;

/// What a substep is.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Δt, seconds.
    pub time_step: f64,
    /// ρ, kg/m³.
    pub rest_density: f64,
}

/// What a solve did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Solved {
    /// Conjugate-gradient iterations.
    pub iterations: u32,
    /// ‖b − Ax‖/‖b‖ from a freshly computed residual; 0 where b = 0.
    pub residual: f64,
    /// Whether that is above the tolerance.
    pub is_missed: bool,
}

/// What a projection did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Projected {
    /// The solve.
    pub solved: Solved,
    /// Largest |∇·u| in a cell of water before, 1/s.
    pub divergence_before: f64,
    /// The same after.
    pub divergence_after: f64,
    /// Bodies of water that no air touches.
    pub pockets: u32,
    /// Largest |mean of ∇·u| over a pocket, 1/s: what no pressure can undo, as when a solid crushes it.
    pub incompatible: f64,
    /// Cells of water without an open face.
    pub dropped: u32,
}

/// Buffers that the room needs beside those of the table above; `capacity` is in slots.
pub fn buffers(settings: &Pressure, has_correction: bool, capacity: usize) -> Vec<BufferSpec> {
    let _ = (settings, has_correction, capacity);
    unimplemented!()
}

/// Its passes.
pub fn passes(settings: &Pressure, surface: Surface, has_correction: bool) -> Vec<PassSpec> {
    let _ = (settings, surface, has_correction);
    unimplemented!()
}

/// The projection, bound to a program that holds [`buffers`] and [`passes`].
pub struct PressureSolver {}

impl PressureSolver {
    /// Binds the program's buffers; to be built anew when those were replaced by larger ones.
    pub fn new(
        program: &Program,
        settings: &Pressure,
        has_correction: bool,
        capacity: usize,
    ) -> Self {
        let _ = (program, settings, has_correction, capacity);
        unimplemented!()
    }

    /// Takes over the bricks of a substep, whose records the caller has uploaded to `bricks`.
    pub fn set_topology(&mut self, program: &Program, bricks: &Bricks, cell_size: f64) {
        let _ = (program, bricks, cell_size);
        unimplemented!()
    }

    /// Builds the system, solves it and makes `face_velocity` free of divergence; waits for the device.
    ///
    /// # Errors
    /// The device.
    pub fn project(
        &mut self,
        program: &Program,
        step: Step,
        timer: Option<&mut Timer>,
    ) -> Result<Projected, SolveError> {
        let _ = (program, step, timer);
        unimplemented!()
    }

    /// Solves the last projection's system for displacements whose divergence is `density_excess`
    /// (Kugelstadt et al. 2019), to [`CORRECTION_TOLERANCE`]; waits for the device.
    ///
    /// # Errors
    /// The device.
    pub fn correct(
        &mut self,
        program: &Program,
        timer: Option<&mut Timer>,
    ) -> Result<Solved, SolveError> {
        let _ = (program, timer);
        unimplemented!()
    }
}

/// Relative residual of the density correction.
pub const CORRECTION_TOLERANCE: f64 = 1e-2;
