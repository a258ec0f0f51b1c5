//! Screen-space fluid rendering: particles to a picture.
//!
//! A frame is drawn from a [`Moment`]: its particles, and those of the frames around it. A sample of the picture: solids are drawn; particles are splatted as spheres into an eye-space depth
//! and a thickness, to which the water behind them adds, in blocks; the depth is smoothed by curvature flow or the narrow-range filter; normals are
//! differences of it; every pixel is shaded from what the water mirrors and what it lets through. Samples
//! differ in their place in the pixel and in their instant within the shutter; linear radiance is
//! averaged, depths never are.

mod aeration;
mod buffers;
mod camera;
mod caustics;
mod closed;
mod cloud;
pub mod colour;
pub mod cryptomatte;
mod frame;
mod hidden;
pub mod image;
mod in_frame;
mod lighting;
mod materials;
mod moment;
mod neighbors;
mod opaque;
mod paths;
mod plan;
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

use std::path::PathBuf;

use glam::DVec3;

use swell_domain::{
    bounds::Bounds, mesh::TriangleMesh, mesh_file::parts::Parts, open_waves::OpenWaves, pose::Pose,
};
use swell_gpu::adapter::GpuError;
use swell_scene::Wall;

pub use camera::{eye, lens};
pub use image::{Attributes, Image};
pub use moment::{Moment, REACH, Water, frames_around};
pub use opaque::opaque;
pub use plan::{Limits, Plan, Runs};
pub use renderer::{Part, Renderer};
pub use uniform::mirrors;

/// What of a scene a picture needs beside the particles.
#[derive(Clone, Debug)]
pub struct RenderScene {
    /// Where the coordinates of domain, solids and particles have their zero in the world of the look, metres.
    pub origin: DVec3,
    /// The box that holds the water, metres; its least y is the ground's height.
    pub domain: Bounds,
    /// World space, metres.
    pub solids: Vec<TriangleMesh>,
    /// Parts of each of `solids`; nothing where the look names no materials.
    pub parts: Vec<SolidParts>,
    /// d, metres.
    pub particle_spacing: f64,
    /// Frames a second, which turns the shutter and velocities into metres.
    pub frames_per_second: f64,
    /// m/s².
    pub gravity: DVec3,
    /// Walls that make waves, and how far inward of the domain's side each stands, metres.
    pub wave_makers: Vec<(Wall, f64)>,
    /// Waves that come in from the sea.
    pub waves: Option<OpenWaves>,
}

/// What materials are told by.
#[derive(Clone, Debug)]
pub struct SolidParts {
    /// The name of the mesh's file without the ending.
    pub name: String,
    /// Of its triangles.
    pub parts: Parts,
    /// Where it stands.
    pub pose: Pose,
}

impl RenderScene {
    /// The domain's longer side on the ground, metres: what lies about the water has its lengths from it.
    fn extent(&self) -> f64 {
        let size = self.domain.size();
        size.x.max(size.z)
    }
}

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The sky panorama.
    #[error("sky panorama: {0}")]
    Panorama(String),
    /// A material of the look.
    #[error("material {index}: {problem}")]
    Material {
        /// Which of the look's.
        index: usize,
        /// What is wrong.
        problem: String,
    },
    /// A scene that cannot be drawn.
    #[error("render scene: {0}")]
    Scene(String),
    /// Screen space has no second side of the surface.
    #[error(
        "frame {frame}: the camera is under water, which method \"ssfr\" cannot draw: set [renderer] method = \"ray\""
    )]
    UnderWater {
        /// Frame number.
        frame: u32,
    },
    /// A particle whose position or velocity is not a number.
    #[error("particle {index} of frame {frame} has a position or velocity that is not finite")]
    NotFinite {
        /// Place in the frame.
        index: usize,
        /// Frame number.
        frame: u32,
    },
    /// A picture file could not be written.
    #[error("{}: {source}", file.display())]
    Write {
        /// Which.
        file: PathBuf,
        /// The system's words.
        source: std::io::Error,
    },
    /// A picture file could not be encoded or decoded.
    #[error("{}: {message}", file.display())]
    Format {
        /// Which.
        file: PathBuf,
        /// The library's words.
        message: String,
    },
}
