//! `whitewater`: makes spray, foam and bubbles from a finished bake, as a stream beside it. The
//! bake is only read.
//!
//! A stream is a cache of its own in `CACHE/whitewater/NAME`. Its frames are checkpoints, so it can
//! be resumed, and the same bake, settings and adapter give the same bytes.

mod checked;
mod engine;
mod error;
mod expected;
mod forecast;
mod idle;
mod settled;

use std::{
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, Ordering},
    time::Instant,
};

use serde_json::{Value, json};

use swell_cache::{Asset, CacheError, CacheReader, CacheWriter, Clock, Manifest};
use swell_domain::{
    bounds::Bounds,
    mesh_file,
    particles::Particles,
    whitewater::{self, Births, CompleteSettings, KillDomain, KillRoom, SeedWater},
};
use swell_files::whitewater::{WhitewaterSettings, kill_asset, written_out};
use swell_gpu::adapter::Needs;
use swell_scene::Scene;

use super::{
    derived::{self, WATER, water::WaterReader},
    device::{Device, Identity, PassTimes},
    prepare::Start,
};

use self::{
    engine::Engine,
    forecast::Forecast,
    settled::{recorded, settle},
};

pub use self::{
    checked::Stream,
    error::WhitewaterError,
    expected::{ExpectedWhitewater, expected},
    forecast::LimitForecast,
};

/// Folder of the streams in a cache.
pub(super) const FOLDER: &str = "whitewater";
/// Name of the asset with the complete settings of a stream.
const SETTINGS: &str = "whitewater.toml";
/// What to make.
#[derive(Clone, Debug)]
pub struct WhitewaterRequest {
    /// Directory of the bake's cache.
    pub cache: PathBuf,
    /// Name of the stream.
    pub name: String,
    /// Settings; the shot determines those that are left open.
    pub settings: WhitewaterSettings,
    /// Last frame to make; the bake's last if `None`.
    pub last: Option<u32>,
    /// Whether to remove an existing stream of this name that was made differently.
    pub overwrite: bool,
    /// Device to compute on.
    pub device: Device,
    /// Whether to time passes, which runs them one by one.
    pub time_passes: bool,
}

/// Progress of a running job.
#[derive(Clone, Debug)]
pub enum WhitewaterEvent {
    /// The device is open, and the settings are complete.
    Ready {
        /// Adapter and driver, or the f64 reference.
        device: Identity,
        /// Warning about the adapter, as [`crate::device::Opened::software_warning`].
        software_warning: Option<String>,
        /// Warnings about kill volumes that end nothing.
        warnings: Vec<String>,
        /// Number of water particles.
        water: usize,
        /// Directory of the stream.
        directory: PathBuf,
        /// Born of a cubic metre that water closes, 1/m³, and a second of one in crests, 1/(m³ s).
        rates: [f64; 2],
        /// Whether the settings leave values open, which follow from how much water the shot has.
        is_of_shot: bool,
        /// First frame that will be computed.
        first: u32,
        /// Last frame that will be computed.
        last: u32,
    },
    /// A frame was computed.
    Frame {
        /// Number of the frame.
        frame: u32,
        /// Number of spray, foam and bubble particles.
        census: [usize; 3],
        /// Number of new particles.
        born: usize,
        /// Wall-clock time it took, seconds.
        seconds: f64,
    },
    /// If growth continues, there will be more particles than the settings allow. Sent at most
    /// once.
    LimitForecast(LimitForecast),
    /// The frames computed by this run are on the disk. Also sent before the error if a later frame
    /// failed.
    Written {
        /// Bytes written by this run.
        bytes: u64,
    },
}

/// Result of a job.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct WhitewaterOutcome {
    /// Last frame in the stream.
    pub last_frame: u32,
    /// Number of frames computed by this run.
    pub frames: u32,
    /// Bytes of frames written by this run.
    pub bytes: u64,
    /// Directory of the stream.
    pub directory: PathBuf,
    /// Whether a signal ended it.
    pub interrupted: bool,
    /// Times by pass name; empty unless requested.
    pub passes: PassTimes,
}

/// Folder of a stream of a cache.
pub fn directory(cache: &Path, name: &str) -> PathBuf {
    cache.join(FOLDER).join(name)
}

/// Makes a stream, or resumes an existing one. `tell` receives progress events, and setting `stop`
/// ends the job after the current frame.
///
/// # Errors
/// [`WhitewaterError`]; the frames that were completed before are in the stream.
pub fn whitewater(
    request: &WhitewaterRequest,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(WhitewaterEvent),
) -> Result<WhitewaterOutcome, WhitewaterError> {
    let (cache, last) = derived::bake(&request.cache, request.last)?;
    let directory = directory(&request.cache, &request.name);
    let scene = super::baked_scene(&cache, &request.cache)?.of_whitewater();
    if scene.frame.is_some() {
        return Err(WhitewaterError::Moves {
            cache: request.cache.clone(),
        });
    }
    let mut water = WaterReader::of(&cache, scene.period());
    let begin = water.at(cache.first_frame())?;
    let particles = begin.len();
    let boundary = Start::with(&scene, begin)?.boundary;
    let opened = request.device.open(Needs::default())?;
    let opened = opened.counting(request.time_passes);
    let identity = opened.identity();
    let mut engine = Engine::new(&opened, &scene, &boundary, particles, request.time_passes)?;
    let manifest = manifest(&cache, request, &identity)?;
    let hash = &manifest.scene_hash;
    let standing = derived::standing(&directory, hash, request.overwrite)?;
    let settings = match &standing {
        Some(stream) => recorded(stream, &directory)?,
        None => settle(&request.settings, &scene, &cache, particles)?,
    };
    engine.set(&settings)?;
    let mut stream = match standing {
        Some(_) => StreamWriter::resume(&directory, &manifest, &cache)?,
        None => {
            derived::remove(&directory)?;
            StreamWriter::create(&directory, manifest, &cache, &settings)?
        }
    };
    tell(WhitewaterEvent::Ready {
        device: identity,
        software_warning: opened.software_warning(),
        warnings: idle::idle_kills(&settings.kills, &scene),
        water: particles,
        directory: directory.clone(),
        rates: [settings.trapped_air_rate, settings.wave_crest_rate],
        is_of_shot: !request.settings.is_complete(),
        first: stream.clock.frame + 1,
        last,
    });
    let mut interrupted = false;
    let mut forecast = Forecast::new(settings.max_particles, last, stream.white.len());
    while stream.clock.frame < last {
        interrupted = stop.load(Ordering::Relaxed);
        if interrupted {
            break;
        }
        let began = Instant::now();
        let step = StreamStep {
            settings: &settings,
            scene: &scene,
            cache: &cache,
        };
        match step.run(&mut stream, &mut engine, &mut water) {
            Ok(born) => {
                let frame = stream.clock.frame;
                tell(WhitewaterEvent::Frame {
                    frame,
                    census: whitewater::census(&stream.white),
                    born,
                    seconds: began.elapsed().as_secs_f64(),
                });
                if let Some(crowding) = forecast.see(frame, stream.white.len()) {
                    tell(WhitewaterEvent::LimitForecast(crowding));
                }
            }
            Err(error) => {
                // What was computed before a failure is kept.
                let bytes = stream.writer.finish()?.bytes;
                tell(WhitewaterEvent::Written { bytes });
                return Err(error);
            }
        }
    }
    let summary = stream.writer.finish()?;
    tell(WhitewaterEvent::Written {
        bytes: summary.bytes,
    });
    Ok(WhitewaterOutcome {
        last_frame: summary.last_frame,
        frames: summary.frames,
        bytes: summary.bytes,
        directory,
        interrupted,
        passes: match request.time_passes {
            true => opened.pass_times(engine.times())?,
            false => PassTimes::default(),
        },
    })
}

/// Computes a frame of a stream from the one before.
struct StreamStep<'a> {
    settings: &'a CompleteSettings,
    scene: &'a Scene,
    cache: &'a CacheReader,
}

impl StreamStep<'_> {
    /// Runs the step and returns the number of new particles.
    fn run(
        &self,
        stream: &mut StreamWriter,
        engine: &mut Engine,
        water: &mut WaterReader<'_>,
    ) -> Result<usize, WhitewaterError> {
        let frame = stream.clock.frame + 1;
        let before = stream.clock.time;
        let clock = Clock {
            substeps: 1,
            steps: stream.clock.steps + 1,
            ..self.cache.entry(frame)?.clock
        };
        let seconds = clock.time - before;
        let mut now = water.at(frame)?;
        now.walls = clock.walls;
        now.bodies.clone_from(&self.cache.entry(frame)?.bodies);
        let potentials = engine.survey(&now, clock.time, seconds)?;
        let mut white = stream.white.clone();
        engine.advance(&mut white, frame)?;
        let spacing = self.scene.particle_spacing();
        let mut died = whitewater::grow_older(self.settings, &mut white, spacing, seconds);
        let domain = KillDomain {
            origin: self.scene.origin,
            bounds: self.scene.domain,
            periodic: self.scene.periodic,
        };
        let kills = &self.settings.kills;
        died += whitewater::kill(kills, &domain, clock.time, &mut white);
        let corner = self.scene.domain.min;
        let walls = self.scene.walls(&now.walls, clock.time);
        let births = Births::of(
            self.settings,
            &SeedWater {
                water: &now,
                potentials: &potentials,
                frame,
                seconds,
                spacing,
                gravity: self.scene.water.gravity.length(),
                walls: Bounds {
                    min: walls.min + corner,
                    max: walls.max + corner,
                },
                corner,
                period: self.scene.period(),
            },
        );
        let count = white.len() + births.len();
        if count > self.settings.max_particles as usize {
            return Err(WhitewaterError::TooMany {
                frame,
                count,
                allowed: self.settings.max_particles,
            });
        }
        let next = births.join(&mut white, stream.next_id);
        died += whitewater::kill(kills, &domain, clock.time, &mut white);
        let [spray, foam, bubbles] = whitewater::census(&white);
        let report = json!({
            "spray": spray, "foam": foam, "bubbles": bubbles, "born": births.len(), "died": died,
            NEXT_ID: next, WATER: self.cache.entry(frame)?.chain,
        });
        (stream.writer).submit(clock, white.clone(), Vec::new(), report, Value::Null)?;
        stream.clock = clock;
        stream.white = white;
        stream.next_id = next;
        Ok(births.len())
    }
}

/// Key of a frame's report: the id that the next new particle gets.
const NEXT_ID: &str = "next_id";
/// A stream being written.
struct StreamWriter {
    writer: CacheWriter,
    clock: Clock,
    white: Particles,
    next_id: u32,
}

impl StreamWriter {
    fn create(
        directory: &Path,
        manifest: Manifest,
        cache: &CacheReader,
        settings: &CompleteSettings,
    ) -> Result<Self, WhitewaterError> {
        let mut assets = vec![Asset {
            name: SETTINGS.to_owned(),
            bytes: written_out(settings).into_bytes(),
        }];
        // The settings name these, beside them.
        for kill in &settings.kills {
            let KillRoom::Mesh(mesh) = &kill.room else {
                continue;
            };
            let name = kill_asset(mesh);
            // Assets of one name have the same bytes: the name has their hash.
            if assets.iter().all(|asset| asset.name != name) {
                let bytes = mesh_file::read_bytes(&mesh.file)?;
                assets.push(Asset { name, bytes });
            }
        }
        let clock = cache.entry(cache.first_frame())?.clock;
        let white = whitewater::none();
        let writer = derived::create(directory, manifest, cache, assets, (clock, &white))?;
        Ok(Self {
            writer,
            clock,
            white,
            next_id: 0,
        })
    }

    fn resume(
        directory: &Path,
        manifest: &Manifest,
        cache: &CacheReader,
    ) -> Result<Self, WhitewaterError> {
        let (writer, entry, white) = derived::resume(directory, manifest, cache)?;
        let next_id = match entry.report[NEXT_ID].as_u64() {
            Some(next) => next as u32,
            None => 0,
        };
        Ok(Self {
            writer,
            clock: entry.clock,
            white,
            next_id,
        })
    }
}

/// Hash of everything except the device that decides a stream's bytes: settings and bake.
fn hash(cache: &CacheReader, request: &WhitewaterRequest) -> Result<String, CacheError> {
    let first = &cache.entry(cache.first_frame())?.chain;
    let hash = blake3::hash(format!("{} {first}", request.settings.hash()).as_bytes());
    Ok(hash.to_hex().to_string())
}

/// The manifest of the stream: that of the bake with the fields that differ.
fn manifest(
    cache: &CacheReader,
    request: &WhitewaterRequest,
    identity: &Identity,
) -> Result<Manifest, WhitewaterError> {
    Ok(Manifest {
        shaders: identity.shaders.clone(),
        device: identity.name.clone(),
        driver: identity.driver.clone(),
        backend: identity.backend.clone(),
        ..derived::manifest(
            cache.manifest(),
            Manifest::WHITEWATER,
            hash(cache, request)?,
            &whitewater::ATTRIBUTES,
        )
    })
}
