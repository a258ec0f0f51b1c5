//! Serde types of a stability study, and their conversion to runs.

use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Deserialize;
use toml::{Spanned, de::DeTable};

use super::{
    super::{
        super::{Reach, document::Document},
        RunsOn, SceneFile, StudyFileError, load_with,
    },
    Attempt, Bound, Case, Held, Limit, Mark, Other, Quantity, Search, Stability, Trial,
};
use crate::load_scene_within;
use swell_domain::bounds::Bounds;
use swell_scene::{Method, Scene, SceneError};

type Result<T> = std::result::Result<T, SceneError>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StabilitySpec {
    #[serde(rename = "kind")]
    _kind: String,
    about: Option<Vec<String>>,
    case: Vec<Spanned<CaseSpec>>,
    #[serde(default)]
    limit: Vec<Spanned<LimitSpec>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CaseSpec {
    number: u32,
    name: Spanned<String>,
    note: Option<String>,
    test: Option<Spanned<String>>,
    scene: Option<Spanned<String>>,
    #[serde(default)]
    set: Vec<Spanned<String>>,
    solvers: Option<Vec<Spanned<String>>>,
    devices: Option<Vec<Spanned<String>>>,
    frames: Option<Spanned<i64>>,
    refused: Option<Spanned<Vec<String>>>,
    #[serde(default)]
    against: Vec<OtherSpec>,
    #[serde(default)]
    mark: Vec<Spanned<MarkSpec>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OtherSpec {
    #[serde(default)]
    set: Vec<Spanned<String>>,
    device: Option<Spanned<String>>,
    scale: Option<Spanned<f64>>,
    shift: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MarkSpec {
    of: Spanned<String>,
    at_most: Option<f64>,
    at_least: Option<f64>,
    after: Option<f64>,
    since: Option<Spanned<f64>>,
    region: Option<[[f64; 3]; 2]>,
    solvers: Option<Vec<Spanned<String>>>,
    devices: Option<Vec<Spanned<String>>>,
    known_failure: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitSpec {
    name: String,
    note: Option<String>,
    unit: Option<String>,
    scene: Spanned<String>,
    set: Vec<Spanned<String>>,
    solvers: Option<Vec<Spanned<String>>>,
    passes: f64,
    fails: f64,
    ratio: f64,
    seconds: f64,
    mark: Vec<Spanned<MarkSpec>>,
}

/// Builds the run of a limit from a value.
#[derive(Clone, Debug)]
pub(super) struct Template {
    file: PathBuf,
    reach: Reach,
    set: Vec<String>,
    seconds: f64,
    marks: Vec<Mark>,
}

/// Parses the remaining keys of this kind; paths are relative to `base_dir`.
pub(in super::super) fn parse(
    doc: &Document<'_>,
    root: Spanned<DeTable<'_>>,
    base_dir: &Path,
) -> std::result::Result<Stability, StudyFileError> {
    let spec = StabilitySpec::deserialize(toml::Deserializer::from(root))
        .map_err(|error| doc.translate(&error))?;
    let mut cases: Vec<Case> = Vec::new();
    for spec in &spec.case {
        let case = case(doc, spec, base_dir)?;
        let is_same = |other: &Case| (other.number, &other.name) == (case.number, &case.name);
        if cases.iter().any(is_same) {
            let problem = format!(
                "{:?} is the name of another case {}",
                case.name, case.number
            );
            return Err(doc.fault_at(spec.get_ref().name.span(), problem).into());
        }
        cases.push(case);
    }
    let limits = spec.limit.iter();
    Ok(Stability {
        about: spec.about.unwrap_or_default(),
        cases,
        limits: limits
            .map(|spec| limit(doc, spec.get_ref(), base_dir))
            .collect::<Result<_>>()?,
    })
}

fn case(doc: &Document<'_>, spec: &Spanned<CaseSpec>, base_dir: &Path) -> Result<Case> {
    let at = spec.span();
    let spec = spec.get_ref();
    let held = match (&spec.test, &spec.scene) {
        (Some(test), None) => Held::Test(test.get_ref().clone()),
        (Some(test), Some(_)) => {
            return Err(doc.fault_at(test.span(), "given together with scene"));
        }
        (None, None) => return Err(doc.missing(at, "scene")),
        (None, Some(scene)) => {
            let file = SceneFile::new(scene, base_dir);
            match &spec.refused {
                Some(words) => Held::Refusal {
                    attempts: attempts(doc, spec, &file)?,
                    words: words.get_ref().clone(),
                },
                None => Held::Runs(trials(doc, spec, &file)?),
            }
        }
    };
    Ok(Case {
        number: spec.number,
        name: spec.name.get_ref().clone(),
        note: spec.note.clone(),
        held,
    })
}

fn attempts(doc: &Document<'_>, spec: &CaseSpec, file: &SceneFile<'_>) -> Result<Vec<Attempt>> {
    let mut attempts = Vec::new();
    for method in methods(doc, &spec.solvers)? {
        for device in devices(doc, &spec.devices)? {
            let sets: Vec<_> = spec.set.iter().map(|set| set.get_ref().clone()).collect();
            let overrides = [&sets[..], &[method.as_override()]].concat();
            attempts.push(Attempt {
                method,
                device,
                scene: match load_scene_within(&file.path, &overrides, doc.reach()) {
                    Ok(scene) => Ok(Box::new(scene)),
                    // A missing file is an error of the study, not a refusal of the scene.
                    Err(error @ SceneError::Read { .. }) => return Err(error),
                    Err(error) => Err(error.to_string()),
                },
            });
        }
    }
    Ok(attempts)
}

fn trials(doc: &Document<'_>, spec: &CaseSpec, file: &SceneFile<'_>) -> Result<Vec<Trial>> {
    let mut trials = Vec::new();
    for method in methods(doc, &spec.solvers)? {
        for device in devices(doc, &spec.devices)? {
            let set: Vec<_> = spec.set.iter().collect();
            let scene = load(doc, file, &set, method)?;
            let frames = match &spec.frames {
                None => scene.shot.frames,
                Some(frames) => u32::try_from(*frames.get_ref())
                    .ok()
                    .filter(|count| (1..=scene.shot.frames).contains(count))
                    .ok_or_else(|| {
                        let problem = format!("the shot has frames 1 to {}", scene.shot.frames);
                        doc.fault_at(frames.span(), problem)
                    })?,
            };
            let mut others = Vec::new();
            for spec in &spec.against {
                others.push(other(doc, spec, file, (&set, method, device), &scene)?);
            }
            trials.push(Trial {
                device,
                frames,
                marks: marks(doc, &spec.mark, method, device, others.len())?,
                others,
                scene,
            });
        }
    }
    Ok(trials)
}

fn other(
    doc: &Document<'_>,
    spec: &OtherSpec,
    file: &SceneFile<'_>,
    (set, method, device): (&[&Spanned<String>], Method, RunsOn),
    beside: &Scene,
) -> Result<Other> {
    let set: Vec<_> = set.iter().copied().chain(&spec.set).collect();
    let scene = load(doc, file, &set, method)?;
    let scale = spec.scale.as_ref().map_or(1.0, |scale| *scale.get_ref());
    // Runs are compared frame by frame; with Froude scaling, times scale as the square
    // root of lengths.
    let rate = beside.shot.frames_per_second / scale.sqrt();
    if (scene.shot.frames_per_second / rate - 1.0).abs() > 1e-9 {
        let place = spec.scale.as_ref().map(Spanned::span);
        let place = place
            .or(spec.set.first().map(Spanned::span))
            .unwrap_or(0..0);
        let problem = format!(
            "its shot.frames_per_second is {}, and at this scale it has to be {rate}",
            scene.shot.frames_per_second
        );
        return Err(doc.fault_plain(place, problem));
    }
    Ok(Other {
        device: match &spec.device {
            Some(word) => self::device(doc, word)?,
            None => device,
        },
        scene,
        scale,
        shift: spec.shift.map_or(DVec3::ZERO, DVec3::from_array),
    })
}

/// Returns the marks of a run, those of every run first.
fn marks(
    doc: &Document<'_>,
    specs: &[Spanned<MarkSpec>],
    method: Method,
    device: RunsOn,
    others: usize,
) -> Result<Vec<Mark>> {
    let always = Quantity::ALWAYS.map(|of| Mark {
        of,
        bound: Bound::AtMost(0.0),
        after: 0.0,
        since: None,
        region: None,
        known_failure: None,
    });
    let mut marks = always.to_vec();
    for spec in specs {
        let mark = mark(doc, spec, others)?;
        let spec = spec.get_ref();
        if methods(doc, &spec.solvers)?.contains(&method)
            && devices(doc, &spec.devices)?.contains(&device)
        {
            marks.push(mark);
        }
    }
    Ok(marks)
}

fn mark(doc: &Document<'_>, spec: &Spanned<MarkSpec>, others: usize) -> Result<Mark> {
    let at = spec.span();
    let spec = spec.get_ref();
    let fault = |problem: String| doc.fault_at(spec.of.span(), problem);
    let word = spec.of.get_ref();
    let named = Quantity::ALL.into_iter().find(|of| of.name() == word);
    let of = named.ok_or_else(|| fault(format!("{word:?} is not a quantity that is measured")))?;
    if of.about().others > others {
        let problem = format!(
            "{word:?} takes {} [[case.against]], and there are {others}",
            of.about().others
        );
        return Err(fault(problem));
    }
    if spec.region.is_some() != of.about().takes_region && of != Quantity::Difference {
        return Err(fault(format!("{word:?} and region do not go together")));
    }
    if let Some(since) = &spec.since
        && !of.about().takes_since
    {
        return Err(doc.fault_at(since.span(), format!("{word:?} does not take since")));
    }
    let bound = match (&spec.at_most, &spec.at_least) {
        (Some(most), None) => Bound::AtMost(*most),
        (None, Some(least)) => Bound::AtLeast(*least),
        (Some(_), Some(_)) => return Err(fault(format!("{word:?} has at_most and at_least"))),
        (None, None) => return Err(doc.missing(at, "at_most")),
    };
    Ok(Mark {
        of,
        bound,
        after: spec.after.unwrap_or(0.0),
        since: spec.since.as_ref().map(|since| *since.get_ref()),
        region: spec.region.map(|corners| {
            let [min, max] = corners.map(DVec3::from_array);
            Bounds { min, max }
        }),
        known_failure: spec.known_failure.clone(),
    })
}

fn limit(doc: &Document<'_>, spec: &LimitSpec, base_dir: &Path) -> Result<Limit> {
    let mut searches = Vec::new();
    for method in methods(doc, &spec.solvers)? {
        let template = Template {
            file: base_dir.join(spec.scene.get_ref()),
            reach: doc.reach(),
            set: spec.set.iter().map(|set| set.get_ref().clone()).collect(),
            seconds: spec.seconds,
            marks: marks(doc, &spec.mark, method, RunsOn::Gpu, 0)?,
        };
        // The scene must be valid at the passing end of the bracket; farther on it
        // may become invalid.
        template.trial(method, spec.passes)?;
        searches.push(Search { method, template });
    }
    Ok(Limit {
        name: spec.name.clone(),
        note: spec.note.clone(),
        unit: spec.unit.clone().unwrap_or_default(),
        searches,
        passes: spec.passes,
        fails: spec.fails,
        ratio: spec.ratio,
    })
}

impl Template {
    pub(super) fn trial(&self, method: Method, value: f64) -> Result<Trial> {
        let mut overrides = Vec::new();
        for set in &self.set {
            overrides.push(filled(set, value).map_err(|reason| SceneError::Override {
                text: set.clone(),
                reason,
            })?);
        }
        overrides.push(method.as_override());
        let scene = load_scene_within(&self.file, &overrides, self.reach)?;
        let frames = (self.seconds * scene.shot.frames_per_second)
            .ceil()
            .max(1.0);
        Ok(Trial {
            device: RunsOn::Gpu,
            scene,
            frames: frames as u32,
            others: Vec::new(),
            marks: self.marks.clone(),
        })
    }
}

/// Substitutes the value in the braces of an override: `{}` is the value, `{2*}` twice the value,
/// `{2/}` two over the value. Other braces are TOML tables.
fn filled(set: &str, value: f64) -> std::result::Result<String, String> {
    let mut out = String::new();
    let mut rest = set;
    while let Some(close) = rest.find('}') {
        let (before, after) = rest.split_at(close);
        let open = before.rfind('{').unwrap_or(before.len());
        let (before, term) = before.split_at(open);
        let factor = |text: &str| {
            text.parse::<f64>()
                .map_err(|_| format!("{{{text}}} is not one of {{}}, {{2*}}, {{2/}}"))
        };
        out.push_str(before);
        match term.strip_prefix('{') {
            Some("") => out.push_str(&format!("{value:?}")),
            Some(inner) => match (inner.strip_suffix('*'), inner.strip_suffix('/')) {
                (Some(times), _) => out.push_str(&format!("{:?}", factor(times)? * value)),
                (_, Some(over)) => out.push_str(&format!("{:?}", factor(over)? / value)),
                _ => out.push_str(&format!("{term}}}")),
            },
            None => out.push('}'),
        }
        rest = &after[1..];
    }
    out.push_str(rest);
    match out.matches('{').count() == out.matches('}').count() {
        true => Ok(out),
        false => Err("a brace is not closed".to_owned()),
    }
}

fn methods(doc: &Document<'_>, words: &Option<Vec<Spanned<String>>>) -> Result<Vec<Method>> {
    let Some(words) = words else {
        return Ok(vec![Method::Pbf, Method::Flip]);
    };
    let of = |word: &Spanned<String>| {
        let named = Method::NAMED
            .iter()
            .find(|(name, _)| name == word.get_ref());
        let fault = || doc.fault_at(word.span(), format!("{:?} is not a solver", word.get_ref()));
        named.map(|(_, method)| *method).ok_or_else(fault)
    };
    words.iter().map(of).collect()
}

fn devices(doc: &Document<'_>, words: &Option<Vec<Spanned<String>>>) -> Result<Vec<RunsOn>> {
    match words {
        None => Ok(vec![RunsOn::Gpu, RunsOn::Cpu]),
        Some(words) => words.iter().map(|word| device(doc, word)).collect(),
    }
}

fn device(doc: &Document<'_>, word: &Spanned<String>) -> Result<RunsOn> {
    let fault = || doc.fault_at(word.span(), format!("{:?} is not a device", word.get_ref()));
    RunsOn::named(word.get_ref()).ok_or_else(fault)
}

/// Loads the scene with overrides and a solver.
fn load(
    doc: &Document<'_>,
    file: &SceneFile<'_>,
    set: &[&Spanned<String>],
    method: Method,
) -> Result<Scene> {
    let set = set.iter().map(|set| (set.get_ref().clone(), set.span()));
    load_with(doc, file, set.chain([(method.as_override(), 0..0)]))
}

#[cfg(test)]
mod tests {
    use super::filled;

    #[test]
    fn values_go_into_braces() {
        let fill = |text: &str| filled(text, 0.5);
        assert_eq!(
            fill("a=[{}, {3*}, {2/}]").as_deref(),
            Ok("a=[0.5, 1.5, 4.0]")
        );
        assert_eq!(fill("a={ b = 1 }").as_deref(), Ok("a={ b = 1 }"));
        assert_eq!(
            fill("a=[{ b = { c = 1 }, d = {2*} }]").as_deref(),
            Ok("a=[{ b = { c = 1 }, d = 1.0 }]")
        );
        assert!(fill("a={x*}").is_err());
        assert!(fill("a={").is_err());
    }
}
