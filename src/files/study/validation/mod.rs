//! `kind = "validation"`: benchmarks with a known answer from theory or experiment, and a solver's
//! error against it.
//!
//! ```toml
//! kind = "validation"
//!
//! [[benchmark]]
//! name = "piston, kh = 1"
//! measure = "regular_waves"                   # a name of Measure
//! scene = "../validation/piston.toml"
//! set = ["shot.frames=400"]                   # applied to the scene of every run
//! stroke = 0.1                                # inputs of the measure: metres, seconds
//! period = 2.3
//! after = 6.0
//!
//! [[benchmark.run]]
//! solver = "flip"
//! resolution = 20                             # cells per depth, width or wavelength
//! set = ["solver.flip.cell_size=0.05"]
//! device = "gpu"                              # the default
//!
//! [[benchmark.gate]]
//! of = "height_ratio"                         # a number of the measure
//! published = 0.982
//! source = "linear theory (Dean and Dalrymple 1991)"
//! within = 0.05                               # or off_by, at_most, at_least, order_at_least,
//!                                             # agree_within
//! solver = "flip"                             # runs to judge; default: all
//! resolution = 20
//! known_failure = "why it is missed"
//!
//! [[benchmark.points]]                        # data that a curve of the measure is compared with
//! of = "front"
//! source = "Martin and Moyce 1952"
//! at = [[0.84, 1.22], [1.43, 1.67]]
//! ```

use std::path::Path;

use serde::Deserialize;
use toml::{Spanned, de::DeTable};

use super::{super::document::Document, RunsOn, SceneFile, StudyFileError, load_with};
use swell_scene::{Method, Scene, SceneError};

pub use crate::measure::Measure;

type Result<T> = std::result::Result<T, SceneError>;

/// A validated study of benchmarks.
#[derive(Clone, Debug)]
pub struct Validation {
    /// Introduction for the page, in paragraphs.
    pub about: Vec<String>,
    /// Benchmarks in the order of the file.
    pub benchmarks: Vec<Benchmark>,
}

/// A setup with a known answer.
#[derive(Clone, Debug)]
pub struct Benchmark {
    /// Name in words, unique in the study.
    pub name: String,
    /// Note for the page.
    pub note: Option<String>,
    /// Measure applied to the runs.
    pub measure: Measure,
    /// Inputs of the measure.
    pub scale: Scale,
    /// Runs in the order of the file.
    pub runs: Vec<Trial>,
    /// Gates in the order of the file.
    pub gates: Vec<Gate>,
    /// Reference data for the curves.
    pub points: Vec<Points>,
}

/// A run of a benchmark.
#[derive(Clone, Debug)]
pub struct Trial {
    /// Device of the run.
    pub device: RunsOn,
    /// Cells per length that the benchmark chooses.
    pub resolution: f64,
    /// The scene with all overrides.
    pub scene: Scene,
}

impl Trial {
    /// Returns solver and resolution, for a legend or a line.
    pub fn name(&self) -> String {
        format!("{}, {}", self.scene.solver.method().name(), self.resolution)
    }
}

/// Inputs of a measure; 0 where not given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scale {
    /// Depth of still water, metres.
    pub depth: f64,
    /// Length of a column, a wave or a box, or distance of a dam, of a body in a current, or of the
    /// shoreline on a beach, from the domain's least x, metres.
    pub length: f64,
    /// Height of a crest above still water, metres.
    pub height: f64,
    /// Stroke of a piston from end to end, metres.
    pub stroke: f64,
    /// Period of a piston, seconds.
    pub period: f64,
    /// Speed of a vortex, a jet or a current, m/s.
    pub speed: f64,
    /// Initial seconds of the shot that are ignored.
    pub after: f64,
}

/// Requirement on a number.
#[derive(Clone, Debug, PartialEq)]
pub struct Gate {
    /// Name of a number of the measure.
    pub of: String,
    /// Published value.
    pub published: Option<f64>,
    /// Source of the published value or of the gate.
    pub source: String,
    /// Bound on the number or its error.
    pub bound: Bound,
    /// Solver that the gate judges; `None` for all.
    pub method: Option<Method>,
    /// Resolution that the gate judges; `None` for all.
    pub resolution: Option<f64>,
    /// Reason for a known failure.
    pub known_failure: Option<String>,
}

/// Bound on a number or its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// Upper bound on |measured / published − 1|.
    Within(f64),
    /// Upper bound on |measured − published|, in the unit of the number.
    OffBy(f64),
    /// Upper bound.
    AtMost(f64),
    /// Lower bound.
    AtLeast(f64),
    /// Lower bound on the order of convergence of the error against the published value, over
    /// all resolutions.
    OrderAtLeast(f64),
    /// Upper bound on the spread over all resolutions: maximum less minimum, over the mean.
    AgreeWithin(f64),
}

impl Bound {
    /// Whether it judges several runs together.
    pub fn is_of_all(self) -> bool {
        matches!(self, Self::OrderAtLeast(_) | Self::AgreeWithin(_))
    }

    /// Returns the bounding number.
    fn limit(self) -> f64 {
        match self {
            Self::Within(limit)
            | Self::OffBy(limit)
            | Self::AtMost(limit)
            | Self::AtLeast(limit)
            | Self::OrderAtLeast(limit)
            | Self::AgreeWithin(limit) => limit,
        }
    }
}

/// Reference data for a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Points {
    /// Name of a curve of the measure.
    pub of: String,
    /// Source of the data.
    pub source: String,
    /// Points in the units of the curve.
    pub at: Vec<[f64; 2]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ValidationSpec {
    #[serde(rename = "kind")]
    _kind: String,
    about: Option<Vec<String>>,
    benchmark: Vec<Spanned<BenchmarkSpec>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BenchmarkSpec {
    name: Spanned<String>,
    note: Option<String>,
    measure: Spanned<String>,
    scene: Spanned<String>,
    #[serde(default)]
    set: Vec<Spanned<String>>,
    depth: Option<f64>,
    length: Option<f64>,
    height: Option<f64>,
    stroke: Option<f64>,
    period: Option<f64>,
    speed: Option<f64>,
    after: Option<f64>,
    #[serde(default)]
    run: Vec<Spanned<RunSpec>>,
    #[serde(default)]
    gate: Vec<Spanned<GateSpec>>,
    #[serde(default)]
    points: Vec<PointsSpec>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RunSpec {
    solver: Spanned<String>,
    resolution: f64,
    #[serde(default)]
    set: Vec<Spanned<String>>,
    device: Option<Spanned<String>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GateSpec {
    of: Spanned<String>,
    published: Option<f64>,
    source: String,
    within: Option<f64>,
    off_by: Option<f64>,
    at_most: Option<f64>,
    at_least: Option<f64>,
    order_at_least: Option<f64>,
    agree_within: Option<f64>,
    solver: Option<Spanned<String>>,
    resolution: Option<Spanned<f64>>,
    known_failure: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PointsSpec {
    of: Spanned<String>,
    source: String,
    at: Vec<[f64; 2]>,
}

/// Parses the remaining keys of this kind; paths are relative to `base_dir`.
pub(super) fn parse(
    doc: &Document<'_>,
    root: Spanned<DeTable<'_>>,
    base_dir: &Path,
) -> std::result::Result<Validation, StudyFileError> {
    let spec = ValidationSpec::deserialize(toml::Deserializer::from(root))
        .map_err(|error| doc.translate(&error))?;
    let mut benchmarks: Vec<Benchmark> = Vec::new();
    for spec in &spec.benchmark {
        let read = benchmark(doc, spec, base_dir)?;
        if benchmarks.iter().any(|other| other.name == read.name) {
            let problem = format!("{:?} is the name of another benchmark", read.name);
            return Err(doc.fault_at(spec.get_ref().name.span(), problem).into());
        }
        benchmarks.push(read);
    }
    Ok(Validation {
        about: spec.about.unwrap_or_default(),
        benchmarks,
    })
}

fn benchmark(
    doc: &Document<'_>,
    spec: &Spanned<BenchmarkSpec>,
    base_dir: &Path,
) -> Result<Benchmark> {
    let at = spec.span();
    let spec = spec.get_ref();
    let word = spec.measure.get_ref();
    let named = Measure::NAMED.iter().find(|(name, _)| name == word);
    let measure = named.map(|(_, measure)| *measure);
    let measure = measure.ok_or_else(|| {
        doc.fault_at(
            spec.measure.span(),
            format!("{word:?} is not a quantity that is measured"),
        )
    })?;
    let scale = scale(doc, spec, measure, at.clone())?;
    let file = SceneFile::new(&spec.scene, base_dir);
    let run = |run: &Spanned<RunSpec>| trial(doc, &file, &spec.set, run.get_ref());
    let runs = spec.run.iter().map(run).collect::<Result<Vec<_>>>()?;
    if runs.is_empty() {
        return Err(doc.missing(at, "run"));
    }
    let gate = |gate: &Spanned<GateSpec>| self::gate(doc, gate, measure, &runs);
    let gates = spec.gate.iter().map(gate).collect::<Result<_>>()?;
    let points = |points: &PointsSpec| {
        let word = points.of.get_ref();
        if !measure.curves().iter().any(|(name, _)| name == word) {
            let names: Vec<_> = measure.curves().iter().map(|(name, _)| *name).collect();
            let problem = format!(
                "{word:?} is not a curve of {}, which has {names:?}",
                spec.measure.get_ref()
            );
            return Err(doc.fault_at(points.of.span(), problem));
        }
        Ok(Points {
            of: word.clone(),
            source: points.source.clone(),
            at: points.at.clone(),
        })
    };
    Ok(Benchmark {
        name: spec.name.get_ref().clone(),
        note: spec.note.clone(),
        measure,
        scale,
        points: spec.points.iter().map(points).collect::<Result<_>>()?,
        runs,
        gates,
    })
}

fn scale(
    doc: &Document<'_>,
    spec: &BenchmarkSpec,
    measure: Measure,
    at: std::ops::Range<usize>,
) -> Result<Scale> {
    let given = [
        ("depth", spec.depth),
        ("length", spec.length),
        ("height", spec.height),
        ("stroke", spec.stroke),
        ("period", spec.period),
        ("speed", spec.speed),
        ("after", spec.after),
    ];
    for (name, value) in given {
        let is_needed = measure.needs().contains(&name);
        match value {
            None if is_needed => return Err(doc.missing(at, name)),
            Some(_) if !is_needed => {
                let word = spec.measure.get_ref();
                let problem = format!("{word:?} takes no {name}");
                return Err(doc.fault_at(spec.measure.span(), problem));
            }
            _ => {}
        }
    }
    let [depth, length, height, stroke, period, speed, after] =
        given.map(|(_, value)| value.unwrap_or(0.0));
    Ok(Scale {
        depth,
        length,
        height,
        stroke,
        period,
        speed,
        after,
    })
}

fn trial(
    doc: &Document<'_>,
    file: &SceneFile<'_>,
    set: &[Spanned<String>],
    spec: &RunSpec,
) -> Result<Trial> {
    let method = method(doc, &spec.solver)?;
    let sets = set.iter().chain(&spec.set);
    let sets = sets.map(|set| (set.get_ref().clone(), set.span()));
    let scene = load_with(doc, file, sets.chain([(method.as_override(), 0..0)]))?;
    let device = match &spec.device {
        None => RunsOn::Gpu,
        Some(word) => RunsOn::named(word.get_ref()).ok_or_else(|| {
            doc.fault_at(word.span(), format!("{:?} is not a device", word.get_ref()))
        })?,
    };
    Ok(Trial {
        device,
        resolution: spec.resolution,
        scene,
    })
}

fn method(doc: &Document<'_>, word: &Spanned<String>) -> Result<Method> {
    let named = Method::NAMED
        .iter()
        .find(|(name, _)| name == word.get_ref());
    let fault = || doc.fault_at(word.span(), format!("{:?} is not a solver", word.get_ref()));
    named.map(|(_, method)| *method).ok_or_else(fault)
}

fn gate(
    doc: &Document<'_>,
    spec: &Spanned<GateSpec>,
    measure: Measure,
    runs: &[Trial],
) -> Result<Gate> {
    let at = spec.span();
    let spec = spec.get_ref();
    let fault = |problem: String| doc.fault_at(spec.of.span(), problem);
    let word = spec.of.get_ref();
    if !measure.numbers().iter().any(|(name, _)| name == word) {
        let names: Vec<_> = measure.numbers().iter().map(|(name, _)| *name).collect();
        return Err(fault(format!(
            "{word:?} is not measured here; {names:?} are"
        )));
    }
    let bounds = [
        spec.within.map(Bound::Within),
        spec.off_by.map(Bound::OffBy),
        spec.at_most.map(Bound::AtMost),
        spec.at_least.map(Bound::AtLeast),
        spec.order_at_least.map(Bound::OrderAtLeast),
        spec.agree_within.map(Bound::AgreeWithin),
    ];
    let mut bounds = bounds.into_iter().flatten();
    let bound = bounds.next().ok_or_else(|| doc.missing(at, "within"))?;
    if bounds.next().is_some() {
        let problem =
            "more than one of within, off_by, at_most, at_least, order_at_least and agree_within";
        return Err(fault(problem.to_owned()));
    }
    if matches!(bound, Bound::Within(_) | Bound::OffBy(_)) && spec.published.is_none() {
        return Err(fault(format!(
            "{word:?} is compared with no published number"
        )));
    }
    let method = spec
        .solver
        .as_ref()
        .map(|word| method(doc, word))
        .transpose()?;
    let gate = Gate {
        of: word.clone(),
        published: spec.published,
        source: spec.source.clone(),
        bound,
        method,
        resolution: spec.resolution.as_ref().map(|r| *r.get_ref()),
        known_failure: spec.known_failure.clone(),
    };
    let judged = runs.iter().filter(|run| gate.judges(run)).count();
    let least = match bound {
        Bound::OrderAtLeast(_) if spec.published.is_none() => 3,
        _ if bound.is_of_all() => 2,
        _ => 1,
    };
    if spec
        .known_failure
        .as_ref()
        .is_some_and(|why| why.trim().is_empty())
    {
        return Err(fault("known_failure gives no reason".to_owned()));
    }
    if matches!(
        bound,
        Bound::Within(_) | Bound::OffBy(_) | Bound::AgreeWithin(_)
    ) && bound.limit() < 0.0
    {
        return Err(fault(format!(
            "no value is within a bound of {}; allowed is 0 or more",
            bound.limit()
        )));
    }
    if matches!(bound, Bound::Within(_)) && spec.published == Some(0.0) {
        return Err(fault(
            "a part of 0 is 0: use off_by with published = 0".to_owned(),
        ));
    }
    if judged < least {
        return Err(fault(format!(
            "{judged} runs are of its solver and resolution"
        )));
    }
    Ok(gate)
}

impl Gate {
    /// Returns whether the gate judges this run.
    pub fn judges(&self, run: &Trial) -> bool {
        self.method
            .is_none_or(|method| method == run.scene.solver.method())
            && self
                .resolution
                .is_none_or(|resolution| resolution == run.resolution)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::Study;

    const TEXT: &str = "kind = \"validation\"
[[benchmark]]
name = \"wave\"
measure = \"solitary_wave\"
scene = \"../validation/solitary.toml\"
depth = 1.0
height = 0.2
[[benchmark.run]]
solver = \"flip\"
resolution = 20
[[benchmark.gate]]
of = \"celerity\"
published = 3.431
source = \"Goring 1978\"
within = 0.02
[[benchmark.points]]
of = \"elevation\"
source = \"nobody\"
at = [[0.0, 0.2]]
";

    fn read(text: &str) -> std::result::Result<Study, String> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/studies");
        Study::parse(text, Path::new("s.toml"), &folder).map_err(|error| error.to_string())
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        assert!(read(TEXT).is_ok(), "{:?}", read(TEXT).err());
        for (from, to, place, words) in [
            ("\"solitary_wave\"", "\"solitary\"", "s.toml:4:", "solitary"),
            ("height = 0.2\n", "", "s.toml:2:", "height"),
            (
                "height = 0.2",
                "height = 0.2\nstroke = 1.0",
                "s.toml:4:",
                "takes no stroke",
            ),
            ("\"flip\"", "\"sph\"", "s.toml:9:", "not a solver"),
            ("resolution = 20\n", "", "s.toml:8:", "resolution"),
            (
                "\"celerity\"",
                "\"period\"",
                "s.toml:12:",
                "is not measured here",
            ),
            ("within = 0.02", "", "s.toml:11:", "within"),
            (
                "within = 0.02",
                "within = 0.02\nat_most = 4.0",
                "s.toml:12:",
                "more than one",
            ),
            (
                "published = 3.431\n",
                "",
                "s.toml:12:",
                "no published number",
            ),
            (
                "within = 0.02",
                "order_at_least = 1.5",
                "s.toml:12:",
                "1 runs",
            ),
            (
                "within = 0.02",
                "within = 0.02\nsolver = \"pbf\"",
                "s.toml:12:",
                "0 runs",
            ),
            ("\"elevation\"", "\"front\"", "s.toml:17:", "is not a curve"),
        ] {
            let error = read(&TEXT.replacen(from, to, 1)).expect_err(to);
            assert!(
                error.contains(place) && error.contains(words),
                "{to}: {error}"
            );
        }
        let twice = format!("{TEXT}{}", TEXT.split_once('\n').expect("lines").1);
        assert!(read(&twice).expect_err("two").contains("another benchmark"));
    }
}
