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
    if request.look.is_some() && !has_shot {
        return asked(
            "the look gives a USD shot its camera, but no USD shot is exported".to_owned(),
        );
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
