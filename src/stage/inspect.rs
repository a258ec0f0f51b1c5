//! `inspect`: adapters, a scene's plan, a cache's frames.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use crate::{
    cache::{CacheError, CacheReader},
    domain::signed_distance::SignedDistanceError,
    gpu::{
        adapter::{Context, GpuError, enumerate},
        program::check_sizes,
    },
    scene::Scene,
    solve::plan::{DeviceLimits, LIST_BUDGET, Plan, device_limits},
};

use super::{Blame, device::needs, prepare::Start, probes};

pub use crate::cache::{
    Entry, Manifest,
    stream::{PARTICLES, PROBES},
};

/// One adapter of this machine.
#[derive(Clone, Debug)]
pub struct Adapter {
    /// As `--adapter` takes it.
    pub index: usize,
    /// Name.
    pub name: String,
    /// Backend and kind.
    pub kind: String,
    /// Driver and its version.
    pub driver: String,
    /// Limits that bear on scenes and pictures: name, value.
    pub limits: Vec<(&'static str, u64)>,
    /// Whether passes can be timed on it.
    pub has_timestamps: bool,
    /// Whether passes may compute in f64 on it.
    pub has_f64: bool,
}

/// All adapters.
///
/// # Errors
/// [`GpuError::NoAdapter`].
pub fn adapters() -> Result<Vec<Adapter>, GpuError> {
    let found: Vec<Adapter> = enumerate()
        .iter()
        .enumerate()
        .map(|(index, adapter)| {
            let (info, limits) = (adapter.get_info(), adapter.limits());
            Adapter {
                index,
                name: info.name,
                kind: format!("{}, {:?}", info.backend, info.device_type),
                driver: format!("{} {}", info.driver, info.driver_info),
                limits: vec![
                    (
                        "max_storage_buffer_binding_size",
                        limits.max_storage_buffer_binding_size,
                    ),
                    ("max_buffer_size", limits.max_buffer_size),
                    (
                        "max_compute_workgroups_per_dimension",
                        limits.max_compute_workgroups_per_dimension.into(),
                    ),
                    (
                        "max_storage_buffers_per_shader_stage",
                        limits.max_storage_buffers_per_shader_stage.into(),
                    ),
                    (
                        "max_texture_dimension_2d",
                        limits.max_texture_dimension_2d.into(),
                    ),
                ],
                has_timestamps: crate::gpu::adapter::has_timestamps(adapter),
                has_f64: crate::gpu::adapter::has_f64(adapter),
            }
        })
        .collect();
    if found.is_empty() {
        Err(GpuError::NoAdapter)
    } else {
        Ok(found)
    }
}

/// A scene's plan, and for which limits it was made.
#[derive(Debug)]
pub struct ScenePlan {
    /// Passes and buffers.
    pub plan: Plan,
    /// Left out of the water because a solid is there.
    pub removed: usize,
    /// The adapter whose limits were used; `None` where the machine has none.
    pub adapter: Option<String>,
    /// Why that adapter could not bake it.
    pub misfit: Option<GpuError>,
}

/// Limits that every Vulkan adapter of the last years has, for machines without any.
const COMMON_LIMITS: DeviceLimits = DeviceLimits {
    binding: 128 << 20,
    buffer: 256 << 20,
    list_budget: LIST_BUDGET,
};

/// Why a scene could not be planned.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// The scene's solids.
    #[error(transparent)]
    Solid(#[from] SignedDistanceError),
    /// The adapter asked for.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

impl From<&PlanError> for Blame {
    fn from(error: &PlanError) -> Self {
        match error {
            PlanError::Solid(error) => error.into(),
            PlanError::Gpu(error) => error.into(),
        }
    }
}

/// Plans a scene without allocating or compiling anything.
///
/// # Errors
/// A solid without inside, or too large a grid; an adapter that is not there or does not open.
pub fn plan(scene: &Scene, adapter: Option<&str>) -> Result<ScenePlan, PlanError> {
    let start = Start::of(scene)?;
    let mut lacks = None;
    let context = match Context::open_for(adapter, needs(scene)) {
        Ok(context) => Some(context),
        Err(GpuError::NoAdapter) => None,
        Err(error @ GpuError::NoF64 { .. }) => {
            lacks = Some(error);
            Some(Context::open(adapter)?)
        }
        Err(error) => return Err(error.into()),
    };
    let limits = context.as_ref().map_or(COMMON_LIMITS, device_limits);
    let plan = start.shown_plan(scene, limits);
    let misfit = context
        .as_ref()
        .and_then(|context| {
            let mut parts = plan.parts();
            parts.find_map(|part| check_sizes(context, &part.buffer_specs()).err())
        })
        .or(lacks);
    Ok(ScenePlan {
        plan,
        misfit,
        removed: start.removed,
        adapter: context.map(|context| context.info.name),
    })
}

/// A cache's manifest and ledger.
///
/// # Errors
/// [`CacheError`].
pub fn cache(directory: &Path) -> Result<(Manifest, Vec<Entry>), CacheError> {
    let reader = CacheReader::open(directory)?;
    Ok((reader.manifest().clone(), reader.entries().to_vec()))
}

/// Why a cache's probes could not be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// The cache.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// It was baked without any.
    #[error("{} has no probes to plot: its scene has no [[probe]]", .0.display())]
    NoProbes(PathBuf),
    /// A picture.
    #[error("cannot write {}", file.display())]
    Write {
        /// The file or folder.
        file: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

impl From<&PlotError> for Blame {
    fn from(error: &PlotError) -> Self {
        match error {
            PlotError::NoProbes(_) => Self::Input,
            PlotError::Cache(_) | PlotError::Write { .. } => Self::Files,
        }
    }
}

/// Draws what a cache's probes saw over time, an SVG a probe, into `folder`; gives the files.
///
/// # Errors
/// [`PlotError`].
pub fn plot(directory: &Path, folder: &Path) -> Result<Vec<PathBuf>, PlotError> {
    let reader = CacheReader::open(directory)?;
    let manifest = reader.manifest();
    if manifest.probes.is_empty() {
        return Err(PlotError::NoProbes(directory.to_owned()));
    }
    let fault = |file: &Path| {
        let file = file.to_owned();
        move |source| PlotError::Write { file, source }
    };
    fs::create_dir_all(folder).map_err(fault(folder))?;
    let mut files = Vec::new();
    for (index, record) in manifest.probes.iter().enumerate() {
        let chart = probes::chart(&manifest.shot, record, index, reader.entries());
        let file = folder.join(format!("{}.svg", record.name));
        fs::write(&file, chart.to_svg()).map_err(fault(&file))?;
        files.push(file);
    }
    Ok(files)
}
