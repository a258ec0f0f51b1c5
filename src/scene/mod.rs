//! Scene and look files, parsed into validated types, and the plan that follows from them.

pub mod look;

use std::path::PathBuf;

use glam::{DAffine3, DVec3};

use crate::domain::{bounds::Bounds, mesh::TriangleMesh, motion::Motion};

/// A validated scene: SI units, every default settled, every file read.
#[derive(Clone, Debug)]
pub struct Scene {
    /// What the shot is called and how long it runs.
    pub shot: Shot,
    /// The box whose six walls are solid, metres.
    pub domain: Bounds,
    /// The water at the start.
    pub water: Water,
    /// Static solids, in world space.
    pub solids: Vec<Solid>,
    /// Domain walls that move; at most one a wall.
    pub wave_makers: Vec<WaveMaker>,
    /// The chosen solver's settings.
    pub solver: Solver,
    /// Effects that the scene names; what is `None` does not exist.
    pub effects: Effects,
}

/// Name and clock of a shot.
#[derive(Clone, Debug, PartialEq)]
pub struct Shot {
    /// File-name safe.
    pub name: String,
    /// Output frames; frame 1 is the first after the start.
    pub frames: u32,
    /// Output frames a second.
    pub frames_per_second: f64,
}

/// Water at the start.
#[derive(Clone, Debug)]
pub struct Water {
    /// kg/m³.
    pub rest_density: f64,
    /// m/s².
    pub gravity: DVec3,
    /// Boxes filled with water at rest, metres.
    pub blocks: Vec<Bounds>,
    /// Closed meshes filled with water at rest, in world space.
    pub meshes: Vec<TriangleMesh>,
}

/// A static solid.
#[derive(Clone, Debug)]
pub struct Solid {
    /// The file it came from.
    pub file: PathBuf,
    /// BLAKE3 of that file's bytes, hex.
    pub file_hash: String,
    /// Applied already to `mesh`.
    pub world_from_file: DAffine3,
    /// World space, metres.
    pub mesh: TriangleMesh,
}

/// One of the six domain walls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wall {
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Whether it is the wall at the domain's greatest coordinate.
    pub is_max: bool,
}

/// A domain wall that moves along its inward normal.
#[derive(Clone, Debug)]
pub struct WaveMaker {
    /// Which wall.
    pub wall: Wall,
    /// Displacement from the domain's face, positive inward, metres.
    pub motion: Motion,
}

/// Solver settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Solver {
    /// Position-based fluids.
    pub pbf: Pbf,
}

/// PBF settings (Macklin and Müller 2013).
#[derive(Clone, Debug, PartialEq)]
pub struct Pbf {
    /// d, metres.
    pub particle_spacing: f64,
    /// h / d.
    pub support_ratio: f64,
    /// How corrections see each other.
    pub iteration: Iteration,
    /// When an iteration stops.
    pub stop: Stop,
    /// Largest displacement in a substep, in units of d.
    pub cfl: f64,
    /// Factor on each correction (ω).
    pub relaxation: f64,
    /// k of the artificial pressure s_corr, with λ's natural scale as unit; 0 leaves it out.
    pub artificial_pressure: f64,
    /// Most neighbours kept in a particle's list.
    pub max_substeps: u32,
}

/// Order in which corrections are applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Iteration {
    /// All at once.
    Jacobi,
    /// One colour, then the other, which sees the corrected first.
    RedBlack,
}

/// When the density iteration stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// After a fixed number.
    Iterations(u32),
    /// When the mean density error falls below `density_error`, or after `max_iterations`.
    DensityError {
        /// Mean of max(0, ρ/ρ0 − 1).
        density_error: f64,
        /// Upper bound.
        max_iterations: u32,
    },
}

/// Effects that a scene names.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Effects {
    /// XSPH viscosity, c (Macklin and Müller 2013, eq. 17).
    pub viscosity: Option<f64>,
    /// Vorticity confinement strength ε (eq. 16).
    pub vorticity_confinement: Option<f64>,
}
