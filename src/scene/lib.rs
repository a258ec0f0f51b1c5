//! Scene and look files, parsed into validated types.

pub mod axis;
pub mod budget;
pub mod edit;
pub mod effects;
pub mod flip;
mod force;
pub mod gltf_nodes;
pub mod grids;
pub mod keys;
pub mod look;
pub mod measure;
mod motion_spec;
mod motion_table;
pub mod moving_solid;
pub mod no_slip;
pub mod periodic;
pub mod probe;
pub mod rig;
pub mod step;
pub mod study;
pub mod tolerance;

mod absorption;
mod build;
mod container;
mod difference;
mod document;
mod error;
mod fit;
mod keep;
mod key;
mod lint;
mod load;
mod origin;
mod overrides;
mod projection;
mod reach;
mod regular_waves;
mod seas;
mod settle;
pub mod solid_grid;
pub mod solid_track;
pub mod sources;
mod spec;
mod usd_nodes;
mod usda;
mod wave_maker;
pub mod whitewater;
mod words;
mod write;

use std::path::PathBuf;

use glam::{DAffine3, DQuat, DVec3};

use swell_domain::{
    absorption::Absorption,
    answer::Answers,
    bounds::Bounds,
    holes::Holes,
    keep::{Compression, Keep},
    mesh::TriangleMesh,
    motion::Motion,
    sources::{Drain, Emitter},
};

use swell_domain::named::read_by_name;

pub use absorption::Held;
pub use budget::Budget;
pub use difference::{physics_difference, physics_hash};
pub use effects::Effects;
pub use error::{Fault, Place, SceneError};
pub use reach::Reach;
pub use words::four_digits;
pub use write::asset_path;

/// A validated scene: SI units, every default settled, every file read.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// What the shot is called and how long it runs.
    pub shot: Shot,
    /// Where the coordinates of all that follows have their zero in the world, metres: `[0, 0, 0]` but for scenes far
    /// off, which 32 bits could not resolve otherwise. World position = origin + position.
    pub origin: DVec3,
    /// The box whose six walls are solid, metres.
    pub domain: Bounds,
    /// Walls that hold water back, each once; along the others it slides freely.
    pub no_slip: Vec<Wall>,
    /// Axes along which it has no walls but joins its own end.
    pub periodic: [bool; 3],
    /// The water at the start.
    pub water: Water,
    /// Static solids.
    pub solids: Vec<Solid>,
    /// Solids that move; static ones stand in `solids`.
    pub moving_solids: Vec<moving_solid::MovingSolid>,
    /// Domain walls that move; at most one a wall.
    pub wave_makers: Vec<WaveMaker>,
    /// Where water enters while the shot runs.
    pub emitters: Vec<Emitter<sources::Region>>,
    /// Where it leaves.
    pub drains: Vec<Drain<sources::Region>>,
    /// Which solver, and the solvers' settings.
    pub solver: Solver,
    /// Grids that each frame gets beside its particles, where the scene asks for any.
    pub grids: Option<grids::Grids>,
    /// Of which frames the particles stay on the disk; all where the scene does not say it.
    pub keep: Option<Keep>,
    /// How frames are compressed; `None` leaves them plain PLY.
    pub compression: Option<Compression>,
    /// What is measured at each frame; most scenes have none.
    pub probes: Vec<probe::Probe>,
    /// What the bake is held to.
    pub budget: Budget,
    /// Effects that the scene names; what is `None` does not exist.
    pub effects: Effects,
    /// What walls that absorb do now, by the state that a solver has taken over; none at the start.
    pub answers: Answers,
}

impl Scene {
    /// Points of the probes of pressure, in order, metres.
    pub fn pressure_points(&self) -> Vec<DVec3> {
        let probes = self.probes.iter();
        probes
            .filter_map(|probe| match probe.kind {
                probe::ProbeKind::Pressure { at } => Some(at),
                _ => None,
            })
            .collect()
    }

    /// d of the chosen solver: between neighbours of the lattice at the start, metres.
    pub fn particle_spacing(&self) -> f64 {
        match self.solver.method {
            Method::Pbf => self.solver.pbf().particle_spacing,
            Method::Flip => self.solver.flip().particle_spacing(),
        }
    }

    /// What each particle carries beside position, velocity and id.
    pub fn declared_attributes(&self) -> &'static [&'static str] {
        match self.solver.method {
            Method::Pbf => &[],
            Method::Flip => self.solver.flip().attributes(),
        }
    }
}

/// Name and clock of a shot.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shot {
    /// File-name safe.
    pub name: String,
    /// Output frames; frame 1 is the first after the start.
    pub frames: u32,
    /// Output frames a second.
    pub frames_per_second: f64,
}

impl Shot {
    /// Seconds from one frame to the next.
    pub fn frame_seconds(&self) -> f64 {
        1.0 / self.frames_per_second
    }

    /// When a frame ends, seconds from the start.
    pub fn time(&self, frame: u32) -> f64 {
        f64::from(frame) / self.frames_per_second
    }

    /// Seconds from the start to the last frame.
    pub fn duration(&self) -> f64 {
        f64::from(self.frames) / self.frames_per_second
    }
}

/// Water at the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Water {
    /// kg/m³.
    pub rest_density: f64,
    /// m/s².
    pub gravity: DVec3,
    /// Boxes filled with water at rest, metres.
    pub blocks: Vec<Bounds>,
    /// Closed meshes filled with water at rest.
    pub meshes: Vec<PlacedMesh>,
    /// Particles at places of their own.
    pub particles: Vec<Swarm>,
}

impl Water {
    /// How pressure rises in water at rest: ρ g, Pa/m.
    pub fn rise(&self) -> DVec3 {
        self.rest_density * self.gravity
    }
}

/// Particles that the scene places one by one; they are taken as they are, also where others stand.
#[derive(Clone, Debug, PartialEq)]
pub struct Swarm {
    /// World positions, metres.
    pub at: Vec<DVec3>,
    /// Of all of them, m/s.
    pub velocity: DVec3,
}

/// A static solid.
pub type Solid = PlacedMesh;

/// A mesh from a file, put into the world.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedMesh {
    /// The file it came from.
    pub file: PathBuf,
    /// BLAKE3 of that file's bytes, hex.
    pub file_hash: String,
    /// As the scene says it.
    pub placement: Placement,
    /// Metres, about the scene's origin.
    pub mesh: TriangleMesh,
    /// Holes that it is taken with; world coordinates, metres.
    pub holes: Holes,
    /// Most that its coordinates may be off along each axis, metres, where the program that wrote the file had 32 bits; a hundredth of
    /// the particle spacing at most.
    pub rounding: DVec3,
    /// Other faults of the file that it is taken with, a sentence each.
    pub faults: Vec<String>,
}

/// Scale first, then rotation, then translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Metres.
    pub translate: DVec3,
    /// About the world's x axis first, then y, then z, as "XYZ Euler" means in Blender and
    /// Houdini.
    pub rotate_degrees: DVec3,
    /// Metres per unit of the file.
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
    /// The transform from the file's frame to the world.
    pub fn world_from_file(&self) -> DAffine3 {
        let [x, y, z] = self.rotate_degrees.to_array().map(f64::to_radians);
        let rotation =
            DQuat::from_rotation_z(z) * DQuat::from_rotation_y(y) * DQuat::from_rotation_x(x);
        DAffine3::from_scale_rotation_translation(self.scale, rotation, self.translate)
    }

    /// Most that coordinates may be off in the world, metres, where those of the file may be off by so much.
    pub(crate) fn rounding(&self, in_file: DVec3) -> DVec3 {
        self.world_from_file().matrix3.abs() * in_file
    }
}

/// One of the six domain walls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wall {
    /// 0, 1, 2 for x, y, z.
    pub axis: usize,
    /// Whether it is the wall at the domain's greatest coordinate.
    pub is_max: bool,
}

impl Wall {
    /// All six, with the names that scenes use.
    pub const NAMED: [(&'static str, Self); 6] = [
        ("-x", Self::new(0, false)),
        ("+x", Self::new(0, true)),
        ("-y", Self::new(1, false)),
        ("+y", Self::new(1, true)),
        ("-z", Self::new(2, false)),
        ("+z", Self::new(2, true)),
    ];

    const fn new(axis: usize, is_max: bool) -> Self {
        Self { axis, is_max }
    }

    /// One of six: of the least faces along x, y and z, then of the greatest.
    pub fn bit(&self) -> u32 {
        1 << (self.axis + 3 * usize::from(self.is_max))
    }

    /// As scenes name it.
    pub fn name(self) -> &'static str {
        Self::NAMED[2 * self.axis + usize::from(self.is_max)].0
    }
}

/// A domain wall that moves along its inward normal.
#[derive(Clone, Debug, PartialEq)]
pub struct WaveMaker {
    /// Which wall.
    pub wall: Wall,
    /// Displacement from where it is at the start, positive inward, metres.
    pub motion: Motion,
    /// How it takes in waves that come to it, where it does.
    pub absorption: Option<Absorption>,
}

/// Solvers' settings. The chosen one's are always there; those of the other may be.
#[derive(Clone, Debug, PartialEq)]
pub struct Solver {
    /// Which one.
    pub method: Method,
    /// Position-based fluids.
    pub pbf: Option<Pbf>,
    /// PIC/FLIP.
    pub flip: Option<flip::Flip>,
}

impl Solver {
    /// PBF's settings.
    ///
    /// # Panics
    /// Where there are none: only where PBF is chosen are they sure to be there.
    pub fn pbf(&self) -> &Pbf {
        self.pbf.as_ref().expect("a scene with [solver.pbf]")
    }

    /// FLIP's settings.
    ///
    /// # Panics
    /// Where there are none: only where FLIP is chosen are they sure to be there.
    pub fn flip(&self) -> &flip::Flip {
        self.flip.as_ref().expect("a scene with [solver.flip]")
    }
}

/// A solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Position-based fluids (Macklin and Müller 2013).
    Pbf,
    /// PIC/FLIP (Zhu and Bridson 2005).
    Flip,
}

impl Method {
    /// With the names that scenes use.
    pub const NAMED: [(&'static str, Self); 2] = [("pbf", Self::Pbf), ("flip", Self::Flip)];

    /// The override that chooses it.
    pub fn as_override(self) -> String {
        format!("solver.method={}", self.name())
    }

    /// As scenes name it.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
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
    /// ρ of the plain iteration, below 1, as the Chebyshev semi-iteration takes it; nearer to 1 reaches deeper.
    pub spectral_radius: f64,
    /// When an iteration stops.
    pub stop: Stop,
    /// Largest displacement in a substep, in units of d.
    pub cfl: f64,
    /// Factor on each correction (ω).
    pub relaxation: f64,
    /// k of the artificial pressure s_corr, with λ's natural scale as unit; 0 leaves it out.
    pub artificial_pressure: f64,
    /// Whether velocities are made free of divergence on a grid before particles move (Raveendran et al. 2011).
    pub grid_projection: bool,
    /// Most substeps in a frame; a scene that needs more is stopped, never stepped more coarsely.
    pub max_substeps: u32,
}

/// Order in which corrections are applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Iteration {
    /// All at once.
    Jacobi,
    /// One colour, then the other, which sees the corrected first.
    RedBlack,
    /// All at once, and carried on by a Chebyshev semi-iteration (Wang 2015).
    Chebyshev,
}

impl Iteration {
    /// With the names that scenes use.
    pub const NAMED: [(&'static str, Self); 3] = [
        ("jacobi", Self::Jacobi),
        ("red_black", Self::RedBlack),
        ("chebyshev", Self::Chebyshev),
    ];

    /// As scenes name it.
    pub fn name(self) -> &'static str {
        Self::NAMED[self as usize].0
    }
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

impl Stop {
    /// Iterations at most.
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
