//! Writes the scene with the chosen settings and the reason beside each.

use std::{
    fs, io,
    path::{Path, PathBuf},
};
use swell_files::parse_scene_within;

use swell_domain::output::{self, FileError};
use swell_files::{
    edit::{Setting, with_settings},
    physics_hash,
    study::tune::Tune,
};
use swell_scene::Scene;

use super::{super::StudyError, Trial, TuneResults};

/// First words of a scene that may be overwritten.
const MARK: &str = "# Tuned by swell from ";

/// Checks before the first run that the target file does not exist or is a tuned scene.
pub(super) fn check_target(tune: &Tune) -> Result<(), StudyError> {
    let file = &tune.request.target;
    match fs::read_to_string(file) {
        Ok(text) if text.starts_with(MARK) => Ok(()),
        Ok(_) => Err(StudyError::NotTuned(file.clone())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(FileError::new(file, error).into()),
    }
}

/// Writes the scene of the chosen run; returns `None` and writes nothing where no run meets the
/// limits.
pub(super) fn write(
    results: &TuneResults<'_>,
    command: &str,
) -> Result<Option<PathBuf>, StudyError> {
    let Some((place, true)) = results.choice else {
        return Ok(None);
    };
    let (tune, trial) = (results.tune, &results.trials[place]);
    let file = &tune.request.target;
    let unfit = |what: String| StudyError::Point(format!("{}: {what}", file.display()));
    let text = with_settings(&tune.text, &settings(results, trial)).map_err(unfit)?;
    let text = header(results, trial, command) + &text;
    // Parses the text again to verify that it describes the scene that was run.
    let folder = file.parent().unwrap_or(Path::new(""));
    let read = parse_scene_within(&text, file, folder, &[], tune.request.reach);
    let is_it = |scene: &Scene| physics_hash(scene) == physics_hash(&trial.variant.scene);
    if !read.as_ref().is_ok_and(is_it) {
        let why = read.err().map_or(String::new(), |e| format!(": {e}"));
        return Err(unfit(format!(
            "these settings cannot be written into the scene{why}; run it with {}",
            trial.variant.name()
        )));
    }
    output::write_named(file, text)?;
    Ok(Some(file.clone()))
}

/// Comment lines above the scene.
fn header(results: &TuneResults<'_>, trial: &Trial<'_>, command: &str) -> String {
    let scene = results.tune.request.scene.file_name().unwrap_or_default();
    let mut lines = vec![
        format!("{}: {command}", scene.to_string_lossy()),
        format!("# {}.", results.off(trial)),
        format!("# {}.", results.time(trial)),
    ];
    let told = results.not_promised();
    lines.extend(told.iter().map(|text| format!("# {text}")));
    format!("{MARK}{}\n\n", lines.join("\n"))
}

fn settings(results: &TuneResults<'_>, trial: &Trial<'_>) -> Vec<Setting> {
    let tune = results.tune;
    let solver = tune.request.solver.map(|method| Setting {
        key: "solver.method".into(),
        value: format!("{:?}", method.name()),
        reason: "tune: the solver asked for".into(),
    });
    let chosen = results
        .settings(trial)
        .into_iter()
        .map(|(setting, own)| Setting {
            reason: results.reason(trial, setting.key, &setting.value, &own),
            key: setting.key.into(),
            value: setting.value,
        });
    let chosen: Vec<Setting> = chosen.collect();
    let is_new = |key: &str| chosen.iter().all(|it| it.key != key);
    let set = trial.variant.set.iter().filter(|it| is_new(it.key));
    let with_others = set.map(|it| Setting {
        key: it.key.into(),
        value: it.value.clone(),
        reason: "tune: as the settings beside it ask".into(),
    });
    let with_others: Vec<Setting> = with_others.collect();
    solver
        .into_iter()
        .chain(chosen)
        .chain(with_others)
        .collect()
}
