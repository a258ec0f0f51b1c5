//! What a look needs on a device, planned without rendering.

use std::path::PathBuf;

use glam::DVec3;

use super::{
    RenderJobError, Streams,
    near::{DrawnWater, Near},
    render_scene,
    set::FrameState,
    told,
};
use crate::{baked_scene, device::Gpu, prepare::Start};
use swell_cache::{CacheReader, LedgerEntry};
use swell_domain::{bounds::Bounds, particles::Particles};
use swell_gpu::adapter::{Context, GpuError, Needs};
use swell_render::{FrameInputs, Limits, Plan, RenderScene, Runs, WaterParticles};
use swell_scene::{Scene, look::Look};

/// What the camera sees in the plan.
#[derive(Debug)]
pub enum Subject {
    /// The look's own walls, and no water.
    Nothing,
    /// A scene at its start.
    Scene(Box<Scene>),
    /// A cache: its scene, and its frame with the most particles.
    Cache(PathBuf),
}

/// A look's plan, and the limits that it was made for.
#[derive(Debug)]
#[non_exhaustive]
pub struct LookPlan {
    /// Name of each pass, and how often it runs.
    pub passes: Vec<(&'static str, Runs)>,
    /// Name, size in texels, format and bytes of each texture.
    pub textures: Vec<(String, [u32; 2], String, u64)>,
    /// Name and bytes of each buffer.
    pub buffers: Vec<(String, u64)>,
    /// Total bytes.
    pub bytes: u64,
    /// Number of particles of the fullest frame; 0 without water.
    pub particles: usize,
    /// The frame whose water decides the sizes; `None` without water.
    pub frame: Option<u32>,
    /// The adapter whose limits were used; `None` if the machine has none.
    pub adapter: Option<String>,
    /// Warning about that adapter, as [`Context::software_warning`].
    pub software_warning: Option<String>,
    /// Why that adapter could not render it.
    pub misfit: Option<GpuError>,
}

/// Limits that every recent Vulkan adapter meets, for machines without an adapter.
const COMMON_LIMITS: Limits = Limits {
    storage: 128 << 20,
    texture: 8192,
    tile: 8192,
    is_narrow: false,
};

/// Plans what `look` needs to render `subject`, without allocating or compiling anything.
///
/// # Errors
/// Errors of the subject's scene or cache, or of the look's panorama; an adapter that does not
/// exist or open, or is software where hardware is required.
pub fn plan(look: &Look, subject: &Subject, gpu: &Gpu) -> Result<LookPlan, RenderJobError> {
    let context = match gpu.open(Needs::default()) {
        Ok(context) => Some(context),
        Err(GpuError::NoAdapter { .. }) if !gpu.is_hardware_required => None,
        Err(error) => return Err(error.into()),
    };
    let limits = context.as_ref().map_or(COMMON_LIMITS, Limits::of);
    let Planned {
        plan,
        particles,
        frame,
    } = Planned::of(look, subject, &limits)?;
    let misfit = context
        .as_ref()
        .and_then(|context| plan.check(context).err());
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
        frame,
        software_warning: context.as_ref().and_then(Context::software_warning),
        adapter: context.map(|context| context.info.name),
        misfit,
    })
}

/// A plan, and its particles and frame.
struct Planned {
    plan: Plan,
    particles: usize,
    frame: Option<u32>,
}

impl Planned {
    fn of(look: &Look, subject: &Subject, limits: &Limits) -> Result<Self, RenderJobError> {
        match subject {
            Subject::Nothing => {
                let plan = Plan::new(look, &empty(), limits).map_err(|error| told(error, look))?;
                Ok(Self {
                    plan,
                    particles: 0,
                    frame: None,
                })
            }
            Subject::Scene(scene) => {
                let start = Start::of(scene)?.particles.filled();
                let start = DrawnWater::of(scene).complete(0, start);
                let set = render_scene(scene, look, 0, &FrameState::alone(&start))?;
                let (water, white) = (WaterParticles::new(start), Particles::default());
                let inputs = FrameInputs::alone(&water, &white);
                Self::of_frame(look, &set, (0, &inputs), limits)
            }
            Subject::Cache(directory) => {
                let cache = CacheReader::open(directory)?;
                let frame = fullest(&cache);
                let scene = baked_scene(&cache, directory)?;
                let around = Near::new(&scene).around(&cache, look, frame)?;
                let streams = Streams::open(directory, look, &cache, &[frame])?;
                let white = streams.white(frame)?;
                let mut set = render_scene(&scene, look, frame, &around.state())?;
                set.wet = streams.wet(frame)?;
                let most = cache.entries().iter().map(|entry| entry.particles).max();
                Ok(Self {
                    particles: most.unwrap_or(0) as usize,
                    ..Self::of_frame(look, &set, (frame, &around.inputs(&white)), limits)?
                })
            }
        }
    }

    fn of_frame(
        look: &Look,
        set: &RenderScene,
        (frame, inputs): (u32, &FrameInputs<'_>),
        limits: &Limits,
    ) -> Result<Self, RenderJobError> {
        let plan = Plan::of_frame(look, set, frame, inputs, limits);
        Ok(Self {
            plan: plan.map_err(|error| told(error, look))?,
            particles: inputs.water.particles.len(),
            frame: Some(frame),
        })
    }
}

/// The frame with the most particles among those kept; of equal ones the fastest, whose surface is
/// usually the largest. The last frame if none is kept.
fn fullest(cache: &CacheReader) -> u32 {
    let speed = |entry: &LedgerEntry| entry.report["max_speed"].as_f64().unwrap_or(0.0);
    let kept = cache.entries().iter();
    let kept = kept.filter(|entry| cache.has_particles(entry.frame));
    let fullest = kept.max_by(|a, b| {
        let by_speed = speed(a).total_cmp(&speed(b));
        a.particles.cmp(&b.particles).then(by_speed)
    });
    fullest.map_or(cache.last_frame(), |entry| entry.frame)
}

/// An empty scene. Its size and spacing affect neither passes nor buffer sizes.
fn empty() -> RenderScene {
    RenderScene {
        origin: DVec3::ZERO,
        domain: Bounds {
            min: DVec3::ZERO,
            max: DVec3::ONE,
        },
        solids: Vec::new(),
        wet: None,
        parts: Vec::new(),
        particle_spacing: 1.0,
        frames_per_second: 1.0,
        gravity: DVec3::ZERO,
        wave_makers: Vec::new(),
        moving: Vec::new(),
        waves: None,
    }
}
