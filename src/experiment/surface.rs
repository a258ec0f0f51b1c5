//! Studies of the drawn surface: accuracy against time of frames that are drawn with one setting of
//! the look changed at a time.

mod report;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use swell_cache::CacheReader;
use swell_domain::frame_range::FrameRange;
use swell_files::study::{
    RunsOn,
    surface::{PictureError, Point, SurfaceStudy},
};
use swell_gpu::adapter::{Context, Needs};
use swell_stage::{
    bake,
    device::{Device, Opened},
    render::gallery::{Gallery, REACH, Summary},
};

use super::{
    PointStatus, StudyError, StudyEvent, StudyRequest,
    engine::{Bench, StudyKind, WorkUnit},
    ledger::Key,
    report::Report,
};

/// Results of a point.
type SurfaceRun = super::run::Run<SurfaceMeasurements>;

/// Measurements besides the time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(expecting = "struct Measured")]
struct SurfaceMeasurements {
    /// Errors of the surface; `None` where no water was visible.
    surface: Option<Summary>,
    /// SSIMULACRA 2 score against a reference by finer rays; `None` where the study does not ask
    /// for colour.
    score: Option<f64>,
}

impl SurfaceMeasurements {
    /// Returns `None` where the error was not measured.
    fn error(&self, of: PictureError) -> Option<f64> {
        let surface = self.surface.as_ref();
        match of {
            PictureError::Depth => Some(surface?.depth[0]),
            PictureError::Normal => Some(surface?.normal[0]),
            PictureError::Silhouette => Some(surface?.silhouette?.roughness),
            PictureError::Offset => Some(surface?.silhouette?.offset.abs()),
            PictureError::Colour => Some(100.0 - self.score?),
        }
    }
}

impl StudyKind for SurfaceStudy {
    fn needs(&self) -> Option<Needs> {
        Some(Needs::default())
    }

    fn count(&self) -> usize {
        self.points().count()
    }

    /// Returns `None`: all points draw frames of the same cache.
    fn work_units(&self) -> Option<Vec<WorkUnit>> {
        None
    }

    fn run(&self, bench: &mut Bench<'_>) -> Result<Option<Report>, StudyError> {
        let mut ledger = bench.ledger()?;
        baked(self, bench)?;
        let mut shared = Shared {
            study: self,
            gallery: None,
            frames: hashes(self, bench.request)?,
        };
        let mut runs = Vec::new();
        for line in &self.lines {
            let mut of_line = Vec::new();
            for point in &line.points {
                let name = format!("{}, {} = {}", line.name, line.key, point.label);
                let key = shared.key(bench, point);
                let measure = || shared.measure(bench, point);
                if let Some((run, stood)) = bench.point(&mut ledger, &name, key, measure)? {
                    bench.report_point(name, status(&self.errors, &run, stood));
                    of_line.push(run);
                }
            }
            runs.push(of_line);
        }
        Ok(Some(report::draw(self, bench, &runs)))
    }
}

fn status(errors: &[PictureError], run: &SurfaceRun, stood: bool) -> PointStatus {
    let known = |of: &PictureError| Some((of.name(), run.measured.error(*of)?));
    match &run.ended {
        _ if stood => PointStatus::Stands,
        Some(message) => PointStatus::Failed(message.clone()),
        None => PointStatus::Done(
            1e3 * run.per_frame()[1],
            errors.iter().filter_map(known).collect(),
        ),
    }
}

fn cache(request: &StudyRequest) -> PathBuf {
    request.directory.join("cache")
}

/// Bakes the scene up to the last frame that the pictures depend on, and resumes an existing cache.
fn baked(study: &SurfaceStudy, bench: &mut Bench<'_>) -> Result<(), StudyError> {
    let last = (study.frames.last() + REACH).min(study.scene.shot.frames);
    let request = bake::BakeRequest {
        scene: study.scene.clone(),
        directory: cache(bench.request),
        frames: FrameRange::inclusive(1, last),
        resume: true,
        from: None,
        device: Device::Gpu(bench.request.gpu.clone()),
        time_passes: false,
    };
    let mut tell = |event| bench.tell(StudyEvent::Bake(Box::new(event)));
    match bake::bake(&request, bench.stop, &mut tell)?.interrupted {
        true => Err(StudyError::Stopped),
        false => Ok(()),
    }
}

/// Hashes of the drawn frames.
fn hashes(study: &SurfaceStudy, request: &StudyRequest) -> Result<String, StudyError> {
    let cache = CacheReader::open(&cache(request))?;
    let hashes = study
        .frames
        .iter()
        .map(|frame| Ok(cache.frame_hash(frame)?.to_owned()));
    Ok(hashes.collect::<Result<Vec<_>, StudyError>>()?.join(" "))
}

/// Whether a study scores its pictures by finer rays.
pub(super) fn is_scored(study: &SurfaceStudy) -> bool {
    study.errors.contains(&PictureError::Colour)
}

/// State shared by all points.
struct Shared<'s, 'b> {
    study: &'s SurfaceStudy,
    /// Opened for the first point that is measured.
    gallery: Option<Gallery<'b>>,
    /// Hashes of the drawn frames.
    frames: String,
}

impl<'b> Shared<'_, 'b> {
    fn key(&self, bench: &Bench<'_>, point: &Point) -> Key {
        let study = self.study;
        let scene = [(&study.scene, RunsOn::Gpu)];
        let measured = format!(
            "surface {} {} {} {} {}",
            study.repeats,
            is_scored(study),
            self.frames,
            study.look.hash(),
            point.look.hash(),
        );
        bench.devices.key(&scene, study.frames.last(), &measured)
    }

    fn measure(&mut self, bench: &Bench<'b>, point: &Point) -> Result<SurfaceRun, StudyError> {
        let study = self.study;
        let gallery = match &self.gallery {
            Some(gallery) => gallery,
            None => {
                let opened = Gallery::open(
                    context(bench),
                    &cache(bench.request),
                    &study.look,
                    &study.frames,
                    is_scored(study),
                )?;
                self.gallery.insert(opened)
            }
        };
        let drawn = gallery.draw(&point.look, study.repeats)?;
        Ok(SurfaceRun {
            particles: gallery.particles(),
            frames: study.frames.len() as u32,
            seconds: drawn.seconds,
            ended: None,
            measured: SurfaceMeasurements {
                surface: drawn.surface,
                score: drawn.score,
            },
        })
    }
}

/// Adapter of the study, which [`StudyKind::needs`] requests.
fn context<'a>(bench: &Bench<'a>) -> &'a Context {
    match bench.devices.of(RunsOn::Gpu) {
        Opened::Gpu(context) => context,
        Opened::Cpu => unreachable!("an adapter was asked for"),
    }
}
