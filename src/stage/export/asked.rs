//! Validates an export request.

use std::collections::BTreeSet;

use super::{ExportError, ExportRequest, Target, UsdWater, beside};

/// Refuses targets that cannot be combined, and file names that two targets share.
pub(super) fn check(request: &ExportRequest) -> Result<(), ExportError> {
    let asked = |what: String| Err(ExportError::Asked(what));
    if request.targets.is_empty() {
        return Err(ExportError::Nothing);
    }
    let has_shot = request
        .targets
        .iter()
        .any(|it| matches!(it, Target::Usd(..)));
    if request.whitewater.is_some() && !has_shot {
        return asked(
            "a USD shot has whitewater beside the water, but no USD shot is exported".to_owned(),
        );
    }
    if request.look.is_some() && !has_shot {
        return asked(
            "a look gives a USD shot its camera, materials and light, but no USD shot is exported"
                .to_owned(),
        );
    }
    check_whitewater(request)?;
    if request.wet.is_some() && !has_shot {
        return asked("wetness is of the solids of a USD shot, but none is exported".to_owned());
    }
    if let (Some(wet), Some(stream)) = (&request.wet, &request.stream) {
        return asked(format!(
            "the shot of the stream `{stream}` has no solids that could have the wetness `{wet}`"
        ));
    }
    let mut names = BTreeSet::new();
    for target in &request.targets {
        let (kind, ending, file, allowed): (_, _, _, &[&str]) = match target {
            Target::Mesh(files) => (
                "a mesh",
                files.ending(),
                files.file(1),
                &["ply", "obj", "usda", "usd", "usdc"],
            ),
            Target::Npy(files) => ("npy", files.ending(), files.file(1), &["npy"]),
            Target::Csv(files) => ("csv", files.ending(), files.file(1), &["csv"]),
            Target::Bgeo(files) => ("bgeo", files.ending(), files.file(1), &["bgeo"]),
            Target::Vdb(files) => ("vdb", files.ending(), files.file(1), &["vdb"]),
            Target::Fog(files) => ("fog", files.ending(), files.file(1), &["vdb"]),
            Target::Usd(file, _) => {
                let ending = file.extension().unwrap_or_default().to_string_lossy();
                (
                    "a USD shot",
                    ending.to_lowercase(),
                    beside(file, "0001"),
                    &["usda", "usd", "usdc"],
                )
            }
        };
        if !allowed.contains(&ending.as_str()) {
            let allowed = allowed.join(", .");
            return asked(format!(
                "{kind} is written as .{allowed}, and the name ends in `{ending}`"
            ));
        }
        if let Target::Usd(file, _) = target {
            // The root names its layers, and USD's text format cannot represent these characters.
            let name = file.file_name().unwrap_or_default();
            if name.to_str().is_none_or(|it| it.contains(char::is_control)) {
                return asked(format!(
                    "{kind}: {name:?} has a line end, another control character or bytes that are \
                     not UTF-8, which USD as text cannot have in the name of a layer"
                ));
            }
        }
        let is_water = match target {
            Target::Mesh(_) | Target::Vdb(_) => true,
            Target::Usd(_, water) => *water == UsdWater::Mesh,
            _ => false,
        };
        if let (true, Some(stream)) = (is_water, &request.stream) {
            return asked(format!(
                "{kind}: the stream `{stream}` has points, and no surface"
            ));
        }
        if !names.insert(file.clone()) {
            return asked(format!("two kinds of files would be {}", file.display()));
        }
    }
    Ok(())
}

/// Refuses what needs a stream and has none, and foam where no vertex can have it.
fn check_whitewater(request: &ExportRequest) -> Result<(), ExportError> {
    let is_fog = |target: &Target| matches!(target, Target::Fog(_));
    if request.stream.is_none() && request.targets.iter().any(is_fog) {
        return Err(ExportError::NoFog);
    }
    let has_particles = request.stream.is_some() || request.whitewater.is_some();
    if request.kinds.is_some() && !has_particles {
        return Err(ExportError::Kinds);
    }
    if let (Some(stream), Some(_)) = (&request.stream, &request.whitewater) {
        return Err(ExportError::Asked(format!(
            "a shot has whitewater beside the water, and the stream `{stream}` is in place of it"
        )));
    }
    if request.foam.is_none() {
        return Ok(());
    }
    let mut meshes = 0;
    for target in &request.targets {
        match target {
            Target::Mesh(files) if files.ending() == "obj" => {
                return Err(ExportError::Foam(
                    "OBJ has no place for values of vertices; write the mesh as .ply, .usda, .usd \
                     or .usdc"
                        .to_owned(),
                ));
            }
            Target::Mesh(_) | Target::Usd(_, UsdWater::Mesh) => meshes += 1,
            _ => {}
        }
    }
    match meshes {
        0 => Err(ExportError::Foam(
            "vertices of a mesh have it, and no mesh of the water is exported".to_owned(),
        )),
        _ => Ok(()),
    }
}
