//! Tolerance files: how far apart two caches or two pictures may be.

use std::{collections::BTreeMap, fs, ops::RangeInclusive, path::Path};

use serde::Deserialize;
use toml::Spanned;

use super::{
    document::{Document, unknown_key},
    error::SceneError,
    words::shown,
};
use crate::domain::{
    aggregates::Aggregates,
    tolerance::{FieldLimits, Limit, PictureLimits, Tolerance},
};

type Number = Option<Spanned<f64>>;

/// What a difference may be; sums of them are finite.
const LIMIT: RangeInclusive<f64> = 0.0..=1e300;

/// What the perceptual score may be: pictures that have nothing in common have negative ones.
const SCORE: RangeInclusive<f64> = -1e6..=100.0;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ToleranceSpec {
    position: Option<FieldSpec>,
    velocity: Option<FieldSpec>,
    #[serde(default)]
    attributes: BTreeMap<String, FieldSpec>,
    #[serde(default)]
    aggregates: BTreeMap<Spanned<String>, LimitSpec>,
    pictures: Option<PictureSpec>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FieldSpec {
    max: Number,
    rms: Number,
    p99: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitSpec {
    absolute: Number,
    relative: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PictureSpec {
    mean: Number,
    p99: Number,
    max: Number,
    perceptual: Number,
}

/// Loads a tolerance file.
///
/// # Errors
/// [`SceneError`], with file, line and key; a file that limits nothing is one.
pub fn load(path: &Path) -> Result<Tolerance, SceneError> {
    let text = fs::read_to_string(path).map_err(|source| SceneError::Read {
        file: path.to_owned(),
        source,
    })?;
    parse(&text, path)
}

/// [`load`] on a text; `file` names it in messages.
///
/// # Errors
/// Those of [`load`].
pub fn parse(text: &str, file: &Path) -> Result<Tolerance, SceneError> {
    let (doc, root) = Document::parse(text, file, &[])?;
    let spec = ToleranceSpec::deserialize(toml::Deserializer::from(root))
        .map_err(|error| doc.translate(&error))?;
    let tolerance = Tolerance {
        fields: fields(&doc, &spec)?,
        aggregates: aggregates(&doc, &spec)?,
        pictures: pictures(&doc, spec.pictures.as_ref())?,
    };
    if tolerance == Tolerance::default() {
        let problem = "it limits nothing; allowed: [position], [velocity], [attributes.NAME], [aggregates], [pictures]";
        return Err(doc.fault_plain(0..0, problem.to_owned()));
    }
    Ok(tolerance)
}

fn fields(
    doc: &Document<'_>,
    spec: &ToleranceSpec,
) -> Result<BTreeMap<String, FieldLimits>, SceneError> {
    let own = [("position", &spec.position), ("velocity", &spec.velocity)];
    let own = own
        .into_iter()
        .filter_map(|(name, spec)| Some((name.to_owned(), spec.as_ref()?)));
    let attributes = spec.attributes.iter().map(|(name, s)| (name.clone(), s));
    let mut fields = BTreeMap::new();
    for (name, spec) in own.chain(attributes) {
        let limits = FieldLimits {
            max: from_zero(doc, &spec.max)?,
            rms: from_zero(doc, &spec.rms)?,
            p99: from_zero(doc, &spec.p99)?,
        };
        if limits != FieldLimits::default() {
            fields.insert(name, limits);
        }
    }
    Ok(fields)
}

fn aggregates(
    doc: &Document<'_>,
    spec: &ToleranceSpec,
) -> Result<BTreeMap<String, Limit>, SceneError> {
    let names = Aggregates::NAMES.map(|(name, _)| name.to_owned());
    let mut limits = BTreeMap::new();
    for (name, spec) in &spec.aggregates {
        if !names.contains(name.get_ref()) {
            return Err(doc.fault_plain(name.span(), unknown_key(name.get_ref(), &names)));
        }
        let (absolute, relative) = (
            from_zero(doc, &spec.absolute)?,
            from_zero(doc, &spec.relative)?,
        );
        if absolute.is_none() && relative.is_none() {
            let message = "no limit; allowed: absolute, relative or both, which then add up";
            return Err(doc.fault_plain(name.span(), message.to_owned()));
        }
        let limit = Limit {
            absolute: absolute.unwrap_or(0.0),
            relative: relative.unwrap_or(0.0),
        };
        limits.insert(name.get_ref().clone(), limit);
    }
    Ok(limits)
}

fn pictures(doc: &Document<'_>, spec: Option<&PictureSpec>) -> Result<PictureLimits, SceneError> {
    let Some(spec) = spec else {
        return Ok(PictureLimits::default());
    };
    let perceptual = &spec.perceptual;
    if let Some(score) = perceptual
        && !SCORE.contains(score.get_ref())
    {
        let message = format!(
            "{} is out of range; allowed: a score from -1e6 to 100, which is no visible difference",
            shown(*score.get_ref())
        );
        return Err(doc.fault_plain(score.span(), message));
    }
    Ok(PictureLimits {
        mean: from_zero(doc, &spec.mean)?,
        p99: from_zero(doc, &spec.p99)?,
        max: from_zero(doc, &spec.max)?,
        perceptual: perceptual.as_ref().map(|score| *score.get_ref()),
    })
}

fn from_zero(doc: &Document<'_>, number: &Number) -> Result<Option<f64>, SceneError> {
    match number {
        Some(number) if !LIMIT.contains(number.get_ref()) => {
            let message = format!(
                "{} is out of range; allowed: a number from 0 to 1e300",
                shown(*number.get_ref())
            );
            Err(doc.fault_plain(number.span(), message))
        }
        other => Ok(other.as_ref().map(|number| *number.get_ref())),
    }
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
        let text = "[position]\nmax = 0.1\n[velocity]\nrms = 1\np99 = 2.5\n[attributes.cx_x]\nmax = 3\n\
            [aggregates]\nvolume = { relative = 0.01 }\nfront = { absolute = 0.2, relative = 0.1 }\n\
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
