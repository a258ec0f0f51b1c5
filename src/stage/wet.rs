//! `wet`: how wet each point of each solid is over time, from a finished bake, as a stream beside
//! it. The bake is only read, and no device is needed.
//!
//! A stream is a cache of its own in `CACHE/wet/NAME`. Its frames hold the vertices of all refined
//! surfaces as points with the attribute [`WETNESS`], surface after surface, each where its solid
//! is at that time; its assets hold the surfaces' triangles and the settings.

mod error;
mod stream;
mod surfaces;

use std::{
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, Ordering},
    time::Instant,
};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use swell_cache::{Asset, CacheError, CacheReader, CacheWriter, Clock, LedgerEntry, Manifest};
use swell_domain::{
    body::BodyState,
    parallel,
    particles::Particles,
    wet::{self, CONTACT, Contact, EDGE, WETNESS},
};
use swell_scene::Scene;

use super::derived::{self, WATER, water::WaterReader};

use self::surfaces::{Surface, surfaces};

pub use self::error::WetError;
pub(crate) use self::stream::WetStream;

/// Folder of the streams in a cache.
pub(super) const FOLDER: &str = "wet";
/// Name of the asset with the settings of a stream and the list of its surfaces.
const SETTINGS: &str = "wet.json";

/// Bytes of a point of a frame: position, velocity, id and wetness.
const POINT_BYTES: u64 = 32;

/// What to make.
#[derive(Clone, Debug)]
pub struct WetRequest {
    /// Directory of the bake's cache.
    pub cache: PathBuf,
    /// Name of the stream.
    pub name: String,
    /// Drying time τ, seconds: away from water, wetness falls as exp(−t/τ).
    pub drying: f64,
    /// Contact distance, metres; [`CONTACT`] particle spacings if `None`.
    pub contact: Option<f64>,
    /// Longest edge of the triangles, metres; [`EDGE`] particle spacings if `None`.
    pub edge: Option<f64>,
    /// Last frame to make; the bake's last if `None`.
    pub last: Option<u32>,
    /// Whether to remove an existing stream of this name that was made differently.
    pub overwrite: bool,
}

/// Settings of a stream, in its asset `wet.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    /// Drying time, seconds.
    drying_s: f64,
    /// Contact distance, metres.
    contact_m: f64,
    /// Longest edge, metres.
    edge_m: f64,
    /// Surfaces in the order of a frame's points.
    surfaces: Vec<SurfaceRecord>,
}

/// A surface of a stream.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SurfaceRecord {
    /// Name of the solid.
    solid: String,
    /// Asset with its triangles.
    file: String,
    /// Number of its vertices, which are as many points of each frame.
    vertices: usize,
}

/// Progress of a running job.
#[derive(Clone, Debug)]
pub enum WetEvent {
    /// The surfaces are known.
    Ready {
        /// Directory of the stream.
        directory: PathBuf,
        /// Number of surfaces.
        surfaces: usize,
        /// Number of their vertices.
        vertices: usize,
        /// Drying time, seconds; contact distance and longest edge, metres.
        settings: [f64; 3],
        /// First frame that will be computed.
        first: u32,
        /// Last frame that will be computed.
        last: u32,
        /// What of the surfaces stays dry although water stands at it.
        warnings: Vec<String>,
    },
    /// A frame was computed.
    Frame {
        /// Number of the frame.
        frame: u32,
        /// Area in contact with water, m².
        contact: f64,
        /// Area times wetness, m².
        wet: f64,
        /// Wall-clock time it took, seconds.
        seconds: f64,
    },
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
pub struct WetOutcome {
    /// Last frame in the stream.
    pub last_frame: u32,
    /// Number of frames computed by this run, the first frame of a new stream not counted.
    pub frames: u32,
    /// Bytes of frames written by this run.
    pub bytes: u64,
    /// Directory of the stream.
    pub directory: PathBuf,
    /// Whether a signal ended it.
    pub interrupted: bool,
}

/// What a job would make.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ExpectedWet {
    /// Directory of the stream.
    pub directory: PathBuf,
    /// First frame that would be computed.
    pub first: u32,
    /// Last frame that would be computed.
    pub last: u32,
    /// Number of frames that exist, not counting the first.
    pub standing: u32,
    /// Number of vertices of all surfaces.
    pub vertices: usize,
    /// Bytes of the points of the frames to be computed; `None` where frames are compressed.
    pub bytes: Option<u64>,
}

/// Folder of a stream of a cache.
fn directory(cache: &Path, name: &str) -> PathBuf {
    cache.join(FOLDER).join(name)
}

/// Examines the bake and the existing stream as a job would, and writes nothing.
///
/// # Errors
/// [`WetError`].
pub fn expected(request: &WetRequest) -> Result<ExpectedWet, WetError> {
    let (cache, last) = asked(request)?;
    let scene = super::baked_scene(&cache, &request.cache)?;
    let made = Made::of(request, &cache, &scene)?;
    let directory = directory(&request.cache, &request.name);
    let standing = derived::standing(&directory, &made.hash, request.overwrite)?;
    let first = cache.first_frame();
    let there = standing.map_or(first, |stream| stream.last_frame());
    let left = u64::from(last.saturating_sub(there));
    let is_plain = cache.manifest().compression.is_none();
    Ok(ExpectedWet {
        bytes: is_plain.then(|| left * POINT_BYTES * made.vertices() as u64),
        directory,
        first: there + 1,
        last,
        standing: there - first,
        vertices: made.vertices(),
    })
}

/// Makes a stream, or resumes an existing one. `tell` receives progress events, and setting `stop`
/// ends the job after the current frame.
///
/// # Errors
/// [`WetError`]; the frames that were completed before are in the stream.
pub fn wet(
    request: &WetRequest,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(WetEvent),
) -> Result<WetOutcome, WetError> {
    let (cache, last) = asked(request)?;
    let directory = directory(&request.cache, &request.name);
    let scene = super::baked_scene(&cache, &request.cache)?;
    let made = Made::of(request, &cache, &scene)?;
    let mut water = WaterReader::of(&cache, scene.period());
    let mut writer = match derived::standing(&directory, &made.hash, request.overwrite)? {
        Some(_) => StreamWriter::resume(&directory, &made, &cache)?,
        None => {
            derived::remove(&directory)?;
            StreamWriter::create(&directory, &made, (&cache, &scene), &mut water)?
        }
    };
    let Settings {
        drying_s,
        contact_m,
        edge_m,
        ..
    } = made.settings;
    tell(WetEvent::Ready {
        directory: directory.clone(),
        surfaces: made.surfaces.len(),
        vertices: made.vertices(),
        settings: [drying_s, contact_m, edge_m],
        first: writer.clock.frame + 1,
        last,
        warnings: out_of_reach(&scene, contact_m),
    });
    let areas = made.areas();
    let mut interrupted = false;
    while writer.clock.frame < last {
        interrupted = stop.load(Ordering::Relaxed);
        if interrupted {
            break;
        }
        let began = Instant::now();
        match writer.step(&made, (&cache, &scene), &mut water, &areas) {
            Ok([contact, wet]) => tell(WetEvent::Frame {
                frame: writer.clock.frame,
                contact,
                wet,
                seconds: began.elapsed().as_secs_f64(),
            }),
            Err(error) => {
                // What was computed before a failure is kept.
                let bytes = writer.writer.finish()?.bytes;
                tell(WetEvent::Written { bytes });
                return Err(error);
            }
        }
    }
    let summary = writer.writer.finish()?;
    tell(WetEvent::Written {
        bytes: summary.bytes,
    });
    Ok(WetOutcome {
        last_frame: summary.last_frame,
        frames: summary.frames,
        bytes: summary.bytes,
        directory,
        interrupted,
    })
}

/// Warns of solids that are thickened so much that water at them is not within `contact` metres of
/// their mesh.
fn out_of_reach(scene: &Scene, contact: f64) -> Vec<String> {
    let most = scene.needed_thickness().most();
    let thickened = scene.thickened_solids();
    let least = thickened.map(|(placed, part)| {
        let least = 0.5 * (most - part.thickness) + CONTACT * scene.particle_spacing();
        (placed.name(), least)
    });
    let missed = least.filter(|(_, least)| contact < *least);
    let warning = missed.map(|(name, least)| {
        format!(
            "{name} is thickened for the water, which may stand up to {least:.3} m off its mesh: \
             within {contact:.3} m it stays dry"
        )
    });
    warning.collect()
}

/// Opens the bake, and determines the last frame to make.
fn asked(request: &WetRequest) -> Result<(CacheReader, u32), WetError> {
    let positive = [
        ("drying time", Some(request.drying)),
        ("contact distance", request.contact),
        ("longest edge", request.edge),
    ];
    for (what, value) in positive {
        if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
            return Err(WetError::Setting { what, value });
        }
    }
    Ok(derived::bake(&request.cache, request.last)?)
}

/// The surfaces and settings of a stream.
struct Made<'a> {
    surfaces: Vec<Surface<'a>>,
    settings: Settings,
    /// Hash of everything that decides the stream's bytes: settings, surfaces and bake.
    hash: String,
}

impl<'a> Made<'a> {
    fn of(request: &WetRequest, cache: &CacheReader, scene: &'a Scene) -> Result<Self, WetError> {
        let spacing = scene.particle_spacing();
        let edge = request.edge.unwrap_or(EDGE * spacing);
        let surfaces = surfaces(scene, edge)?;
        let records = surfaces.iter().enumerate();
        let records = records.map(|(index, surface)| SurfaceRecord {
            solid: surface.name.clone(),
            file: surface.file(index),
            vertices: surface.refined.len(),
        });
        let settings = Settings {
            drying_s: request.drying,
            contact_m: request.contact.unwrap_or(CONTACT * spacing),
            edge_m: edge,
            surfaces: records.collect(),
        };
        Ok(Self {
            hash: settings.hash(cache)?,
            surfaces,
            settings,
        })
    }

    fn vertices(&self) -> usize {
        self.surfaces.iter().map(|it| it.refined.len()).sum()
    }

    /// Vertices at `time` seconds, relative to the scene's origin.
    fn points(&self, bodies: &[BodyState], time: f64) -> Vec<[f32; 3]> {
        let mut all = Vec::with_capacity(self.vertices());
        for surface in &self.surfaces {
            surface.add_vertices(bodies, time, &mut all);
        }
        all
    }

    /// Area around each vertex, m².
    fn areas(&self) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.vertices());
        for surface in &self.surfaces {
            surface.add_areas(&mut all);
        }
        all
    }

    /// Which of `points` are in contact with `water`.
    fn contact(&self, scene: &Scene, water: &Particles, points: &[[f32; 3]]) -> Vec<bool> {
        let corner = scene.domain.min;
        let distance = self.settings.contact_m;
        Contact::with(&water.position, corner, distance, scene.period()).of(points)
    }

    fn manifest(&self, cache: &CacheReader) -> Manifest {
        derived::manifest(
            cache.manifest(),
            Manifest::WET,
            self.hash.clone(),
            &[WETNESS],
        )
    }

    fn assets(&self, scene: &Scene) -> Vec<Asset> {
        let settings = Asset {
            name: SETTINGS.to_owned(),
            bytes: self.settings.to_bytes(),
        };
        let surfaces = self.surfaces.iter().enumerate();
        let surfaces = surfaces.map(|(index, surface)| Asset {
            name: surface.file(index),
            bytes: surface.bytes(scene.origin),
        });
        [settings].into_iter().chain(surfaces).collect()
    }
}

impl Settings {
    fn to_bytes(&self) -> Vec<u8> {
        format!("{:#}\n", json!(self)).into_bytes()
    }

    fn hash(&self, cache: &CacheReader) -> Result<String, CacheError> {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&self.to_bytes());
        hasher.update(cache.entry(cache.first_frame())?.chain.as_bytes());
        Ok(hasher.finalize().to_hex().to_string())
    }
}

/// A stream being written.
struct StreamWriter {
    writer: CacheWriter,
    clock: Clock,
    /// Points of the last frame.
    points: Particles,
}

impl StreamWriter {
    fn create(
        directory: &Path,
        made: &Made<'_>,
        (cache, scene): (&CacheReader, &Scene),
        water: &mut WaterReader<'_>,
    ) -> Result<Self, WetError> {
        let first = cache.first_frame();
        let entry = cache.entry(first)?;
        let position = made.points(&entry.bodies, entry.clock.time);
        let contact = made.contact(scene, &water.at(first)?, &position);
        let wetness = contact.iter().map(|&it| f32::from(u8::from(it))).collect();
        let velocity = vec![[0.0; 3]; position.len()];
        let points = points(position, velocity, wetness);
        let writer = derived::create(
            directory,
            made.manifest(cache),
            cache,
            made.assets(scene),
            (entry.clock, &points),
        )?;
        Ok(Self {
            writer,
            clock: entry.clock,
            points,
        })
    }

    fn resume(directory: &Path, made: &Made<'_>, cache: &CacheReader) -> Result<Self, WetError> {
        let manifest = made.manifest(cache);
        let (writer, entry, points) = derived::resume(directory, &manifest, cache)?;
        Ok(Self {
            writer,
            clock: entry.clock,
            points,
        })
    }

    /// Computes and submits the next frame. Returns the areas in contact and wet, m².
    fn step(
        &mut self,
        made: &Made<'_>,
        (cache, scene): (&CacheReader, &Scene),
        water: &mut WaterReader<'_>,
        areas: &[f64],
    ) -> Result<[f64; 2], WetError> {
        let frame = self.clock.frame + 1;
        let entry: &LedgerEntry = cache.entry(frame)?;
        let clock = Clock {
            substeps: 1,
            steps: self.clock.steps + 1,
            ..entry.clock
        };
        let seconds = clock.time - self.clock.time;
        let position = made.points(&entry.bodies, clock.time);
        let contact = made.contact(scene, &water.at(frame)?, &position);
        let before = &self.points;
        let (old, drying) = (&before.attributes[WETNESS], made.settings.drying_s);
        let wetness: Vec<f32> = parallel::map(0..position.len(), |k| {
            wet::next(old[k], contact[k], seconds, drying)
        });
        // Of moving solids, from the frame before to this one.
        let velocity = parallel::map(0..position.len(), |k| {
            let along = |axis: usize| {
                let way = f64::from(position[k][axis]) - f64::from(before.position[k][axis]);
                (way / seconds) as f32
            };
            [0, 1, 2].map(along)
        });
        let in_contact = areas.iter().zip(&contact).filter(|(_, it)| **it);
        let sums = [
            in_contact.fold(0.0, |sum, (area, _)| sum + area),
            (areas.iter().zip(&wetness)).fold(0.0, |sum, (area, w)| sum + area * f64::from(*w)),
        ];
        let report = json!({
            "contact_area": sums[0], "wet_area": sums[1], WATER: entry.chain,
        });
        let points = points(position, velocity, wetness);
        (self.writer).submit(clock, points.clone(), Vec::new(), report, Value::Null)?;
        (self.clock, self.points) = (clock, points);
        Ok(sums)
    }
}

fn points(position: Vec<[f32; 3]>, velocity: Vec<[f32; 3]>, wetness: Vec<f32>) -> Particles {
    Particles {
        id: (0..position.len() as u32).collect(),
        position,
        velocity,
        attributes: [(WETNESS.to_owned(), wetness)].into(),
        ..Particles::default()
    }
}
