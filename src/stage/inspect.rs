//! `inspect`: describes adapters, a scene's plan, a cache's frames, the runs of a study, or a file.

pub mod file;
pub mod study;

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use swell_cache::{CacheError, CacheReader, stream::Stream};
use swell_domain::{
    output::{self, FileError},
    signed_distance::SignedDistanceError,
};
use swell_gpu::adapter::{Context, GpuError, Needs, enumerate, no_adapter};
use swell_scene::SceneError;
use swell_solve::plan::{DeviceLimits, Plan, device_limits};

use super::{
    Blame,
    bake::BakePlan,
    device::{Gpu, needs},
    prepare::Start,
    probes, wet, whitewater,
};

pub use swell_scene::solid_grid::MOST_NODES;
pub use swell_solve::plan::LIST_BUDGET;

pub use swell_gpu::rounding::Rounding;

pub use swell_cache::{
    LedgerEntry, Manifest,
    stream::{PARTICLES, PROBES},
};

/// An adapter of this machine.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Adapter {
    /// Number of the adapter, by which a request can name it.
    pub index: usize,
    /// Name of the adapter.
    pub name: String,
    /// Backend and device type.
    pub kind: String,
    /// Driver and its version.
    pub driver: String,
    /// Names and values of the limits that matter for scenes and pictures.
    pub limits: Vec<(&'static str, u64)>,
    /// Whether it supports timestamps, so that passes can be timed.
    pub has_timestamps: bool,
    /// Whether its shaders support f64.
    pub has_f64: bool,
    /// How it rounds, or why that could not be measured.
    pub rounding: Result<Rounding, String>,
}

/// Lists all adapters, and opens each for a moment to measure its rounding.
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
                has_timestamps: swell_gpu::adapter::has_timestamps(adapter),
                has_f64: swell_gpu::adapter::has_f64(adapter),
                rounding: Context::open(Some(&index.to_string()))
                    .and_then(|context| context.rounding())
                    .map_err(|error| error.to_string()),
            }
        })
        .collect();
    if found.is_empty() {
        Err(no_adapter())
    } else {
        Ok(found)
    }
}

/// A bake's plan, with the passes and buffers that an adapter would need for it.
#[derive(Debug)]
pub struct ScenePlan<'a> {
    /// What is known without a device.
    pub bake: BakePlan<'a>,
    /// Passes and buffers.
    pub plan: Plan,
    /// The adapter whose limits were used; `None` if the machine has none.
    pub adapter: Option<String>,
    /// Warning about that adapter, as [`Context::software_warning`].
    pub software_warning: Option<String>,
    /// Why that adapter could not bake the scene.
    pub misfit: Option<GpuError>,
}

impl ScenePlan<'_> {
    /// Node spacing of the solids' signed distance, metres, if the limit of [`MOST_NODES`] makes it
    /// coarser than the particle spacing.
    pub fn coarse_solids(&self) -> Option<f64> {
        let distance = self.bake.start.boundary.distance.as_ref();
        let spacing = distance.map(|distance| distance.spacing);
        spacing.filter(|&spacing| spacing > self.bake.scene.particle_spacing())
    }
}

/// Limits that every recent Vulkan adapter meets, for machines without an adapter.
const COMMON_LIMITS: DeviceLimits = DeviceLimits {
    binding: 128 << 20,
    buffer: 256 << 20,
    list_budget: LIST_BUDGET,
};

/// Plans the passes of a bake without allocating or compiling anything.
///
/// # Errors
/// An adapter that does not exist or open, or is software where hardware is required.
pub fn plan<'a>(bake: BakePlan<'a>, gpu: &Gpu) -> Result<ScenePlan<'a>, GpuError> {
    let scene = bake.scene;
    let mut lacks = None;
    let context = match gpu.open(needs(scene)) {
        Ok(context) => Some(context),
        Err(GpuError::NoAdapter { .. }) if !gpu.is_hardware_required => None,
        Err(error @ GpuError::NoF64 { .. }) => {
            lacks = Some(error);
            Some(gpu.open(Needs::default())?)
        }
        Err(error) => return Err(error),
    };
    let limits = context.as_ref().map_or(COMMON_LIMITS, device_limits);
    let plan = bake.start.shown_plan(scene, limits);
    let unfit = context
        .as_ref()
        .and_then(|context| plan.check(context).err());
    let misfit = unfit.or(lacks);
    Ok(ScenePlan {
        bake,
        plan,
        misfit,
        software_warning: context.as_ref().and_then(Context::software_warning),
        adapter: context.map(|context| context.info.name),
    })
}

/// Reads a cache's manifest and ledger.
///
/// # Errors
/// [`CacheError`].
pub fn cache(directory: &Path) -> Result<(Manifest, Vec<LedgerEntry>), CacheError> {
    let reader = CacheReader::open(directory)?;
    Ok((reader.manifest().clone(), reader.entries().to_vec()))
}

/// Sizes of a cache on disk and on a device.
#[derive(Debug)]
#[non_exhaustive]
pub struct CacheSizes {
    /// Bytes of all its files.
    pub bytes: u64,
    /// Name and bytes of each stream of frames.
    pub streams: Vec<(&'static str, u64)>,
    /// Name, last frame and bytes of each whitewater stream; the bytes are included in the cache's.
    pub whitewater: Vec<(String, u32, u64)>,
    /// The same of each stream of the wetness of solids.
    pub wet: Vec<(String, u32, u64)>,
    /// Predicted device memory of its solver at the start, under common limits; `None` for a
    /// stream made from a bake.
    pub device_bytes: Option<u64>,
    /// Wall-clock seconds of its frames as they were baked, where known.
    pub seconds: Vec<f64>,
}

/// Why a cache's sizes could not be determined.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SizesError {
    /// Reading the cache failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The scene in the cache is invalid.
    #[error("the cache's scene: {0}")]
    Scene(#[from] SceneError),
    /// A solid without an inside, or too large a distance grid.
    #[error(transparent)]
    Solid(#[from] SignedDistanceError),
    /// A folder that cannot be read.
    #[error("cannot read {}", folder.display())]
    Read {
        /// The folder.
        folder: PathBuf,
        /// The system's error.
        source: io::Error,
    },
}

impl From<&SizesError> for Blame {
    fn from(_: &SizesError) -> Self {
        Self::Files
    }
}

/// Determines the disk and device memory of a cache.
///
/// # Errors
/// [`SizesError`].
pub fn sizes(directory: &Path) -> Result<CacheSizes, SizesError> {
    let reader = CacheReader::open(directory)?;
    let device_bytes = match reader.manifest().stream_of() {
        Some(_) => None,
        None => {
            let scene = super::baked_scene(&reader, directory)?;
            let start = Start::of_cache::<SizesError>(&scene, &reader)?;
            Some(start.shown_plan(&scene, COMMON_LIMITS).bytes().0)
        }
    };
    let mut streams = Vec::new();
    for stream in Stream::all(reader.manifest()) {
        streams.push((stream.name, folder_bytes(&directory.join(stream.folder))?));
    }
    Ok(CacheSizes {
        bytes: folder_bytes(directory)?,
        streams,
        whitewater: made_streams(directory, whitewater::FOLDER)?,
        wet: made_streams(directory, wet::FOLDER)?,
        device_bytes,
        seconds: reader.seconds()?.into_values().collect(),
    })
}

/// Name, last frame and bytes of each stream in a folder of a cache, sorted by name.
fn made_streams(cache: &Path, folder: &str) -> Result<Vec<(String, u32, u64)>, SizesError> {
    let folder = cache.join(folder);
    let mut streams = output::paths(&folder).map_err(|error| unread(&error.path, error.source))?;
    streams.retain(|it| swell_cache::exists(it));
    let of = |folder: &PathBuf| {
        let stream = CacheReader::open(folder)?;
        let name = folder.file_name().unwrap_or_default();
        let name = name.to_string_lossy().into_owned();
        Ok((name, stream.last_frame(), folder_bytes(folder)?))
    };
    streams.iter().map(of).collect()
}

fn unread(folder: &Path, source: io::Error) -> SizesError {
    SizesError::Read {
        folder: folder.to_owned(),
        source,
    }
}

/// Bytes of all files below a folder; 0 if it does not exist.
fn folder_bytes(folder: &Path) -> Result<u64, SizesError> {
    let fault = |source| unread(folder, source);
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(0),
        other => other.map_err(fault)?,
    };
    let mut bytes = 0;
    for entry in entries {
        let entry = entry.map_err(fault)?;
        // Links are not followed.
        let meta = entry.metadata().map_err(fault)?;
        bytes += match meta.is_dir() {
            true => folder_bytes(&entry.path())?,
            false => meta.len(),
        };
    }
    Ok(bytes)
}

/// Why a cache's probes could not be plotted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlotError {
    /// Reading the cache failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The cache was baked without probes.
    #[error("{} has no probes to plot: its scene has no [[probe]]", .0.display())]
    NoProbes(PathBuf),
    /// A plot that cannot be written.
    #[error("cannot write {}", file.display())]
    Write {
        /// The file or folder.
        file: PathBuf,
        /// The system's error.
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

/// Plots the values of a cache's probes over time into `folder`, one SVG per probe. Returns the
/// files.
///
/// # Errors
/// [`PlotError`].
pub fn plot(directory: &Path, folder: &Path) -> Result<Vec<PathBuf>, PlotError> {
    let reader = CacheReader::open(directory)?;
    let manifest = reader.manifest();
    if manifest.probes.is_empty() {
        return Err(PlotError::NoProbes(directory.to_owned()));
    }
    let fault = |error: FileError| PlotError::Write {
        file: error.path,
        source: error.source,
    };
    output::create_folder(folder).map_err(fault)?;
    let mut files = Vec::new();
    for (index, record) in manifest.probes.iter().enumerate() {
        let chart = probes::chart(&manifest.shot, record, index, reader.entries());
        let file = folder.join(format!("{}.svg", record.name));
        output::write(&file, chart.to_svg()).map_err(fault)?;
        files.push(file);
    }
    Ok(files)
}
