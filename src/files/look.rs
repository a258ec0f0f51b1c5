//! Reads looks: camera, light, water and output of a shot.

pub mod camera_file;

mod keys;
mod materials;
mod mtl;
mod usd_camera;

use std::{path::Path, sync::Arc};

use glam::DVec3;
use serde::Deserialize as _;

use swell_domain::text;
use swell_scene::{
    SceneError,
    look::{
        CameraSpec, FormatSpec, ImageSpec, Look, LookError, LookParts, LookSpec, MethodSpec,
        OutputSpec, Panorama, SkySpec, camera_file::CameraFile,
    },
};

use super::{Reach, document::Document};
pub(super) use keys::KEYS;

const PANORAMA: &str = "sky.file";

const METHOD: &str = "renderer.method";

const CAMERA_FILE: &str = "camera.file";

const CAMERA_NAME: &str = "camera.name";

/// Relative tolerance between the aspect ratios of a camera file and of the image if the look sets
/// no `camera.fit`.
const SHAPE: f64 = 0.005;

/// Reads, parses and validates a look file.
///
/// # Errors
/// If the file cannot be read, or for its first fault, with line, key and allowed values.
pub fn load_look(path: &Path) -> Result<Look, LookError> {
    load_look_within(path, Reach::Folder)
}

/// [`load_look`] with files resolved within `reach`.
///
/// # Errors
/// Those of [`load_look`].
pub fn load_look_within(path: &Path, reach: Reach) -> Result<Look, LookError> {
    load_look_with(path, &[], reach)
}

/// [`load_look_within`] with `key=value` overrides applied to the file.
///
/// # Errors
/// Those of [`load_look`].
pub fn load_look_with(path: &Path, overrides: &[String], reach: Reach) -> Result<Look, LookError> {
    let text = text::read(path).map_err(|source| SceneError::Read {
        file: path.to_owned(),
        source,
    })?;
    Ok(parse_look_with(&text, path, overrides, reach)?)
}

/// Parses and validates the text of a look. Errors name `file`; relative paths start in its
/// folder and must not leave it.
///
/// # Errors
/// Those of [`load_look`].
pub fn parse_look(text: &str, file: &Path) -> Result<Look, LookError> {
    Ok(parse_look_with(text, file, &[], Reach::Folder)?)
}

fn parse_look_with(
    text: &str,
    file: &Path,
    overrides: &[String],
    reach: Reach,
) -> Result<Look, SceneError> {
    let (doc, mut root) = Document::parse(text, file, overrides, KEYS)?;
    let doc = doc.within(reach);
    doc.settle(&mut root)?;
    let spec = LookSpec::deserialize(toml::Deserializer::from(root))
        .map_err(|error| doc.translate(&error))?;
    check_camera(&doc, &spec)?;
    check_crop(&doc, &spec.image)?;
    check_shutter(&doc, &spec.image)?;
    check_output(&doc, &spec.output)?;
    check_sea(&doc, &spec)?;
    check_caustics(&doc, &spec)?;
    let panorama = match &spec.sky {
        SkySpec::Panorama { file: name, .. } => Some(panorama(&doc, file, name)?),
        SkySpec::HosekWilkie { .. } => None,
    };
    let camera = match &spec.camera.file {
        Some(name) => Some(file_camera(&doc, &spec, file, name)?),
        None => None,
    };
    let materials = materials::read(&doc, &spec, file)?;
    Ok(Look::new(LookParts {
        spec,
        panorama,
        camera,
        materials,
        method: doc.place_of(METHOD),
    }))
}

/// Reads the panorama named by the look `file`.
fn panorama(doc: &Document<'_>, file: &Path, name: &Path) -> Result<Panorama, SceneError> {
    let folder = file.parent().unwrap_or(Path::new("."));
    let path = doc.find(folder, PANORAMA, &name.to_string_lossy())?;
    let bytes = std::fs::read(&path).map_err(|error| {
        let problem = format!("cannot read {}: {error}", path.display());
        doc.fault_of(PANORAMA, problem)
    })?;
    Ok(Panorama {
        bytes: Arc::from(bytes),
        path,
        place: doc.place_of(PANORAMA),
    })
}

fn check_camera(doc: &Document<'_>, spec: &LookSpec) -> Result<(), SceneError> {
    let camera = &spec.camera;
    if camera.file.is_some() {
        return Ok(());
    }
    if camera.keyframes.is_empty() {
        let (Some(position), Some(target)) = (camera.position, camera.target) else {
            let message = "a camera needs `position` and `target`, or `[[camera.keyframe]]`";
            return Err(doc.fault_of_plain("camera.position", message));
        };
        return check_pose(doc, "camera", camera, position, target);
    }
    for (index, key) in camera.keyframes.iter().enumerate() {
        let path = format!("camera.keyframe[{index}]");
        if index > 0 && key.frame <= camera.keyframes[index - 1].frame {
            return Err(doc.fault_of_plain(&format!("{path}.frame"), "keyframes must ascend"));
        }
        if key.focus_distance_m.is_some() && camera.lens.is_none() {
            let path = format!("{path}.focus_distance_m");
            return Err(doc.fault_of_plain(&path, "a pinhole has no focus: add [camera.lens]"));
        }
        check_pose(doc, &path, camera, key.position, key.target)?;
    }
    Ok(())
}

/// Checks that the line of sight is not zero and not parallel to the camera's `up`.
fn check_pose(
    doc: &Document<'_>,
    path: &str,
    camera: &CameraSpec,
    position: [f64; 3],
    target: [f64; 3],
) -> Result<(), SceneError> {
    let forward = DVec3::from(target) - DVec3::from(position);
    if forward.length() < 1e-6 {
        return Err(doc.fault_of(&format!("{path}.target"), "is the position of the camera"));
    }
    let up = DVec3::from(camera.up).normalize_or_zero();
    if forward.normalize().cross(up).length() < 1e-6 {
        return Err(doc.fault_of("camera.up", "is zero or along the line of sight"));
    }
    Ok(())
}

fn check_crop(doc: &Document<'_>, image: &ImageSpec) -> Result<(), SceneError> {
    let Some(crop) = image.crop else {
        return Ok(());
    };
    let fault = |message: String| Err(doc.fault_of_plain("image.crop", message));
    if image.overscan > 0 {
        return fault("given together with overscan".to_owned());
    }
    if crop.iter().any(|side| side.fract() != 0.0) {
        return fault(format!("{crop:?} is not in whole pixels"));
    }
    let [x0, y0, x1, y1] = crop;
    let (width, height) = (image.width, image.height);
    if x0 >= x1 || y0 >= y1 || x1 > f64::from(width) || y1 > f64::from(height) {
        return fault(format!(
            "{crop:?} is not inside a {width} × {height} image; allowed: [x0, y0, x1, y1] with 0 ≤ \
             x0 < x1 ≤ {width} and 0 ≤ y0 < y1 ≤ {height}"
        ));
    }
    Ok(())
}

fn check_shutter(doc: &Document<'_>, image: &ImageSpec) -> Result<(), SceneError> {
    match image.shutter_ramps {
        Some([open, close]) if open + close > 1.0 => {
            let problem = format!("opens for {open} and closes for {close} of the time");
            Err(doc.fault_of("image.shutter_ramps", problem))
        }
        _ => Ok(()),
    }
}

/// Reads the camera named by the look `file`.
fn file_camera(
    doc: &Document<'_>,
    spec: &LookSpec,
    file: &Path,
    name: &Path,
) -> Result<CameraFile, SceneError> {
    let folder = file.parent().unwrap_or(Path::new("."));
    let path = doc.find(folder, CAMERA_FILE, &name.to_string_lossy())?;
    let fault =
        |problem: String| doc.fault_of_plain(CAMERA_FILE, format!("{}: {problem}", path.display()));
    let bytes = std::fs::read(&path).map_err(|error| {
        let problem = format!("cannot read {}: {error}", path.display());
        doc.fault_of(CAMERA_FILE, problem)
    })?;
    let beside = path.parent().unwrap_or(Path::new("."));
    let read = |name: &str| {
        let path = doc.reach().find(beside, Path::new(name))?;
        std::fs::read(&path).map_err(|error| format!("cannot read {}: {error}", path.display()))
    };
    let camera = camera_file::read(&bytes, spec.camera.name.as_deref(), &read).map_err(
        |error| match error.is_of_name() {
            true => doc.fault_of_plain(CAMERA_NAME, format!("{}: {error}", path.display())),
            false => fault(error.to_string()),
        },
    )?;
    if spec.camera.fit.is_some() {
        return Ok(camera);
    }
    let shape = f64::from(spec.image.width) / f64::from(spec.image.height);
    match camera.aspect_ratio() {
        Some(aspect) if (aspect / shape - 1.0).abs() > SHAPE => Err(fault(format!(
            "its camera has an aspect ratio of {aspect:.4}, a {} × {} image has {shape:.4}; make \
             them the same, or set camera.fit",
            spec.image.width, spec.image.height
        ))),
        _ => Ok(camera),
    }
}

fn check_output(doc: &Document<'_>, output: &OutputSpec) -> Result<(), SceneError> {
    if output.formats.is_empty() {
        return Err(doc.fault_of("output.formats", "is empty"));
    }
    if !output.aovs.is_empty() && !output.formats.contains(&FormatSpec::Exr) {
        let message = "AOVs are written to EXR; add it to `formats`";
        return Err(doc.fault_of_plain("output.aovs", message));
    }
    if !output.lights.is_empty() && !output.formats.contains(&FormatSpec::Exr) {
        let message = "layers of light are written to EXR; add it to `formats`";
        return Err(doc.fault_of_plain("output.lights", message));
    }
    if output.cryptomatte && !output.formats.contains(&FormatSpec::Exr) {
        let message = "mattes are written to EXR; add it to `formats`";
        return Err(doc.fault_of_plain("output.cryptomatte", message));
    }
    Ok(())
}

fn check_sea(doc: &Document<'_>, spec: &LookSpec) -> Result<(), SceneError> {
    let Some(sea) = &spec.sea else {
        return Ok(());
    };
    if sea.sides.is_empty() {
        return Err(doc.fault_of("sea.sides", "is empty"));
    }
    if let Some(waves) = &sea.waves
        && waves
            .shortest_period_s
            .is_some_and(|it| it >= waves.peak_period_s)
    {
        let problem = "is not below sea.waves.peak_period_s";
        return Err(doc.fault_of("sea.waves.shortest_period_s", problem));
    }
    Ok(())
}

fn check_caustics(doc: &Document<'_>, spec: &LookSpec) -> Result<(), SceneError> {
    if spec.water.caustics.is_none() || spec.renderer.method == MethodSpec::Ray {
        return Ok(());
    }
    let message = "splats have no rays from the sun: set [renderer] method = \"ray\"";
    Err(doc.fault_of_plain("water.caustics", message))
}

#[cfg(test)]
mod tests;
