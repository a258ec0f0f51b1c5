//! Tolerance files: limits on the differences between two caches or two pictures.

use std::{collections::BTreeMap, path::Path};

use serde::Deserialize;
use toml::Spanned;

use super::{
    document::Document,
    key::{ANY, Interval, Key},
};
use swell_domain::{
    aggregates::Aggregates,
    text,
    tolerance::{ErrorLimit, FieldLimits, PictureLimits, Tolerance},
};
use swell_scene::SceneError;

/// Range of a difference; bounded so that sums stay finite.
const DIFFERENCE: Interval = 0.0..=1e300;

const MAX: Key = Key::number("max", DIFFERENCE)
    .absent()
    .about("of the worst particle or pixel");
const P99: Key = Key::number("p99", DIFFERENCE)
    .absent()
    .about("99th percentile");

const FIELD: &[Key] = &[
    MAX,
    Key::number("rms", DIFFERENCE)
        .absent()
        .about("root mean square"),
    P99,
];

const LIMIT: &[Key] = &[
    Key::number("absolute", DIFFERENCE)
        .absent()
        .about("in the unit of the aggregate"),
    Key::number("relative", DIFFERENCE)
        .absent()
        .about("of the reference's value; both add up"),
];

/// One key per aggregate.
const AGGREGATES: [Key; 8] = {
    let mut keys = [const { Key::inline("", LIMIT).absent().about("A limit") }; 8];
    let mut at = 0;
    while at < keys.len() {
        keys[at].name = Aggregates::NAMES[at].0;
        at += 1;
    }
    keys
};

pub(super) const KEYS: &[Key] = &[
    Key::table("position", FIELD).absent().about("Metres"),
    Key::table("velocity", FIELD).absent().about("m/s"),
    Key::table(
        "attributes",
        &[Key::table(ANY, FIELD)
            .absent()
            .about("In the attribute's unit")],
    )
    .absent()
    .about("A table for each attribute"),
    Key::table("aggregates", &AGGREGATES)
        .absent()
        .about("A limit for each aggregate"),
    Key::table("pictures", PICTURES)
        .absent()
        .about("A pixel's error is its worst channel's; 1 is 255 in a PNG, linear white in an EXR"),
];

const PICTURES: &[Key] = &[
    Key::number("mean", DIFFERENCE)
        .absent()
        .about("over the pixels"),
    P99,
    MAX,
    // Pictures that have nothing in common have negative scores.
    Key::number("perceptual", -1e6..=100.0)
        .absent()
        .also(", which is no visible difference")
        .about("least SSIMULACRA 2 score; 90 is none to be seen"),
];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ToleranceSpec {
    position: Option<FieldLimits>,
    velocity: Option<FieldLimits>,
    #[serde(default)]
    attributes: BTreeMap<String, FieldLimits>,
    #[serde(default)]
    aggregates: BTreeMap<Spanned<String>, LimitSpec>,
    #[serde(default)]
    pictures: PictureLimits,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitSpec {
    absolute: Option<f64>,
    relative: Option<f64>,
}

/// Loads a tolerance file.
///
/// # Errors
/// [`SceneError`] with file, line and key; a file without any limit is an error.
pub fn load(path: &Path) -> Result<Tolerance, SceneError> {
    let text = text::read(path).map_err(|source| SceneError::Read {
        file: path.to_owned(),
        source,
    })?;
    parse(&text, path)
}

/// Parses a tolerance file as [`load`] does; `file` names it in messages.
///
/// # Errors
/// Those of [`load`].
pub fn parse(text: &str, file: &Path) -> Result<Tolerance, SceneError> {
    let (doc, mut root) = Document::parse(text, file, &[], KEYS)?;
    doc.settle(&mut root)?;
    let spec = ToleranceSpec::deserialize(toml::Deserializer::from(root))
        .map_err(|error| doc.translate(&error))?;
    let tolerance = Tolerance {
        aggregates: aggregates(&doc, &spec)?,
        pictures: spec.pictures,
        fields: fields(spec),
    };
    if tolerance == Tolerance::default() {
        let problem = "it limits nothing; allowed: [position], [velocity], [attributes.NAME], \
                       [aggregates], [pictures]";
        return Err(doc.fault_plain(0..0, problem.to_owned()));
    }
    Ok(tolerance)
}

/// Returns the non-empty limits by the name of their field.
fn fields(spec: ToleranceSpec) -> BTreeMap<String, FieldLimits> {
    let own = [("position", spec.position), ("velocity", spec.velocity)];
    let own = own.into_iter();
    let own = own.filter_map(|(name, limits)| Some((name.to_owned(), limits?)));
    let mut fields: BTreeMap<_, _> = own.chain(spec.attributes).collect();
    fields.retain(|_, limits| *limits != FieldLimits::default());
    fields
}

fn aggregates(
    doc: &Document<'_>,
    spec: &ToleranceSpec,
) -> Result<BTreeMap<String, ErrorLimit>, SceneError> {
    let mut limits = BTreeMap::new();
    for (name, spec) in &spec.aggregates {
        if spec.absolute.is_none() && spec.relative.is_none() {
            let message = "no limit; allowed: absolute, relative or both, which then add up";
            return Err(doc.fault_plain(name.span(), message.to_owned()));
        }
        let limit = ErrorLimit {
            absolute: spec.absolute.unwrap_or(0.0),
            relative: spec.relative.unwrap_or(0.0),
        };
        limits.insert(name.get_ref().clone(), limit);
    }
    Ok(limits)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(text: &str) -> String {
        let found = parse(text, Path::new("t.toml")).expect_err("a fault");
        found.to_string()
    }

    #[test]
    fn every_key() {
        let text = "[position]\nmax = 0.1\n[velocity]\nrms = 1\np99 = 2.5\n[attributes.cx_x]\n\
            max = 3\n\
            [aggregates]\nvolume = { relative = 0.01 }\n\
            front = { absolute = 0.2, relative = 0.1 }\n\
            [pictures]\nmean = 0.01\nperceptual = 90\n";
        let found = parse(text, Path::new("t.toml")).expect("valid");
        assert_eq!(found.fields["position"].max, Some(0.1));
        assert_eq!(found.fields["velocity"].p99, Some(2.5));
        assert_eq!(found.fields["cx_x"].max, Some(3.0));
        assert!((found.aggregates["front"].allowed(-3.0) - 0.5).abs() < 1e-12);
        assert_eq!(found.pictures.perceptual, Some(90.0));
        assert_eq!(found.pictures.max, None);
    }

    #[test]
    fn faults_name_file_line_key_and_what_is_allowed() {
        for (text, words) in [
            (
                "[positon]\nmax = 1",
                &["t.toml:1", "nearest is \"position\""][..],
            ),
            (
                "[position]\nmaximum = 1",
                &["t.toml:2: position.maximum", "\"max\"", "rms"],
            ),
            (
                "[position]\nmax = -1",
                &["t.toml:2: position.max", "from 0"],
            ),
            (
                "[velocity]\nrms = nan",
                &["t.toml:2: velocity.rms", "from 0"],
            ),
            (
                "[velocity]\nrms = \"x\"",
                &["t.toml:2: velocity.rms", "expected a number"],
            ),
            (
                "[aggregates]\nvolum = { relative = 1 }",
                &["t.toml:2: aggregates.volum", "nearest is \"volume\""],
            ),
            (
                "[aggregates]\nvolume = {}",
                &["t.toml:2: aggregates.volume", "absolute"],
            ),
            (
                "[pictures]\nperceptual = 101",
                &["t.toml:2: pictures.perceptual", "100"],
            ),
            ("", &["t.toml:1", "limits nothing", "[aggregates]"]),
            ("[position]", &["limits nothing"]),
        ] {
            let found = fault(text);
            for word in words {
                assert!(found.contains(word), "{text}: {found}");
            }
        }
    }
}
