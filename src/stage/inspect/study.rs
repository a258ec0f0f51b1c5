//! Lists the runs of a study.

use swell_files::study::{
    RunsOn, Study,
    stability::{Case, Held, Limit, Stability},
    sweep::Sweep,
    tune::Tune,
};

/// Outline of a study, in the order of its file.
#[derive(Debug)]
#[non_exhaustive]
pub struct Outline {
    /// Kind, as in the file's `kind`.
    pub kind: &'static str,
    /// Its curves, cases or benchmarks.
    pub parts: Vec<Part>,
    /// Warnings about its scenes.
    pub warnings: Vec<String>,
}

/// A curve, a case, a benchmark or a solver.
#[derive(Debug)]
pub struct Part {
    /// Name as in page and legend.
    pub name: String,
    /// What changes from point to point, or what the part is.
    pub key: String,
    /// Names of the runs, in order.
    pub points: Vec<String>,
}

impl Outline {
    /// Outline of a study that was read.
    pub fn of(study: &Study) -> Self {
        let (kind, parts) = match study {
            Study::SolverComparison(it) => {
                let part = |scene: &swell_scene::Scene| Part {
                    name: scene.solver.method().name().to_owned(),
                    key: format!("frames {}, pictures {}", it.frames, it.pictures),
                    points: vec![scene.shot.name.clone()],
                };
                ("solver_comparison", it.scenes.iter().map(part).collect())
            }
            Study::Sweep(it) => ("sweep", swept(it)),
            Study::Stability(it) => ("stability", held(it)),
            Study::Surface(it) => {
                let part = |line: &swell_files::study::surface::Line| Part {
                    name: line.name.clone(),
                    key: line.key.clone(),
                    points: line.points.iter().map(|it| it.label.clone()).collect(),
                };
                ("surface", it.lines.iter().map(part).collect())
            }
            Study::Tune(it) => ("tune", tuned(it)),
            Study::Validation(it) => {
                let part = |benchmark: &swell_files::study::validation::Benchmark| Part {
                    name: benchmark.name.clone(),
                    key: format!("gates: {}", benchmark.gates.len()),
                    points: (benchmark.runs.iter())
                        .map(|run| on(&run.name(), run.device))
                        .collect(),
                };
                ("validation", it.benchmarks.iter().map(part).collect())
            }
        };
        Self {
            kind,
            parts,
            warnings: study.warnings(),
        }
    }

    /// Keeps only the marked points, in their order, and drops parts that become empty.
    pub fn keep(&mut self, is_kept: &[bool]) {
        let mut marks = is_kept.iter();
        for part in &mut self.parts {
            part.points.retain(|_| marks.next().is_some_and(|is| *is));
        }
        self.parts.retain(|part| !part.points.is_empty());
    }

    /// Number of points of all parts.
    pub fn points(&self) -> usize {
        self.parts.iter().map(|part| part.points.len()).sum()
    }
}

/// Marks a run on the reference.
fn on(name: &str, device: RunsOn) -> String {
    match device {
        RunsOn::Gpu => name.to_owned(),
        RunsOn::Cpu => format!("{name} on {}", device.name()),
    }
}

fn swept(sweep: &Sweep) -> Vec<Part> {
    let part = |line: &swell_files::study::sweep::Line| Part {
        name: line.name.clone(),
        key: line.key.clone(),
        points: (line.points.iter())
            .map(|point| on(&point.label, point.device))
            .collect(),
    };
    sweep.lines.iter().map(part).collect()
}

/// Runs in their order, grouped by purpose.
fn tuned(tune: &Tune) -> Vec<Part> {
    let mut parts: Vec<Part> = Vec::new();
    for (why, variant) in tune.variants() {
        let point = variant.name();
        match parts.last_mut() {
            Some(part) if part.name == why => part.points.push(point),
            _ => parts.push(Part {
                name: why.to_owned(),
                key: format!("frames 1-{}", tune.frames),
                points: vec![point],
            }),
        }
    }
    parts
}

fn held(stability: &Stability) -> Vec<Part> {
    let case = |case: &Case| {
        let (key, points) = match &case.held {
            Held::Test(command) => ("a test".to_owned(), vec![command.clone()]),
            Held::Runs(trials) => (
                "runs".to_owned(),
                (trials.iter())
                    .map(|it| on(it.scene.solver.method().name(), it.device))
                    .collect(),
            ),
            Held::Refusal { attempts, .. } => (
                "refusals".to_owned(),
                (attempts.iter())
                    .map(|it| on(it.method.name(), it.device))
                    .collect(),
            ),
        };
        Part {
            name: format!("{} {}", case.number, case.name),
            key,
            points,
        }
    };
    let limit = |limit: &Limit| Part {
        name: limit.name.clone(),
        key: format!(
            "limit between {} and {} {}",
            limit.passes, limit.fails, limit.unit
        ),
        points: (limit.searches.iter())
            .map(|it| it.method.name().to_owned())
            .collect(),
    };
    let cases = stability.cases.iter().map(case);
    cases.chain(stability.limits.iter().map(limit)).collect()
}
