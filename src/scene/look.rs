//! Looks: camera, light, water and output of a shot, apart from its physics.

pub mod spec;

mod keys;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize as _, de::DeserializeOwned};

use super::{Fault, Reach, document::Document, error::SceneError, key::Key};

pub(super) use keys::KEYS;
use keys::{MOST_SAMPLES, MOST_VOXELS};
pub use spec::{
    AovSpec, BasinSpec, CameraSpec, FilterSpec, FormatSpec, ImageSpec, KeyframeSpec, LookSpec,
    MethodSpec, OutputSpec, RendererSpec, RippleSpec, SkySpec, SplatSpec, SpraySpec, SunSpec,
    SurfaceSpec, TransformSpec, ViewSpec, WaterSpec, WhitewaterLook, WindowsSpec,
};

/// Why a look cannot be used.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct LookError(#[from] pub(super) SceneError);

/// The key of the panorama's file.
const PANORAMA: &str = "sky.file";

/// A validated look: every value in its range, every file that it names read.
#[derive(Clone, Debug)]
pub struct Look {
    spec: LookSpec,
    panorama: Option<Panorama>,
    hash: String,
}

/// A sky's picture, and where the look names it.
#[derive(Clone, Debug)]
struct Panorama {
    bytes: Arc<[u8]>,
    path: PathBuf,
    /// Where the look names it.
    place: Fault,
}

impl Look {
    /// Reads, parses and validates a look file.
    ///
    /// # Errors
    /// That the file cannot be read, or its first fault, with line, key and what is allowed.
    pub fn load(path: &Path) -> Result<Self, LookError> {
        Self::load_within(path, Reach::Folder)
    }

    /// [`Look::load`] with a panorama from as far as `reach` says.
    ///
    /// # Errors
    /// As [`Look::load`].
    pub fn load_within(path: &Path, reach: Reach) -> Result<Self, LookError> {
        Self::load_with(path, &[], reach)
    }

    /// [`Look::load_within`] with overrides laid over it, as `key=value`.
    ///
    /// # Errors
    /// As [`Look::load`].
    pub fn load_with(path: &Path, overrides: &[String], reach: Reach) -> Result<Self, LookError> {
        let text = std::fs::read_to_string(path).map_err(|source| SceneError::Read {
            file: path.to_owned(),
            source,
        })?;
        Ok(Self::parse_with(&text, path, overrides, reach)?)
    }

    /// Parses and validates the text of a look; `file` names it in errors, and its folder is where a
    /// relative panorama is looked for, which it must not leave.
    ///
    /// # Errors
    /// As [`Look::load`].
    pub fn parse(text: &str, file: &Path) -> Result<Self, LookError> {
        Ok(Self::parse_with(text, file, &[], Reach::Folder)?)
    }

    fn parse_with(
        text: &str,
        file: &Path,
        overrides: &[String],
        reach: Reach,
    ) -> Result<Self, SceneError> {
        let (doc, mut root) = Document::parse(text, file, overrides, KEYS)?;
        let doc = doc.within(reach);
        doc.settle(&mut root)?;
        let spec = LookSpec::deserialize(toml::Deserializer::from(root))
            .map_err(|error| doc.translate(&error))?;
        check_camera(&doc, &spec)?;
        check_output(&doc, &spec.output)?;
        let panorama = match &spec.sky {
            SkySpec::Panorama { file: name, .. } => Some(panorama(&doc, file, name)?),
            SkySpec::HosekWilkie { .. } => None,
        };
        let bytes = panorama.as_ref().map(|sky| sky.bytes.as_ref());
        let hash = canonical_hash(&spec, bytes);
        Ok(Self {
            spec,
            panorama,
            hash,
        })
    }

    /// What the file says, defaults filled in.
    pub fn spec(&self) -> &LookSpec {
        &self.spec
    }

    /// Bytes of the sky panorama's EXR, where the look has one.
    pub fn panorama(&self) -> Option<&[u8]> {
        self.panorama.as_ref().map(|sky| sky.bytes.as_ref())
    }

    /// That its panorama is no picture that can be used, in the words of who tried; `None` where it has none.
    pub fn panorama_fault(&self, problem: &str) -> Option<LookError> {
        let sky = self.panorama.as_ref()?;
        let fault = Fault {
            message: format!("the panorama {}: {problem}", sky.path.display()),
            ..sky.place.clone()
        };
        Some(LookError(SceneError::Fault(Box::new(fault))))
    }

    /// BLAKE3, hex, over the content: every value with its default, and the panorama's bytes, whatever
    /// the files are called and however they are laid out.
    pub fn hash(&self) -> String {
        self.hash.clone()
    }

    /// Whether the EXR asks for this AOV.
    pub fn wants(&self, aov: AovSpec) -> bool {
        self.spec.output.aovs.contains(&aov)
    }

    /// The look for pictures of the water's surface alone, its depth and normals at pixels' centres at the frame's instant, by
    /// `method`: every particle belongs to the surface.
    #[must_use]
    pub fn of_surface(&self, method: MethodSpec) -> Self {
        self.changed(|spec| {
            spec.renderer.method = method;
            spec.water.spray = None;
            spec.whitewater = None;
            (spec.image.samples, spec.image.shutter) = (1, 0.0);
            spec.output.formats = vec![FormatSpec::Exr];
            spec.output.aovs = vec![AovSpec::Z, AovSpec::N];
        })
    }

    /// The look for pictures of the water alone by `method`: spray as the look has it, no whitewater, nothing beside the picture.
    #[must_use]
    pub fn of_water(&self, method: MethodSpec) -> Self {
        self.changed(|spec| {
            spec.renderer.method = method;
            spec.whitewater = None;
            spec.output.aovs = Vec::new();
        })
    }

    /// Rays that are `samples` times as many a pixel, through voxels `voxels` times as fine; up to what the keys take.
    #[must_use]
    pub fn finer(&self, samples: u32, voxels: f64) -> Self {
        self.changed(|spec| {
            spec.renderer.method = MethodSpec::Ray;
            spec.image.samples = (samples * spec.image.samples).min(MOST_SAMPLES);
            let finer = voxels * spec.surface.voxels_per_spacing;
            spec.surface.voxels_per_spacing = finer.min(MOST_VOXELS);
        })
    }

    /// With a camera that stands still at `position`, metres, and looks at `target`.
    #[must_use]
    pub fn standing(&self, position: DVec3, target: DVec3, focal_length_mm: f64) -> Self {
        self.changed(|spec| {
            spec.camera.position = Some(position.to_array());
            spec.camera.target = Some(target.to_array());
            spec.camera.focal_length_mm = focal_length_mm;
            spec.camera.keyframes = Vec::new();
        })
    }

    fn changed(&self, change: impl FnOnce(&mut LookSpec)) -> Self {
        let mut look = self.clone();
        change(&mut look.spec);
        look.hash = canonical_hash(&look.spec, look.panorama());
        look
    }

    /// Direction from the ground to the sun, unit length.
    pub fn sun_direction(&self) -> DVec3 {
        let azimuth = self.spec.sun.azimuth_degrees.to_radians();
        let elevation = self.spec.sun.elevation_degrees.to_radians();
        DVec3::new(
            elevation.cos() * azimuth.cos(),
            elevation.sin(),
            elevation.cos() * azimuth.sin(),
        )
    }
}

fn canonical_hash(spec: &LookSpec, panorama: Option<&[u8]>) -> String {
    let mut hasher = blake3::Hasher::new();
    // `Debug` of a float is its shortest exact text, so equal values give equal text and only they do.
    let mut canonical = spec.clone();
    if let SkySpec::Panorama { file, .. } = &mut canonical.sky {
        *file = Path::new("").to_owned();
    }
    // A look that does without has the hash that it had before there were whitewater, rays and choices of voxels and splats.
    let text = format!("{canonical:?}")
        .replace("whitewater: None, ", "")
        .replace("renderer: RendererSpec { method: Ssfr }, ", "")
        .replace("voxels_per_spacing: 2.0, ", "")
        .replace("splat: Ellipsoid, ", "");
    hasher.update(text.as_bytes());
    if let Some(bytes) = panorama {
        hasher.update(blake3::hash(bytes).as_bytes());
    }
    hasher.finalize().to_hex().to_string()
}

/// The values of a table in which every key has a default.
///
/// # Panics
/// Where a key has none; a test has no such table.
fn default_of<T: DeserializeOwned>(keys: &'static [Key]) -> T {
    let settled = Document::parse("", Path::new(""), &[], keys).and_then(|(doc, mut root)| {
        doc.settle(&mut root)?;
        T::deserialize(toml::Deserializer::from(root)).map_err(|error| doc.translate(&error))
    });
    settled.expect("every key of the table has a default")
}

/// Reads the picture that the look `file` names.
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
    let (camera, image) = (&spec.camera, &spec.image);
    let [width, height] = camera.film_back_mm;
    let wanted = width * f64::from(image.height) / f64::from(image.width);
    if (wanted / height - 1.0).abs() > 0.005 {
        let message = format!(
            "is not the shape of a {} × {} image; allowed is [{width}, {wanted:.4}]",
            image.width, image.height
        );
        return Err(doc.fault_of_plain("camera.film_back_mm", message));
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
        check_pose(doc, &path, camera, key.position, key.target)?;
    }
    Ok(())
}

/// A line of sight that has a direction, other than that of the camera's `up`.
fn check_pose(
    doc: &Document<'_>,
    path: &str,
    camera: &CameraSpec,
    position: [f64; 3],
    target: [f64; 3],
) -> Result<(), SceneError> {
    let forward = DVec3::from(target) - DVec3::from(position);
    if forward.length() < 1e-6 {
        return Err(doc.fault_of(&format!("{path}.target"), "is where the camera stands"));
    }
    let up = DVec3::from(camera.up).normalize_or_zero();
    if forward.normalize().cross(up).length() < 1e-6 {
        return Err(doc.fault_of("camera.up", "is zero or along the line of sight"));
    }
    Ok(())
}

fn check_output(doc: &Document<'_>, output: &OutputSpec) -> Result<(), SceneError> {
    if output.formats.is_empty() {
        return Err(doc.fault_of("output.formats", "is empty"));
    }
    if !output.aovs.is_empty() && !output.formats.contains(&FormatSpec::Exr) {
        let message = "AOVs are written to EXR; add it to `formats`";
        return Err(doc.fault_of_plain("output.aovs", message));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
