//! Table, curves and page of a study of the drawn surface.

use swell_files::study::{
    RunsOn,
    surface::{PictureError, SurfaceStudy},
};
use swell_study::{
    chart::{Chart, Dot, Series},
    knee,
    page::Part,
};

use super::{
    super::{
        engine::Bench,
        report::{Report, what_was_run},
        sweep::digits::{shortened, significant},
    },
    SurfaceRun,
};

struct SurfaceResults<'a> {
    study: &'a SurfaceStudy,
    /// Runs of each line, in the order of its points.
    runs: &'a [Vec<SurfaceRun>],
    device: String,
}

pub(super) fn draw(study: &SurfaceStudy, bench: &Bench<'_>, runs: &[Vec<SurfaceRun>]) -> Report {
    let results = SurfaceResults {
        study,
        runs,
        device: bench.devices.of(RunsOn::Gpu).identity().to_string(),
    };
    let mut findings = Vec::new();
    for &error in &study.errors {
        for line in results.lines(error) {
            let of = format!("{}, {}", error.name(), line.name);
            findings.push(format!("{of}: {}", knee::words(&line, None)));
        }
    }
    let table = results.table();
    Report {
        answer: results.answer(),
        curves: (study.errors.iter())
            .map(|&error| (error.name().to_owned(), results.chart(error).to_svg()))
            .collect(),
        parts: results.parts(bench, &table, &findings),
        table,
        findings,
        missed: Vec::new(),
    }
}

impl SurfaceResults<'_> {
    fn lines(&self, error: PictureError) -> Vec<knee::MethodCurve> {
        let lines = self.study.lines.iter().zip(self.runs);
        lines
            .map(|(line, runs)| {
                let points = line.points.iter().zip(runs).filter_map(|(point, run)| {
                    let is_done = run.ended.is_none();
                    Some(knee::CostPoint {
                        label: point.label.clone(),
                        time: run.per_frame().map(|seconds| 1e3 * seconds),
                        work: 0.0,
                        error: run.measured.error(error).filter(|_| is_done)?,
                    })
                });
                knee::MethodCurve {
                    name: line.name.clone(),
                    points: points.collect(),
                }
            })
            .collect()
    }

    /// Sentence about the setting with the least value of the first error.
    fn answer(&self) -> String {
        let Some(&error) = self.study.errors.first() else {
            return String::new();
        };
        let lines = self.lines(error);
        let keys = self.study.lines.iter().map(|line| &line.key);
        let all = lines
            .iter()
            .zip(keys)
            .flat_map(|(line, key)| line.points.iter().map(move |point| (line, key, point)));
        match all.min_by(|a, b| a.2.error.total_cmp(&b.2.error)) {
            None => "Nothing was measured: no point finished.".to_owned(),
            Some((line, key, point)) => format!(
                "Least is off, by {}, {} with {key} = {}: {} in {} ms a frame.",
                error.title(),
                line.name,
                point.label,
                significant(point.error),
                significant(point.time[1]),
            ),
        }
    }

    fn failures(&self) -> Vec<String> {
        let lines = self.study.lines.iter().zip(self.runs);
        lines
            .flat_map(|(line, runs)| {
                line.points
                    .iter()
                    .zip(runs)
                    .filter_map(move |(point, run)| {
                        let message = run.ended.as_ref()?;
                        Some(format!(
                            "{}, {} = {}: {message}",
                            line.name, line.key, point.label
                        ))
                    })
            })
            .collect()
    }

    fn chart(&self, error: PictureError) -> Chart {
        let series = |line: &knee::MethodCurve| {
            let knee = knee::knee(line, None);
            let dot = |point: &knee::CostPoint| Dot {
                at: point.time[1],
                value: Some(point.error),
                label: point.label.clone(),
                bar: Some([point.time[0], point.time[2]]),
                is_knee: knee.is_some_and(|knee| std::ptr::eq(knee.point, point)),
            };
            Series {
                name: line.name.clone(),
                points: line.points.iter().map(dot).collect(),
            }
        };
        let failures = self.failures().into_iter();
        Chart {
            title: format!(
                "{}, frames {}",
                self.study.scene.shot.name, self.study.frames
            ),
            subtitle: format!(
                "on {}; bars from the least to the greatest of {}",
                self.device, self.study.repeats
            ),
            x_label: "time a frame, ms".to_owned(),
            y_label: error.title().to_owned(),
            is_log: true,
            series: self.lines(error).iter().map(series).collect(),
            notes: failures.map(|text| format!("failed: {text}")).collect(),
            ..Chart::default()
        }
    }

    fn table(&self) -> Vec<Vec<String>> {
        let fixed = "line,key,setting,particles,frames,repeats,ms,ms_least,ms_most,\
                     depth_p95,normal_p95,overlap";
        let errors = PictureError::NAMED.map(|(name, _)| name.to_owned());
        let titles = fixed.split(',').map(str::to_owned).chain(errors);
        let mut table = vec![titles.chain(["failed".to_owned()]).collect::<Vec<_>>()];
        let width = table[0].len();
        for (line, runs) in self.study.lines.iter().zip(self.runs) {
            for (point, run) in line.points.iter().zip(runs) {
                let mut row = vec![line.name.clone(), line.key.clone(), point.label.clone()];
                if let Some(message) = &run.ended {
                    row.resize(width - 1, String::new());
                    row.push(message.clone());
                    table.push(row);
                    continue;
                }
                let [least, middle, most] = run.per_frame().map(|seconds| 1e3 * seconds);
                let told = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.4e}"));
                let surface = run.measured.surface.as_ref();
                row.extend([
                    run.particles.to_string(),
                    run.frames.to_string(),
                    run.seconds.len().to_string(),
                    format!("{middle:.3}"),
                    format!("{least:.3}"),
                    format!("{most:.3}"),
                    told(surface.map(|it| it.depth[1])),
                    told(surface.map(|it| it.normal[1])),
                    told(surface.map(|it| it.overlap)),
                ]);
                let errors = PictureError::NAMED.iter();
                row.extend(errors.map(|&(_, error)| told(run.measured.error(error))));
                row.push(String::new());
                table.push(row);
            }
        }
        table
    }

    fn parts(&self, bench: &Bench<'_>, table: &[Vec<String>], findings: &[String]) -> Vec<Part> {
        let mut parts: Vec<Part> = self.study.about.iter().cloned().map(Part::Text).collect();
        parts.push(Part::Heading("Knees".into()));
        parts.extend(findings.iter().cloned().map(Part::Text));
        let failures = self.failures();
        if !failures.is_empty() {
            parts.push(Part::Heading("Failed".into()));
            parts.extend(failures.into_iter().map(Part::Text));
        }
        parts.push(Part::Heading("Table".into()));
        parts.push(Part::Table(shortened(table)));
        let mut run = what_was_run(bench.request);
        run.push(Part::Text(format!(
            "On {}. By {} {}.",
            self.device,
            swell_domain::PROGRAM,
            swell_domain::VERSION,
        )));
        parts.push(Part::Folded("What was run".into(), run));
        let measured = vec![Part::Text(MEASURED.into())];
        parts.push(Part::Folded("How it was measured".into(), measured));
        parts
    }
}

const MEASURED: &str = "The scene is baked; each setting of the look then draws the same frames. A \
    time is the wall clock of a frame's picture with all its samples, median of the repeats, after \
    one picture that is not counted; spray is drawn as the look has it, whitewater is not. Depths, \
    normals and silhouettes are taken at the centres of pixels and compared with rays that the CPU \
    casts in f64 through the particles' own field. Colour is SSIMULACRA 2 \
    of the picture as a screen shows it, against one by rays with four times the look's samples \
    and voxels half as wide: light, sky, spray and set are shared with what is tested, and of rays \
    all but samples and voxels.";
