//! Scenes and looks as validated types, and what follows from them without a solver.

pub mod budget;
pub mod effects;
pub mod flip;
pub mod forces;
pub mod grids;
pub mod lint;
pub mod look;
pub mod mesh_sequence;
pub mod moving_solid;
pub mod open_waves;
pub mod origin;
pub mod probe;
pub mod projection;
pub mod rate;
pub mod solid_grid;
pub mod solid_path;
pub mod solid_track;
pub mod sources;
pub mod start_waves;
pub mod step;
pub mod waves;
pub mod words;

mod absorption;
mod assets;
mod container;
mod error;
mod force;
mod no_slip;
mod periodic;
mod solver;
mod whitewater;

use std::path::PathBuf;

use glam::{DAffine3, DQuat, DVec3};

use swell_domain::{
    absorption::Absorption,
    bounds::Bounds,
    holes::Holes,
    keep::{Compression, Keep},
    mesh::TriangleMesh,
    motion::Motion,
    sources::{Drain, Emitter},
};

use swell_domain::named::read_by_name;

pub use absorption::Held;
pub use assets::asset_path;
pub use budget::Budget;
pub use effects::Effects;
pub use error::{Fault, LEADS_OUT, Place, SceneError};
pub use solver::{ByMethod, FlipScene, PbfScene, SceneWith, Solver};
pub use words::four_digits;

/// A validated scene in SI units: every default is filled in and every referenced file is read.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Name, length and frame rate of the shot.
    pub shot: Shot,
    /// World position of the local origin, metres: world position = `origin` + local position.
    ///
    /// It is zero unless the domain is so far from the world's origin that `f32` coordinates could
    /// not resolve particles there. All positions below are local.
    pub origin: DVec3,
    /// Box whose six faces are solid walls, metres.
    pub domain: Bounds,
    /// No-slip walls, each listed once. All other walls are free-slip.
    pub no_slip: Vec<Wall>,
    /// Axes along which the domain is periodic and has no walls.
    pub periodic: [bool; 3],
    /// Water at the start of the shot.
    pub water: Water,
    /// Static solids; moving ones are in `moving_solids`.
    pub solids: Vec<Solid>,
    /// Moving solids; static ones are in `solids`.
    pub moving_solids: Vec<moving_solid::MovingSolid>,
    /// Moving domain walls, at most one per wall.
    pub wave_makers: Vec<WaveMaker>,
    /// Regions where water enters during the shot.
    pub emitters: Vec<Emitter<sources::Region>>,
    /// Regions where water leaves during the shot.
    pub drains: Vec<Drain<sources::Region>>,
    /// Force fields, whose accelerations add to gravity's.
    pub forces: Vec<forces::PlacedForce>,
    /// What the motion of the domain does; `None` for one at rest.
    pub frame: Option<forces::MovingFrame>,
    /// The chosen method with its settings.
    pub solver: Solver,
    /// Settings of the method that is not chosen, if the file has them: they are written with the
    /// scene, so that the method of what was recorded can be changed, and change no result.
    pub unchosen: Option<Solver>,
    /// Grids written with each frame beside the particles; `None` writes none.
    pub grids: Option<grids::Grids>,
    /// Frames whose particles stay on disk; `None` keeps all of them.
    pub keep: Option<Keep>,
    /// Compression of the frames; `None` writes plain PLY.
    pub compression: Option<Compression>,
    /// Quantities measured at each frame.
    pub probes: Vec<probe::Probe>,
    /// Limits at which a bake stops.
    pub budget: Budget,
    /// Effects that the scene enables; each is `None` unless the scene names it.
    pub effects: Effects,
}

impl Scene {
    /// Returns the positions of the pressure probes in their order in the scene, metres.
    pub fn pressure_points(&self) -> Vec<DVec3> {
        let probes = self.probes.iter();
        probes
            .filter_map(|probe| match probe.kind {
                probe::ProbeKind::Pressure { at } => Some(at),
                _ => None,
            })
            .collect()
    }

    /// Returns the particle spacing d of the chosen solver, metres: the distance between neighbours
    /// on the initial lattice.
    pub fn particle_spacing(&self) -> f64 {
        self.solver.particle_spacing()
    }

    /// Returns the names of the attributes that each particle carries beside position, velocity and
    /// id.
    pub fn declared_attributes(&self) -> &'static [&'static str] {
        match &self.solver {
            Solver::Pbf(_) => &[],
            Solver::Flip(flip) => flip.attributes(),
        }
    }
}

/// Name and clock of a shot.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shot {
    /// Safe as part of a file name.
    pub name: String,
    /// Number of output frames; frame 1 is the first one after the start.
    pub frames: u32,
    /// Output frames per second.
    pub frames_per_second: f64,
}

impl Shot {
    /// Returns the duration of a frame, seconds.
    pub fn frame_seconds(&self) -> f64 {
        1.0 / self.frames_per_second
    }

    /// Returns the time at the end of a frame, seconds from the start.
    pub fn time(&self, frame: u32) -> f64 {
        f64::from(frame) / self.frames_per_second
    }

    /// Returns the time from the start to the end of the last frame, seconds.
    pub fn duration(&self) -> f64 {
        f64::from(self.frames) / self.frames_per_second
    }
}

/// Water at the start of the shot.
#[derive(Clone, Debug, PartialEq)]
pub struct Water {
    /// ρ0, kg/m³.
    pub rest_density: f64,
    /// Gravitational acceleration, m/s².
    pub gravity: DVec3,
    /// Velocity of the undisturbed water, m/s, along periodic axes: that of the start, to which
    /// waves add theirs, and towards which zones lead.
    pub current: DVec3,
    /// Boxes filled with water, metres.
    pub blocks: Vec<Bounds>,
    /// Closed meshes filled with water.
    pub meshes: Vec<PlacedMesh>,
    /// Waves at the start. The water below them fills the domain, and there are no blocks and
    /// meshes beside it.
    pub waves: Vec<start_waves::StartWave>,
    /// Particles whose positions the scene lists one by one.
    pub particles: Vec<Swarm>,
}

impl Water {
    /// Returns the hydrostatic pressure gradient ρ g, Pa/m.
    pub fn rise(&self) -> DVec3 {
        self.rest_density * self.gravity
    }
}

/// Particles that the scene lists one by one. They are used as given, even where they overlap other
/// water.
#[derive(Clone, Debug, PartialEq)]
pub struct Swarm {
    /// Positions, metres.
    pub at: Vec<DVec3>,
    /// Initial velocity of all of them, m/s.
    pub velocity: DVec3,
}

/// A static solid.
pub type Solid = PlacedMesh;

/// A mesh read from a file and transformed into the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedMesh {
    /// File that the mesh was read from.
    pub file: PathBuf,
    /// BLAKE3 of the file's bytes, hexadecimal.
    pub file_hash: String,
    /// Transform from the file to the world, as written in the scene.
    pub placement: Placement,
    /// Vertices relative to the scene's origin, metres.
    pub mesh: TriangleMesh,
    /// Holes of a mesh that is not watertight; world coordinates, metres.
    pub holes: Holes,
    /// Largest rounding error of the coordinates along each axis, metres, as if the program that
    /// wrote the file used 32-bit floats; at most a hundredth of the particle spacing.
    pub rounding: DVec3,
    /// Other defects of the file that are tolerated, one sentence each.
    pub faults: Vec<String>,
}

/// Scale, then rotation, then translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Translation, metres.
    pub translate: DVec3,
    /// Euler angles, degrees: about the world's x axis first, then y, then z ("XYZ Euler" in
    /// Blender and Houdini).
    pub rotate_degrees: DVec3,
    /// Metres per unit of the file, along each axis.
    pub scale: DVec3,
}

impl Default for Placement {
    fn default() -> Self {
        Self {
            translate: DVec3::ZERO,
            rotate_degrees: DVec3::ZERO,
            scale: DVec3::ONE,
        }
    }
}

impl Placement {
    /// Returns the transform from file coordinates to the world.
    pub fn world_from_file(&self) -> DAffine3 {
        let [x, y, z] = self.rotate_degrees.to_array().map(f64::to_radians);
        let rotation =
            DQuat::from_rotation_z(z) * DQuat::from_rotation_y(y) * DQuat::from_rotation_x(x);
        DAffine3::from_scale_rotation_translation(self.scale, rotation, self.translate)
    }

    /// Bounds the rounding error in the world, metres, for coordinates that are off by up to
    /// `in_file` in the file.
    pub fn rounding(&self, in_file: DVec3) -> DVec3 {
        self.world_from_file().matrix3.abs() * in_file
    }
}

/// One of the six domain walls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wall {
    /// Index of the axis: 0, 1 or 2 for x, y or z.
    pub axis: usize,
    /// Whether the wall is at the domain's maximum along the axis.
    pub is_max: bool,
}

impl Wall {
    /// All six walls with the names used in scenes, ordered as [`Wall::name`] expects.
    pub const NAMED: [(&'static str, Self); 6] = [
        ("-x", Self::NEG_X),
        ("+x", Self::POS_X),
        ("-y", Self::NEG_Y),
        ("+y", Self::POS_Y),
        ("-z", Self::NEG_Z),
        ("+z", Self::POS_Z),
    ];

    /// The wall at the domain's minimum along x.
    pub const NEG_X: Self = Self::new(0, false);
    /// The wall at the domain's maximum along x.
    pub const POS_X: Self = Self::new(0, true);
    /// The floor.
    pub const NEG_Y: Self = Self::new(1, false);
    /// The ceiling.
    pub const POS_Y: Self = Self::new(1, true);
    /// The wall at the domain's minimum along z.
    pub const NEG_Z: Self = Self::new(2, false);
    /// The wall at the domain's maximum along z.
    pub const POS_Z: Self = Self::new(2, true);

    const fn new(axis: usize, is_max: bool) -> Self {
        Self { axis, is_max }
    }

    /// Returns the wall's bit in a mask: bits 0 to 2 are the minimum faces along x, y and z, bits 3
    /// to 5 the maximum ones.
    pub fn bit(&self) -> u32 {
        1 << (self.axis + 3 * usize::from(self.is_max))
    }

    /// Returns the name used in scenes, such as `-x`.
    pub fn name(self) -> &'static str {
        Self::NAMED[2 * self.axis + usize::from(self.is_max)].0
    }
}

/// A domain wall that moves along its inward normal.
#[derive(Clone, Debug, PartialEq)]
pub struct WaveMaker {
    /// The wall that moves.
    pub wall: Wall,
    /// Displacement from the starting position, positive inward, metres.
    pub motion: Motion,
    /// Active absorption of incoming waves; `None` for a wall that does not absorb.
    pub absorption: Option<Absorption>,
}

/// A fluid solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Position-based fluids (Macklin and Müller 2013).
    Pbf,
    /// PIC/FLIP (Zhu and Bridson 2005).
    Flip,
}

impl Method {
    /// All methods with the names used in scenes.
    pub const NAMED: [(&'static str, Self); 2] = [("pbf", Self::Pbf), ("flip", Self::Flip)];

    /// Returns the `key=value` override that chooses this method.
    pub fn as_override(self) -> String {
        format!("solver.method={}", self.name())
    }

    /// Returns the name used in scenes.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
}

/// PBF settings (Macklin and Müller 2013).
#[derive(Clone, Debug, PartialEq)]
pub struct Pbf {
    /// d, the distance between neighbours on the initial lattice, metres.
    pub particle_spacing: f64,
    /// Support radius h over the particle spacing d.
    pub support_ratio: f64,
    /// Scheme that applies the corrections within the density iteration.
    pub iteration: Iteration,
    /// Spectral radius ρ < 1 of the plain iteration, as the Chebyshev semi-iteration assumes it. A
    /// value nearer to 1 reaches deeper.
    pub spectral_radius: f64,
    /// When the density iteration stops.
    pub stop: Stop,
    /// Largest displacement per substep, in particle spacings.
    pub cfl: f64,
    /// Relaxation factor ω on each correction.
    pub relaxation: f64,
    /// Coefficient k of the artificial pressure s_corr, in units of λ's natural scale; 0 disables
    /// it.
    pub artificial_pressure: f64,
    /// Whether velocities are projected to be divergence-free on a grid before particles move
    /// (Raveendran et al. 2011).
    pub grid_projection: bool,
    /// Largest number of substeps per frame. A scene that needs more is stopped; it is never
    /// stepped more coarsely.
    pub max_substeps: u32,
}

/// Order in which the density iteration applies its corrections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Iteration {
    /// All corrections at once.
    Jacobi,
    /// One colour first, then the other, which sees the corrected positions of the first.
    RedBlack,
    /// All corrections at once, accelerated by a Chebyshev semi-iteration (Wang 2015).
    Chebyshev,
}

impl Iteration {
    /// All iterations with the names used in scenes.
    pub const NAMED: [(&'static str, Self); 3] = [
        ("jacobi", Self::Jacobi),
        ("red_black", Self::RedBlack),
        ("chebyshev", Self::Chebyshev),
    ];

    /// Returns the name used in scenes.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
}

/// Stopping criterion of the density iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// A fixed number of iterations.
    Iterations(u32),
    /// Stops once the mean density error is below `density_error`, or after `max_iterations`.
    DensityError {
        /// Bound on the mean of max(0, ρ/ρ0 − 1).
        density_error: f64,
        /// Largest number of iterations.
        max_iterations: u32,
    },
}

impl Stop {
    /// Returns the largest number of iterations.
    pub fn most_iterations(self) -> u32 {
        match self {
            Self::Iterations(count)
            | Self::DensityError {
                max_iterations: count,
                ..
            } => count,
        }
    }
}

read_by_name!(Wall);
read_by_name!(Method);
read_by_name!(Iteration);
