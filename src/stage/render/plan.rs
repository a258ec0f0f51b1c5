//! What a look needs on a device, planned without rendering.

use std::path::PathBuf;

use glam::DVec3;

use super::{RenderJobError, render_scene, told};
use crate::{baked_scene, prepare::Start};
use swell_cache::CacheReader;
use swell_domain::{bounds::Bounds, particles::Particles};
use swell_gpu::{
    adapter::{Context, GpuError},
    program::check_sizes,
};
use swell_render::{Limits, Plan, RenderScene, Runs};
use swell_scene::{Scene, look::Look};

/// What is planned to stand before the camera.
#[derive(Debug)]
pub enum Subject {
    /// The look's own walls, and no water.
    Nothing,
    /// A scene at its start.
    Scene(Box<Scene>),
    /// A cache: its scene, and the most particles of a frame.
    Cache(PathBuf),
}

/// A look's plan, and for which limits it was made.
#[derive(Debug)]
pub struct LookPlan {
    /// Passes with how often each runs, by name.
    pub passes: Vec<(&'static str, Runs)>,
    /// Textures: name, texels along each side, format, bytes.
    pub textures: Vec<(String, [u32; 2], String, u64)>,
    /// Buffers with their bytes.
    pub buffers: Vec<(String, u64)>,
    /// Of all of them.
    pub bytes: u64,
    /// Particles of the frame with the most; 0 without water.
    pub particles: usize,
    /// The adapter whose limits were used; `None` where the machine has none.
    pub adapter: Option<String>,
    /// Why that adapter could not render it.
    pub misfit: Option<GpuError>,
}

/// Limits that every Vulkan adapter of the last years has, for machines without any.
const COMMON_LIMITS: Limits = Limits {
    storage: 128 << 20,
    texture: 8192,
    tile: 8192,
    is_narrow: false,
};

/// Plans what `look` needs to render `subject`, without allocating or compiling anything.
///
/// # Errors
/// The subject's scene or cache; the look's panorama; an adapter that is not there or does not open.
pub fn plan(
    look: &Look,
    subject: &Subject,
    adapter: Option<&str>,
) -> Result<LookPlan, RenderJobError> {
    let context = match Context::open(adapter) {
        Ok(context) => Some(context),
        Err(GpuError::NoAdapter) => None,
        Err(error) => return Err(error.into()),
    };
    let limits = context.as_ref().map_or(COMMON_LIMITS, Limits::of);
    let (scene, particles) = match subject {
        Subject::Nothing => (empty(), 0),
        Subject::Scene(scene) => {
            let start = Start::of(scene)?;
            (
                render_scene(scene, look, 0, &start.particles)?,
                start.particles.len(),
            )
        }
        Subject::Cache(directory) => {
            let cache = CacheReader::open(directory)?;
            let most = cache.entries().iter().map(|entry| entry.particles).max();
            let scene = baked_scene(&cache, directory)?;
            let first = cache.first_frame();
            let still = Particles::default();
            (
                render_scene(&scene, look, first, &still)?,
                most.unwrap_or(0) as usize,
            )
        }
    };
    let plan = Plan::new(look, &scene, particles, &limits).map_err(|error| told(error, look))?;
    let misfit = context
        .as_ref()
        .and_then(|context| check_sizes(context, &plan.buffers).err());
    let textures = plan.textures.iter().map(|texture| {
        let format = format!("{:?}", texture.format);
        (texture.name.clone(), texture.size, format, texture.bytes())
    });
    let buffers = plan.buffers.iter();
    Ok(LookPlan {
        passes: plan.passes().into_iter().collect(),
        textures: textures.collect(),
        buffers: buffers
            .map(|buffer| (buffer.name.clone(), buffer.bytes))
            .collect(),
        bytes: plan.bytes(),
        particles,
        adapter: context.map(|context| context.info.name),
        misfit,
    })
}

/// A scene of nothing. Its size and spacing decide no pass and no size of a buffer.
fn empty() -> RenderScene {
    RenderScene {
        origin: DVec3::ZERO,
        domain: Bounds {
            min: DVec3::ZERO,
            max: DVec3::ONE,
        },
        solids: Vec::new(),
        parts: Vec::new(),
        particle_spacing: 1.0,
        frames_per_second: 1.0,
        gravity: DVec3::ZERO,
        wave_makers: Vec::new(),
        waves: None,
    }
}
