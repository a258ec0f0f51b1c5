//! Looks: camera, light, water and output of a shot, separate from its physics.

pub mod camera_file;
pub mod spec;

mod film;
mod keys;
mod lens;
mod lint;
mod materials;
mod mtl;
mod usd_camera;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize as _, de::DeserializeOwned};

use super::{Fault, Reach, document::Document, error::SceneError, key::Key};

use swell_domain::text;

use camera_file::CameraFile;
pub use film::Framing;
pub(super) use keys::KEYS;
use keys::{MOST_SAMPLES, MOST_VOXELS};
pub use materials::{Material, Materials, Picture, Texture};
pub use spec::{
    AovFilterSpec, AovSpec, BasinSpec, CameraSpec, CausticsSpec, ColourSpaceSpec, CurveSpec,
    FilterSpec, FitSpec, FormatSpec, ImageSpec, KeyframeSpec, LensSpec, LightSpec, LookSpec,
    MaterialSpec, MethodSpec, OutputSpec, RendererSpec, RippleSpec, SeaSpec, SeaWavesSpec, SkySpec,
    SolidsOutput, SplatSpec, SpraySpec, SunSpec, SurfaceSpec, TextureSpec, TransformSpec, ViewSpec,
    WaterSpec, WaveMakersSpec, WhitewaterLook, WindowsSpec,
};

/// A rectangle of pixels, relative to the upper-left pixel of the look's image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Window {
    /// Column and row of the upper-left pixel; negative with overscan.
    pub corner: [i32; 2],
    /// Width and height, pixels.
    pub size: [u32; 2],
}

/// Why a look cannot be loaded or used.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct LookError(#[from] pub(super) SceneError);

impl LookError {
    /// Whether a path leads farther than its [`Reach`] allows.
    pub fn leads_out(&self) -> bool {
        self.0.leads_out()
    }
}

const PANORAMA: &str = "sky.file";

const METHOD: &str = "renderer.method";

const CAMERA_FILE: &str = "camera.file";
const CAMERA_NAME: &str = "camera.name";

/// Relative tolerance between the aspect ratios of a camera file and of the image if the look sets
/// no `camera.fit`.
const SHAPE: f64 = 0.005;

/// A validated look: every value is in range and every referenced file is read.
#[derive(Clone, Debug)]
pub struct Look {
    spec: LookSpec,
    panorama: Option<Panorama>,
    camera: Option<Arc<CameraFile>>,
    materials: Option<Arc<Materials>>,
    /// Location of `renderer.method` in the look file.
    method: Fault,
    hash: String,
}

/// Panorama of a sky.
#[derive(Clone, Debug)]
struct Panorama {
    bytes: Arc<[u8]>,
    path: PathBuf,
    /// Location of its key in the look file.
    place: Fault,
}

impl Look {
    /// Reads, parses and validates a look file.
    ///
    /// # Errors
    /// If the file cannot be read, or for its first fault, with line, key and allowed values.
    pub fn load(path: &Path) -> Result<Self, LookError> {
        Self::load_within(path, Reach::Folder)
    }

    /// [`Look::load`] with files resolved within `reach`.
    ///
    /// # Errors
    /// Those of [`Look::load`].
    pub fn load_within(path: &Path, reach: Reach) -> Result<Self, LookError> {
        Self::load_with(path, &[], reach)
    }

    /// [`Look::load_within`] with `key=value` overrides applied to the file.
    ///
    /// # Errors
    /// Those of [`Look::load`].
    pub fn load_with(path: &Path, overrides: &[String], reach: Reach) -> Result<Self, LookError> {
        let text = text::read(path).map_err(|source| SceneError::Read {
            file: path.to_owned(),
            source,
        })?;
        Ok(Self::parse_with(&text, path, overrides, reach)?)
    }

    /// Parses and validates the text of a look. Errors name `file`; relative paths start in its
    /// folder and must not leave it.
    ///
    /// # Errors
    /// Those of [`Look::load`].
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
            Some(name) => Some(Arc::new(file_camera(&doc, &spec, file, name)?)),
            None => None,
        };
        let materials = Materials::read(&doc, &spec, file)?;
        let mut look = Self {
            spec,
            panorama,
            camera,
            materials,
            method: doc.place_of(METHOD),
            hash: String::new(),
        };
        look.hash = look.canonical_hash();
        Ok(look)
    }

    /// Returns the values of the file with defaults filled in.
    pub fn spec(&self) -> &LookSpec {
        &self.spec
    }

    /// Returns the bytes of the sky panorama's EXR, if the look has one.
    pub fn panorama(&self) -> Option<&[u8]> {
        self.panorama.as_ref().map(|sky| sky.bytes.as_ref())
    }

    /// Returns the camera read from `camera.file`, if the look names one.
    pub fn camera_file(&self) -> Option<&CameraFile> {
        self.camera.as_deref()
    }

    /// Returns an error that reports `problem` with the panorama; `None` if the look has no
    /// panorama.
    pub fn panorama_fault(&self, problem: &str) -> Option<LookError> {
        let sky = self.panorama.as_ref()?;
        let fault = Fault {
            message: format!("the panorama {}: {problem}", sky.path.display()),
            ..sky.place.clone()
        };
        Some(LookError(SceneError::Fault(Box::new(fault))))
    }

    /// Returns an error that reports `problem` with the chosen rendering method.
    pub fn method_fault(&self, problem: &str) -> LookError {
        let fault = Fault {
            message: problem.to_owned(),
            ..self.method.clone()
        };
        LookError(SceneError::Fault(Box::new(fault)))
    }

    /// Returns the BLAKE3 hash of the content, hexadecimal: all values including defaults, and the
    /// bytes of the referenced files. File names and layout do not affect it.
    pub fn hash(&self) -> String {
        self.hash.clone()
    }

    /// Returns the time in the camera file at a (fractional) frame number, seconds. Frame 1 is at
    /// `camera.start` if set; otherwise frame 0 is at time 0.
    pub fn camera_seconds(&self, frame: f64, frames_per_second: f64) -> f64 {
        let start = self.camera_file().zip(self.spec.camera.start);
        match start {
            None => frame / frames_per_second,
            Some((file, start)) => {
                let rate = file
                    .rate()
                    .map_or(frames_per_second, |it| it.codes_per_second);
                start / rate + (frame - 1.0) / frames_per_second
            }
        }
    }

    /// Returns the rectangle of pixels to render.
    pub fn window(&self) -> Window {
        let image = &self.spec.image;
        let over = image.overscan;
        match image.crop {
            // `check_crop` has checked that these are whole numbers within the image.
            Some([x0, y0, x1, y1]) => Window {
                corner: [x0 as i32, y0 as i32],
                size: [(x1 - x0) as u32, (y1 - y0) as u32],
            },
            None => Window {
                corner: [-(over as i32); 2],
                size: [image.width, image.height].map(|side| side + 2 * over),
            },
        }
    }

    /// Returns whether the EXR includes this AOV.
    pub fn wants(&self, aov: AovSpec) -> bool {
        self.spec.output.aovs.contains(&aov)
    }

    /// Returns the light layers of the EXR, each once, in the order of [`LightSpec::NAMED`].
    pub fn lights(&self) -> Vec<LightSpec> {
        let all = LightSpec::NAMED.iter().map(|(_, light)| *light);
        all.filter(|light| self.spec.output.lights.contains(light))
            .collect()
    }

    /// Returns a look that renders only depth and normals of the water's surface by `method`, at
    /// pixel centres and at the instant of the frame. Every particle belongs to the surface.
    #[must_use]
    pub fn of_surface(&self, method: MethodSpec) -> Self {
        self.changed(|spec| {
            spec.renderer.method = method;
            spec.water.spray = None;
            spec.water.caustics = None;
            spec.whitewater = None;
            spec.camera.lens = None;
            (spec.image.samples, spec.image.shutter) = (1, 0.0);
            plain(spec);
            spec.output.formats = vec![FormatSpec::Exr];
            spec.output.aovs = vec![AovSpec::Z, AovSpec::N];
        })
    }

    /// Returns a look that renders only the water by `method`: spray is kept, whitewater and
    /// additional outputs are dropped, and caustics are kept only with ray casting.
    #[must_use]
    pub fn of_water(&self, method: MethodSpec) -> Self {
        self.changed(|spec| {
            spec.renderer.method = method;
            if method == MethodSpec::Ssfr {
                spec.water.caustics = None;
            }
            spec.whitewater = None;
            spec.output.aovs = Vec::new();
            plain(spec);
        })
    }

    /// Returns the look drawn by rays with `samples` times the samples per pixel and voxels
    /// `voxels` times as fine, clamped to the ranges of the keys.
    #[must_use]
    pub fn finer(&self, samples: u32, voxels: f64) -> Self {
        self.changed(|spec| {
            spec.renderer.method = MethodSpec::Ray;
            spec.image.samples = (samples * spec.image.samples).min(MOST_SAMPLES);
            let finer = voxels * spec.surface.voxels_per_spacing;
            spec.surface.voxels_per_spacing = finer.min(MOST_VOXELS);
        })
    }

    /// Returns the look with a static camera at `position`, metres, that looks at `target`.
    #[must_use]
    pub fn standing(&self, position: DVec3, target: DVec3, focal_length_mm: f64) -> Self {
        let mut look = self.changed(|spec| {
            (spec.camera.file, spec.camera.name, spec.camera.start) = (None, None, None);
            spec.camera.position = Some(position.to_array());
            spec.camera.target = Some(target.to_array());
            spec.camera.focal_length_mm = focal_length_mm;
            spec.camera.keyframes = Vec::new();
        });
        look.camera = None;
        look.hash = look.canonical_hash();
        look
    }

    fn changed(&self, change: impl FnOnce(&mut LookSpec)) -> Self {
        let mut look = self.clone();
        change(&mut look.spec);
        look.hash = look.canonical_hash();
        look
    }

    fn canonical_hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        hasher.update(canonical(&self.spec).as_bytes());
        if let Some(bytes) = self.panorama() {
            hasher.update(blake3::hash(bytes).as_bytes());
        }
        if let Some(camera) = self.camera_file() {
            hasher.update(b"camera").update(camera.hash().as_bytes());
        }
        if let Some(materials) = self.materials() {
            materials.hash(&mut hasher);
        }
        hasher.finalize().to_hex().to_string()
    }

    /// Returns the unit direction from the ground to the sun.
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

/// Disables overscan, crop, light layers and mattes.
fn plain(spec: &mut LookSpec) {
    (spec.image.overscan, spec.image.crop) = (0, None);
    spec.output.lights = Vec::new();
    spec.output.cryptomatte = false;
}

/// Text of newer keys at their defaults, which the hash leaves out. A look that does not use such a
/// key keeps the hash that it had before the key existed.
const NEWER: [&str; 22] = [
    "whitewater: None, ",
    "renderer: RendererSpec { method: Ssfr }, ",
    "overscan: 0, ",
    "crop: None, ",
    "aov_filter: Centre, ",
    ", haze: false",
    "colour_space: Rec709, ",
    "solids: Draw, ",
    "lights: [], ",
    "cryptomatte: false, ",
    "voxels_per_spacing: 2.0, ",
    "splat: Ellipsoid, ",
    "start: None, ",
    "fit: None, ",
    "lens: None, file: None, name: None, ",
    ", focus_distance_m: None",
    ", shutter_curve: Box, shutter_ramps: None",
    "wave_makers: None, sea: None, ",
    ", materials: None, material: []",
    ", caustics: None",
    ", laid: None",
    // Quay walls were always at these sides before the key existed.
    ", sides: [Wall { axis: 2, is_max: false }, Wall { axis: 2, is_max: true }], colour: None",
];

/// Returns the content of a look as text, without file names.
fn canonical(spec: &LookSpec) -> String {
    // `Debug` prints the shortest exact text of a float, so equal values, and only those, have
    // equal text.
    let mut canonical = spec.clone();
    if let SkySpec::Panorama { file, .. } = &mut canonical.sky {
        *file = Path::new("").to_owned();
    }
    let own = canonical.solids.material.iter_mut();
    let own = own.filter_map(|it| it.texture.as_mut());
    let basin = canonical.basin.iter_mut();
    let laid = basin.filter_map(|it| it.laid.as_mut());
    let textures = own.chain(&mut canonical.solids.laid).chain(laid);
    let textures = textures.map(|texture| &mut texture.file);
    let files = canonical
        .camera
        .file
        .iter_mut()
        .chain(&mut canonical.solids.materials);
    for file in files.chain(textures) {
        *file = Path::new("").to_owned();
    }
    let text = format!("{canonical:?}");
    NEWER
        .iter()
        .fold(text, |text, newer| text.replace(newer, ""))
}

/// Returns the values of a table in which every key has a default.
///
/// # Panics
/// If a key has no default; a test checks the tables used here.
fn default_of<T: DeserializeOwned>(keys: &'static [Key]) -> T {
    let settled = Document::parse("", Path::new(""), &[], keys).and_then(|(doc, mut root)| {
        doc.settle(&mut root)?;
        T::deserialize(toml::Deserializer::from(root)).map_err(|error| doc.translate(&error))
    });
    settled.expect("every key of the table has a default")
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
    let camera =
        CameraFile::read(&bytes, spec.camera.name.as_deref(), &read).map_err(
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
