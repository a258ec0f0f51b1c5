//! Screen-space fluid rendering: from particles to a picture.
//!
//! A frame is drawn from [`FrameInputs`]: its particles and those of the frames around it. For each
//! sample of the picture, solids are rasterised; particles are splatted as spheres into eye-space
//! depth and thickness, and blocks add the thickness of the water behind them; curvature flow or
//! the narrow-range filter smooths the depth; normals are differences of the depth; and each pixel
//! is shaded from the light that the water reflects and transmits. Samples differ in their position
//! within the pixel and in their instant within the shutter; where rays are cast, a sample is a
//! part of the shutter's time, in which each pixel's ray has an instant of its own. Their linear
//! radiance is averaged; depths never are.

mod aeration;
mod buffers;
mod camera;
mod caustics;
mod closed;
mod cloud;
pub mod colour;
pub mod cryptomatte;
mod foam;
mod frame;
mod hidden;
pub mod image;
mod in_frame;
mod inputs;
mod lighting;
mod materials;
mod moving;
mod neighbors;
mod opaque;
mod open;
mod paths;
mod plan;
mod portable;
mod rays;
mod renderer;
mod samples;
mod sea;
mod set;
mod shapes;
mod sky;
mod surface;
mod tiles;
mod tree;
mod uniform;
pub mod view;
mod wet;

use std::path::PathBuf;

use glam::DVec3;

use swell_domain::{
    bounds::Bounds, mesh::TriangleMesh, mesh_file::parts::MeshParts, open_waves::OpenWaves,
    pose::Pose,
};
use swell_gpu::adapter::GpuError;
use swell_scene::Wall;

pub use camera::{eye, lens};
pub use image::{Attributes, Image};
pub use inputs::{FrameInputs, REACH, WaterParticles, frames_around};
pub use moving::{Mover, PosePath, SetMotion};
pub use opaque::opaque;
pub use open::RayTimes;
pub use plan::{Limits, Plan, Runs};
pub use portable::{Daylight, SolidPaint, daylight, deep_reflectance, painted};
pub use renderer::{Part, Renderer};
pub use uniform::mirrors;
pub use wet::WetSolids;

/// Scene data that a picture needs besides the particles.
#[derive(Clone, Debug)]
pub struct RenderScene {
    /// Origin of the coordinates of domain, solids and particles in the look's world space, metres.
    pub origin: DVec3,
    /// Box that contains the water, metres; its least y is the ground's height.
    pub domain: Bounds,
    /// Meshes of the solids in world space, metres.
    pub solids: Vec<TriangleMesh>,
    /// Wetness of the solids; `None` where the look draws none.
    pub wet: Option<WetSolids>,
    /// Named parts of each mesh of `solids`; empty where the look names no materials.
    pub parts: Vec<SolidParts>,
    /// Particle spacing d, metres.
    pub particle_spacing: f64,
    /// Frames per second, which relate the shutter to seconds.
    pub frames_per_second: f64,
    /// Gravity, m/s².
    pub gravity: DVec3,
    /// Wave-making walls, with the distance of each inward from the domain's side, metres.
    pub wave_makers: Vec<(Wall, f64)>,
    /// Solids and wave makers that move: with an open shutter each sample shows them at its
    /// instant, and motion vectors lead to the next frame. What is not listed rests.
    pub moving: Vec<SetMotion>,
    /// Waves that enter from the open sea.
    pub waves: Option<OpenWaves>,
}

/// Names and parts of a solid, by which the look assigns materials.
#[derive(Clone, Debug)]
pub struct SolidParts {
    /// Name of the mesh's file without its extension.
    pub name: String,
    /// Parts to which the mesh's triangles belong.
    pub parts: MeshParts,
    /// Current pose of the solid.
    pub pose: Pose,
}

impl RenderScene {
    /// Longer horizontal side of the domain, metres; lengths of the surroundings scale with it.
    fn extent(&self) -> f64 {
        let size = self.domain.size();
        size.x.max(size.z)
    }

    /// Index in `moving` of what moves a part of the opaque geometry.
    fn motion_of(&self, mover: Mover) -> Option<usize> {
        self.moving.iter().position(|motion| motion.mover == mover)
    }
}

/// Reason why a picture cannot be rendered, read or written.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The GPU failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The sky panorama cannot be used.
    #[error("sky panorama: {0}")]
    Panorama(String),
    /// A material of the look cannot be used.
    #[error("material {index}: {problem}")]
    Material {
        /// Index in the look's materials.
        index: usize,
        /// Description of the problem.
        problem: String,
    },
    /// The scene cannot be drawn.
    #[error("render scene: {0}")]
    Scene(String),
    /// The camera is under water, and the screen-space method knows the surface only from above.
    #[error(
        "frame {frame}: the camera is under water, which method \"ssfr\" cannot draw: set \
         [renderer] method = \"ray\""
    )]
    UnderWater {
        /// Frame number.
        frame: u32,
    },
    /// A particle's position or velocity is not finite.
    #[error("particle {index} of frame {frame} has a position or velocity that is not finite")]
    NotFinite {
        /// Index of the particle in the frame.
        index: usize,
        /// Frame number.
        frame: u32,
    },
    /// The caller ended the drawing of the frame.
    #[error("frame {frame}: its drawing was ended")]
    Ended {
        /// Frame number.
        frame: u32,
    },
    /// A picture file could not be opened or written.
    #[error("{}: {source}", file.display())]
    Write {
        /// Path of the file.
        file: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A picture file could not be encoded or decoded.
    #[error("{}: {message}", file.display())]
    Format {
        /// Path of the file.
        file: PathBuf,
        /// Message of the image library.
        message: String,
    },
}
