//! `inspect`: adapters, a scene's plan, a cache's frames, what a study runs, what a file is.

pub mod file;
pub mod study;

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use swell_cache::{CacheError, CacheReader, stream::Stream};
use swell_domain::{signed_distance::SignedDistanceError, sources::Promise};
use swell_gpu::{
    adapter::{Context, GpuError, enumerate},
    program::check_sizes,
};
use swell_scene::{Scene, SceneError};
use swell_solve::plan::{DeviceLimits, Plan, device_limits};

use super::{
    Blame,
    device::needs,
    prepare::{Start, Volume},
    probes, whitewater,
};

pub use swell_scene::solid_grid::MOST_NODES;
pub use swell_solve::plan::LIST_BUDGET;

pub use swell_cache::{
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
                has_timestamps: swell_gpu::adapter::has_timestamps(adapter),
                has_f64: swell_gpu::adapter::has_f64(adapter),
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
    /// At the start.
    pub particles: usize,
    /// Left out of the water because a solid is there.
    pub removed: usize,
    /// Water at the start.
    pub volume: Volume,
    /// What emitters bring with solids as they stand at the start; `None` of those that keep a level.
    pub promises: Vec<Option<Promise>>,
    /// Particles that emitters without a level bring until the shot's end, at most; `None` where there are none.
    pub entering: Option<f64>,
    /// What a user has to know of the scene, a sentence each.
    pub warnings: Vec<String>,
    /// Metres between the nodes of the solids' signed distance, where it is coarser than the water so as not to have more than
    /// [`MOST_NODES`].
    pub coarse_solids: Option<f64>,
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
    let promises = start.promises();
    let most = start.sources.most_entering(scene.shot.duration());
    let entering = promises.iter().zip(most).filter_map(|(promise, most)| {
        // Where nothing is in the way, to the particle.
        Some((most? as f64 * promise.as_ref()?.open).ceil())
    });
    let entering: f64 = entering.sum();
    let distance = start.boundary.distance.as_ref();
    let spacing = distance.map(|distance| distance.spacing);
    Ok(ScenePlan {
        coarse_solids: spacing.filter(|&spacing| spacing > scene.particle_spacing()),
        plan,
        misfit,
        particles: start.particles.len(),
        removed: start.removed,
        volume: start.volume(scene),
        warnings: start.warnings(scene),
        entering: scene.has_inlets().then_some(entering),
        promises,
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

/// What a cache takes.
#[derive(Debug)]
pub struct CacheSizes {
    /// Of all its files.
    pub bytes: u64,
    /// Each kind of file that it keeps of frames: name, bytes.
    pub streams: Vec<(&'static str, u64)>,
    /// Its streams of whitewater: name, last frame, bytes, which are among the cache's.
    pub whitewater: Vec<(String, u32, u64)>,
    /// What its solver takes on a device with common limits, as planned for its start; `None` of a stream of whitewater.
    pub device_bytes: Option<u64>,
    /// Wall clock of its frames as they were baked, where that is known, seconds.
    pub seconds: Vec<f64>,
}

/// Why a cache's sizes are not known.
#[derive(Debug, thiserror::Error)]
pub enum SizesError {
    /// The cache.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The scene in it.
    #[error("the cache's scene: {0}")]
    Scene(#[from] SceneError),
    /// Its solids.
    #[error(transparent)]
    Solid(#[from] SignedDistanceError),
    /// A folder that cannot be read.
    #[error("cannot read {}", folder.display())]
    Read {
        /// Which.
        folder: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

impl From<&SizesError> for Blame {
    fn from(_: &SizesError) -> Self {
        Self::Files
    }
}

/// What a cache takes on the disk and on a device.
///
/// # Errors
/// [`SizesError`].
pub fn sizes(directory: &Path) -> Result<CacheSizes, SizesError> {
    let reader = CacheReader::open(directory)?;
    let device_bytes = match reader.manifest().is_whitewater() {
        true => None,
        false => {
            let scene = super::baked_scene(&reader, directory)?;
            let start = Start::of_cache::<SizesError>(&scene, &reader)?;
            Some(start.shown_plan(&scene, COMMON_LIMITS).bytes().0)
        }
    };
    let mut streams = Vec::new();
    for stream in Stream::all(reader.manifest()) {
        streams.push((stream.name, folder_bytes(&directory.join(stream.folder))?));
    }
    let mut of_whitewater = Vec::new();
    for folder in whitewater_folders(directory)? {
        let stream = CacheReader::open(&folder)?;
        let name = folder.file_name().unwrap_or_default();
        let bytes = folder_bytes(&folder)?;
        of_whitewater.push((
            name.to_string_lossy().into_owned(),
            stream.last_frame(),
            bytes,
        ));
    }
    Ok(CacheSizes {
        bytes: folder_bytes(directory)?,
        streams,
        whitewater: of_whitewater,
        device_bytes,
        seconds: reader.seconds()?.into_values().collect(),
    })
}

/// Folders of a cache's streams of whitewater, by name.
fn whitewater_folders(cache: &Path) -> Result<Vec<PathBuf>, SizesError> {
    let folder = cache.join(whitewater::FOLDER);
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let paths = fs::read_dir(&folder).and_then(|found| {
        let paths = found.map(|entry| Ok(entry?.path()));
        paths.collect::<io::Result<Vec<_>>>()
    });
    let mut streams = paths.map_err(|source| unread(&folder, source))?;
    streams.retain(|it| swell_cache::exists(it));
    streams.sort();
    Ok(streams)
}

fn unread(folder: &Path, source: io::Error) -> SizesError {
    SizesError::Read {
        folder: folder.to_owned(),
        source,
    }
}

/// Bytes of all files below a folder; 0 where there is none.
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
