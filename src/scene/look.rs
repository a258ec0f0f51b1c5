//! Looks: camera, light, water and output of a shot, separate from its physics.

pub mod camera_file;
pub mod spec;

mod film;
mod lens;
mod lint;
mod materials;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::{Fault, SceneError};

use camera_file::CameraFile;
pub use film::Framing;
pub use materials::{Material, Materials, Picture, Texture};
pub use spec::{
    AovFilterSpec, AovSpec, BasinSpec, CameraSpec, CausticsSpec, ColourSpaceSpec, CurveSpec,
    FilterSpec, FitSpec, FormatSpec, ImageSpec, KeyframeSpec, LensSpec, LightSpec, LookSpec,
    MaterialSpec, MethodSpec, OutputSpec, RendererSpec, RippleSpec, SeaSpec, SeaWavesSpec, SkySpec,
    SolidsOutput, SplatSpec, SpraySpec, SunSpec, SurfaceSpec, TextureSpec, TransformSpec, ViewSpec,
    WaterSpec, WaveMakersSpec, WetLook, WhitewaterLook, WindowsSpec,
};

/// Largest number of samples per pixel.
pub const MOST_SAMPLES: u32 = 1024;

/// Largest number of voxels per particle spacing.
pub const MOST_VOXELS: f64 = 8.0;

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
pub struct LookError(#[from] pub SceneError);

impl LookError {
    /// Whether a path leads farther than the look may reach.
    pub fn leads_out(&self) -> bool {
        self.0.leads_out()
    }
}

/// A validated look: every value is in range and every referenced file is read.
#[derive(Clone, Debug)]
pub struct Look {
    spec: LookSpec,
    panorama: Option<Panorama>,
    camera: Option<CameraFile>,
    materials: Option<Arc<Materials>>,
    /// Location of `renderer.method` in the look file.
    method: Fault,
    hash: String,
}

/// Parts of a look, each validated.
#[derive(Clone, Debug)]
pub struct LookParts {
    /// Values of the file with defaults filled in.
    pub spec: LookSpec,
    /// Panorama of the sky, if the look has one.
    pub panorama: Option<Panorama>,
    /// Camera read from `camera.file`, if the look names one.
    pub camera: Option<CameraFile>,
    /// Materials of solids, if the look names any.
    pub materials: Option<Materials>,
    /// Location of `renderer.method` in the look file.
    pub method: Fault,
}

/// Panorama of a sky.
#[derive(Clone, Debug)]
pub struct Panorama {
    /// Bytes of an EXR file.
    pub bytes: Arc<[u8]>,
    /// File that they were read from.
    pub path: PathBuf,
    /// Location of its key in the look file.
    pub place: Fault,
}

impl Look {
    /// Creates a look from parts that have been validated, as the parser of look files does.
    pub fn new(parts: LookParts) -> Self {
        let LookParts {
            spec,
            panorama,
            camera,
            materials,
            method,
        } = parts;
        let mut look = Self {
            spec,
            panorama,
            camera,
            materials: materials.map(Arc::new),
            method,
            hash: String::new(),
        };
        look.hash = look.canonical_hash();
        look
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
        self.camera.as_ref()
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
            (spec.whitewater, spec.wet) = (None, None);
            spec.camera.lens = None;
            (spec.image.samples, spec.image.shutter) = (1, 0.0);
            plain(spec);
            spec.output.formats = vec![FormatSpec::Exr];
            spec.output.aovs = vec![AovSpec::Z, AovSpec::N];
        })
    }

    /// Returns [`Self::of_surface`] by rays that each have a time of their own while the shutter is
    /// open, `shutter` of a frame.
    #[must_use]
    pub fn of_open_surface(&self, shutter: f64) -> Self {
        self.of_surface(MethodSpec::Ray).changed(|spec| {
            spec.image.shutter = shutter;
            spec.output.aov_filter = AovFilterSpec::Beauty;
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
            (spec.whitewater, spec.wet) = (None, None);
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

    /// Returns the look of the picture alone, without additional outputs, at a `smaller`th of its
    /// width and height and with at most `samples` samples a pixel.
    #[must_use]
    pub fn of_picture(&self, smaller: u32, samples: Option<u32>) -> Self {
        self.changed(|spec| {
            let image = &mut spec.image;
            image.samples = image.samples.min(samples.unwrap_or(u32::MAX));
            image.width = (image.width / smaller).max(1);
            image.height = (image.height / smaller).max(1);
            image.overscan /= smaller;
            let most = [image.width, image.height].map(f64::from);
            if let Some(crop) = &mut image.crop {
                for axis in 0..2 {
                    let [low, high] = [axis, axis + 2].map(|at| crop[at] / f64::from(smaller));
                    crop[axis] = low.floor().min(most[axis] - 1.0);
                    crop[axis + 2] = high.ceil().min(most[axis]);
                }
            }
            spec.output.lights = Vec::new();
            spec.output.aovs = Vec::new();
            spec.output.cryptomatte = false;
            spec.output.formats = vec![FormatSpec::Png];
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
const NEWER: [&str; 23] = [
    "whitewater: None, ",
    "wet: None, ",
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
pub fn canonical(spec: &LookSpec) -> String {
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
