//! Compares two solvers on one scene: bakes, renders and measures both. Existing caches are
//! resumed.

use std::{fs, path::PathBuf};

use rayon::prelude::*;

use swell_cache::{CacheError, CacheReader, Manifest};
use swell_domain::{frame_range::FrameRange, output::AtPath as _, solver::StepReport};
use swell_files::study::comparison::SolverComparison;
use swell_gpu::adapter::Needs;
use swell_scene::{Scene, Solid};
use swell_stage::{
    bake,
    device::{Device, shaders_note},
    gauge, render,
};
use swell_study::{
    comparison::{self, Course, Finding, FrameRow, Impact},
    measure::Gauge,
    median,
    page::Part,
    picture,
};

use super::{
    StudyError, StudyEvent, StudyRequest,
    engine::{Bench, StudyKind, WorkUnit},
    report::{Report, what_was_run},
};

impl StudyKind for SolverComparison {
    /// Returns `None`: bakes and renders open the adapter themselves.
    fn needs(&self) -> Option<Needs> {
        None
    }

    fn count(&self) -> usize {
        self.scenes.len()
    }

    /// Returns `None`: the two bakes cannot be divided among shares.
    fn work_units(&self) -> Option<Vec<WorkUnit>> {
        None
    }

    fn run(&self, bench: &mut Bench<'_>) -> Result<Option<Report>, StudyError> {
        for scene in &self.scenes {
            bench.tell(StudyEvent::Solver(scene.solver.method().name()));
            bake_and_render(self, bench, scene)?;
        }
        let request = bench.request;
        let [scene, other] = &self.scenes;
        let open = |scene: &Scene| CacheReader::open(&cache_directory(request, scene));
        let caches = [open(scene)?, open(other)?];
        let [a, b] = &caches;
        let gauge = gauge::of_caches(scene, &[a, b])?;
        let courses = [
            course(a, &gauge, &self.frames)?,
            course(b, &gauge, &self.frames)?,
        ];
        let impact = Impact::of(&courses, obstacle(scene, &gauge));
        let findings = comparison::findings(&courses, impact);
        Ok(Some(Report {
            answer: comparison::summary(&findings),
            parts: parts(request, self, &caches, &courses, &findings, impact)?,
            table: comparison::table(&courses),
            findings: findings.into_iter().map(|found| found.text).collect(),
            ..Report::default()
        }))
    }
}

fn bake_and_render(
    comparison: &SolverComparison,
    bench: &mut Bench<'_>,
    scene: &Scene,
) -> Result<(), StudyError> {
    let (request, stop) = (bench.request, bench.stop);
    let last = comparison.frames.last().max(comparison.pictures.last());
    let cache = cache_directory(request, scene);
    let bake = bake::BakeRequest {
        scene: scene.clone(),
        directory: cache.clone(),
        frames: FrameRange::inclusive(1, last),
        resume: true,
        from: None,
        device: Device::Gpu(request.gpu.clone()),
        time_passes: false,
    };
    let mut tell = |event| bench.tell(StudyEvent::Bake(Box::new(event)));
    if bake::bake(&bake, stop, &mut tell)?.interrupted {
        return Err(StudyError::Stopped);
    }
    let render = render::RenderRequest {
        cache,
        look: comparison.look.clone(),
        directory: picture_directory(request, scene),
        frames: Some(comparison.pictures.clone()),
        chunk: None,
        gpu: request.gpu.clone(),
        number_from: None,
        overwrite: false,
        keep_going: false,
        time_passes: false,
    };
    let mut tell = |event| bench.tell(StudyEvent::Render(event));
    match render::render(&render, stop, &mut tell)?.interrupted {
        true => Err(StudyError::Stopped),
        false => Ok(()),
    }
}

fn cache_directory(request: &StudyRequest, scene: &Scene) -> PathBuf {
    request
        .directory
        .join("cache")
        .join(scene.solver.method().name())
}

fn picture_directory(request: &StudyRequest, scene: &Scene) -> PathBuf {
    let pictures = request.directory.join("pictures");
    pictures.join(scene.solver.method().name())
}

/// Distance along the wave's path to the first obstacle, a solid or the far wall, less the gauge's
/// resolution.
fn obstacle(scene: &Scene, gauge: &Gauge) -> f64 {
    let nearest = |solid: &Solid| {
        let distances = solid.mesh.vertices.iter().map(|&v| gauge.distance(v));
        distances.fold(f64::INFINITY, f64::min)
    };
    let length = scene.domain.size()[gauge::direction(scene).axis];
    let places = scene.solids.iter().map(nearest).chain([length]);
    // The position of a front is known to the size of a cube.
    places.fold(f64::INFINITY, f64::min) - gauge.resolution()
}

fn course(cache: &CacheReader, gauge: &Gauge, frames: &FrameRange) -> Result<Course, StudyError> {
    let manifest = cache.manifest();
    let seconds = cache.seconds()?;
    let frames: Vec<u32> = frames.iter().collect();
    let row = |&frame: &u32| {
        let entry = cache.entry(frame)?;
        let report: Option<StepReport> = serde_json::from_value(entry.report.clone()).ok();
        let particles = cache.read(frame)?;
        Ok(FrameRow {
            frame,
            time: entry.clock.time,
            seconds: seconds.get(&frame).copied(),
            substeps: entry.clock.substeps,
            iterations: report.as_ref().map_or(0, |report| report.iterations),
            missed: report
                .and_then(|report| report.projection)
                .map_or(0, |p| p.missed),
            measures: gauge.measure(&particles.position, manifest.particle_spacing),
        })
    };
    Ok(Course {
        solver: manifest.solver.clone(),
        rows: frames
            .par_iter()
            .map(row)
            .collect::<Result<_, CacheError>>()?,
    })
}

fn parts(
    request: &StudyRequest,
    comparison: &SolverComparison,
    caches: &[CacheReader; 2],
    courses: &[Course; 2],
    findings: &[Finding],
    impact: Impact,
) -> Result<Vec<Part>, StudyError> {
    let when = match impact.frame {
        Some(frame) => {
            format!("The first wave meets an obstacle in frame {frame}: the impact.")
        }
        None => "No wave meets anything: crest and splash are taken over all frames.".to_owned(),
    };
    let answer = |found: &Finding| vec![found.question.to_owned(), found.text.clone()];
    let mut answers = vec![vec!["question".to_owned(), "answer".to_owned()]];
    answers.extend(findings.iter().map(answer));
    let curves = comparison::charts(courses, impact);
    let mut run = vec![Part::Table(run_table(caches, courses))];
    run.extend(what_was_run(request));
    // The scene contains the tables of both solvers.
    run.push(Part::Code(caches[0].scene_toml().to_owned()));
    let measured = vec![Part::Text(MEASURED.into())];
    Ok(vec![
        Part::Words(answers),
        Part::Text(when),
        Part::Heading("The same frames".into()),
        pictures(request, comparison, &caches[0])?,
        Part::Heading("Curves".into()),
        Part::Curves(curves.iter().map(|chart| chart.to_svg()).collect()),
        Part::Text(comparison::CLAIMS.into()),
        Part::Folded("What was run".into(), run),
        Part::Folded("How it was measured".into(), measured),
    ])
}

/// Explanation for readers of the page; `swell::study::measure` has the definitions.
const MEASURED: &str = "Both solvers are measured alike, from the particles. Space is cut into \
    cubes two particle spacings wide; a cube at least half as full as at rest is water, and the \
    largest body of such cubes that touch by faces is the continuous water. A column's elevation \
    is the top of that body, smoothed once over its neighbours. Crest: the highest elevation of \
    each row along the wave's path, median over the rows; the slope of its front face goes from \
    the foremost place at 0.9 of the crest's height to the foremost at half of it (after the crest \
    front steepness of Kjeldsen and Myrhaug 1979). In the air is what lies more than a cube from \
    the continuous water. Values that differ by less than 5 % are called alike. Times are wall \
    clock, the whole frame, with writing beside it.";

/// Median of a quantity over the rows of a course, with `digits` decimals.
fn middle(course: &Course, digits: usize, value: fn(&FrameRow) -> Option<f64>) -> String {
    let middle = median(course.rows.iter().filter_map(value).collect());
    middle.map_or("none".into(), |value| format!("{value:.digits$}"))
}

fn run_table(caches: &[CacheReader; 2], courses: &[Course; 2]) -> Vec<Vec<String>> {
    type Cell = fn(&Manifest, &Course) -> String;
    let rows: [(&str, Cell); 11] = [
        ("", |_, c| c.solver.clone()),
        ("particles at the start", |m, _| {
            m.start_particles.to_string()
        }),
        ("particle spacing, m", |m, _| m.particle_spacing.to_string()),
        ("frames measured", |_, c| c.rows.len().to_string()),
        ("time per frame, median, s", |_, c| {
            middle(c, 3, |row| row.seconds)
        }),
        ("substeps a frame, median", |_, c| {
            middle(c, 0, |row| Some(row.substeps.into()))
        }),
        ("iterations a frame, median", |_, c| {
            middle(c, 0, |row| Some(row.iterations as f64))
        }),
        ("projections that missed their tolerance", |_, c| {
            c.rows.iter().map(|row| row.missed).sum::<u32>().to_string()
        }),
        ("adapter", |m, _| {
            format!("{} ({}, {})", m.device, m.driver, m.backend)
        }),
        ("program", |m, _| {
            let shaders = shaders_note(m.shaders.as_deref());
            format!("{} {}{shaders}", m.program, m.program_version)
        }),
        ("scene's physics", |m, _| {
            m.scene_hash.chars().take(16).collect()
        }),
    ];
    let of = |(title, cell): (&str, Cell)| {
        let both = caches.iter().zip(courses);
        let cells = both.map(|(cache, course)| cell(cache.manifest(), course));
        [title.to_owned()].into_iter().chain(cells).collect()
    };
    rows.into_iter().map(of).collect()
}

fn pictures(
    request: &StudyRequest,
    comparison: &SolverComparison,
    cache: &CacheReader,
) -> Result<Part, StudyError> {
    let address = |scene: &Scene, frame: u32| {
        let folder = picture_directory(request, scene);
        let file = folder.join(render::picture_name(cache, frame));
        let bytes = fs::read(&file).at(&file)?;
        picture::data_uri(&bytes).map_err(|source| StudyError::Picture { file, source })
    };
    let row = |frame: u32| {
        let addresses = comparison.scenes.iter().map(|scene| address(scene, frame));
        Ok((
            format!("frame {frame}"),
            addresses.collect::<Result<_, StudyError>>()?,
        ))
    };
    Ok(Part::Pictures {
        columns: comparison
            .scenes
            .iter()
            .map(|scene| scene.solver.method().name().to_owned())
            .collect(),
        rows: comparison
            .pictures
            .iter()
            .map(row)
            .collect::<Result<_, StudyError>>()?,
    })
}
