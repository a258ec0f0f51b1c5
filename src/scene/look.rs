//! Looks: camera, light, water and output of a shot, apart from its physics.

pub mod spec;

mod fault;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::{Reach, words::shown};

pub use fault::LookError;
pub use spec::{
    AovSpec, BasinSpec, CameraSpec, FilterSpec, FormatSpec, ImageSpec, KeyframeSpec, LookSpec,
    OutputSpec, RippleSpec, SkySpec, SpraySpec, SunSpec, SurfaceSpec, TransformSpec, ViewSpec,
    WaterSpec, WindowsSpec,
};

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
    look: PathBuf,
    line: usize,
}

impl Look {
    /// Reads, parses and validates a look file.
    ///
    /// # Errors
    /// [`LookError::Read`] for the file, [`LookError::Fault`] with line and key.
    pub fn load(path: &Path) -> Result<Self, LookError> {
        Self::load_within(path, Reach::Folder)
    }

    /// [`Look::load`] with a panorama from as far as `reach` says.
    ///
    /// # Errors
    /// As [`Look::load`].
    pub fn load_within(path: &Path, reach: Reach) -> Result<Self, LookError> {
        let text = std::fs::read_to_string(path).map_err(|source| LookError::Read {
            file: path.to_owned(),
            source,
        })?;
        Self::parse_within(&text, path, reach)
    }

    /// Parses and validates the text of a look; `file` names it in errors, and its folder is where a
    /// relative panorama is looked for, which it must not leave.
    ///
    /// # Errors
    /// As [`Look::load`].
    pub fn parse(text: &str, file: &Path) -> Result<Self, LookError> {
        Self::parse_within(text, file, Reach::Folder)
    }

    fn parse_within(text: &str, file: &Path, reach: Reach) -> Result<Self, LookError> {
        let spec: LookSpec =
            toml::from_str(text).map_err(|error| fault::from_toml(file, text, &error))?;
        validate(&spec).map_err(|(path, message)| fault::at_path(file, text, &path, &message))?;
        let panorama = match &spec.sky {
            SkySpec::Panorama { file: name, .. } => {
                let folder = file.parent().unwrap_or(Path::new("."));
                let refuse = |message: String| fault::at_path(file, text, PANORAMA, &message);
                let path = reach.find(folder, name).map_err(refuse)?;
                let bytes = std::fs::read(&path)
                    .map_err(|error| refuse(format!("cannot read {}: {error}", path.display())))?;
                Some(Panorama {
                    bytes: Arc::from(bytes),
                    path,
                    look: file.to_owned(),
                    line: fault::line_of(text, PANORAMA),
                })
            }
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
        Some(LookError::Fault {
            file: sky.look.clone(),
            line: sky.line,
            key: PANORAMA.to_owned(),
            message: format!("the panorama {}: {problem}", sky.path.display()),
        })
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
    hasher.update(format!("{canonical:?}").as_bytes());
    if let Some(bytes) = panorama {
        hasher.update(blake3::hash(bytes).as_bytes());
    }
    hasher.finalize().to_hex().to_string()
}

type Refusal = (String, String);

fn in_range(path: &str, value: f64, least: f64, most: f64, unit: &str) -> Result<(), Refusal> {
    if value.is_finite() && (least..=most).contains(&value) {
        return Ok(());
    }
    Err((
        path.to_owned(),
        format!(
            "is {}; allowed is {} to {}{unit}",
            shown(value),
            shown(least),
            shown(most)
        ),
    ))
}

fn all_in_range(
    path: &str,
    values: &[f64],
    least: f64,
    most: f64,
    unit: &str,
) -> Result<(), Refusal> {
    values
        .iter()
        .try_for_each(|&value| in_range(path, value, least, most, unit))
}

fn refuse(path: &str, message: &str) -> Result<(), Refusal> {
    Err((path.to_owned(), message.to_owned()))
}

/// Farther than this from the origin, f32 positions are coarser than a millimetre.
const REACH: f64 = 1e5;

fn validate(spec: &LookSpec) -> Result<(), Refusal> {
    let image = &spec.image;
    in_range("image.width", image.width.into(), 1.0, 32768.0, " pixels")?;
    in_range("image.height", image.height.into(), 1.0, 32768.0, " pixels")?;
    in_range("image.samples", image.samples.into(), 1.0, 1024.0, "")?;
    in_range("image.shutter", image.shutter, 0.0, 1.0, " of a frame")?;
    validate_camera(&spec.camera, image)?;
    let surface = &spec.surface;
    if let Some(radius) = surface.radius_m {
        in_range("surface.radius_m", radius, 1e-4, 100.0, " m")?;
    }
    if let Some(width) = surface.smoothing_width_m {
        in_range("surface.smoothing_width_m", width, 0.0, 100.0, " m")?;
    }
    in_range("surface.roughness", surface.roughness, 1e-3, 1.0, "")?;
    if let Some(ripple) = &surface.ripple {
        in_range(
            "surface.ripple.wavelength_m",
            ripple.wavelength_m,
            1e-3,
            1000.0,
            " m",
        )?;
        in_range("surface.ripple.slope", ripple.slope, 0.0, 1.0, "")?;
    }
    validate_water(&spec.water)?;
    in_range(
        "sun.azimuth_degrees",
        spec.sun.azimuth_degrees,
        -360.0,
        360.0,
        "°",
    )?;
    in_range(
        "sun.elevation_degrees",
        spec.sun.elevation_degrees,
        0.5,
        90.0,
        "°",
    )?;
    in_range("sun.intensity", spec.sun.intensity, 0.0, 1000.0, "")?;
    validate_surroundings(spec)?;
    let view = &spec.view;
    in_range(
        "view.exposure_stops",
        view.exposure_stops,
        -20.0,
        20.0,
        " stops",
    )?;
    in_range("view.saturation", view.saturation, 0.0, 3.0, "")?;
    in_range("view.contrast", view.contrast, 0.2, 3.0, "")?;
    if spec.output.formats.is_empty() {
        return refuse("output.formats", "is empty; allowed are `png`, `exr`");
    }
    if !spec.output.aovs.is_empty() && !spec.output.formats.contains(&FormatSpec::Exr) {
        return refuse(
            "output.aovs",
            "AOVs are written to EXR; add it to `formats`",
        );
    }
    Ok(())
}

fn validate_camera(camera: &CameraSpec, image: &ImageSpec) -> Result<(), Refusal> {
    in_range(
        "camera.focal_length_mm",
        camera.focal_length_mm,
        1.0,
        5000.0,
        " mm",
    )?;
    all_in_range(
        "camera.film_back_mm",
        &camera.film_back_mm,
        1.0,
        500.0,
        " mm",
    )?;
    let [width, height] = camera.film_back_mm;
    let wanted = width * f64::from(image.height) / f64::from(image.width);
    if (wanted / height - 1.0).abs() > 0.005 {
        return Err((
            "camera.film_back_mm".to_owned(),
            format!(
                "is not the shape of a {} × {} image; allowed is [{width}, {wanted:.4}]",
                image.width, image.height
            ),
        ));
    }
    all_in_range("camera.up", &camera.up, -1.0, 1.0, "")?;
    if camera.keyframes.is_empty() {
        let (Some(position), Some(target)) = (camera.position, camera.target) else {
            return refuse(
                "camera.position",
                "a camera needs `position` and `target`, or `[[camera.keyframe]]`",
            );
        };
        return validate_pose("camera", camera, position, target);
    }
    if camera.position.is_some() || camera.target.is_some() {
        return refuse(
            "camera.position",
            "stands beside keyframes; a camera has one or the other",
        );
    }
    for (index, key) in camera.keyframes.iter().enumerate() {
        let path = format!("camera.keyframe.{index}");
        in_range(&format!("{path}.frame"), key.frame, -1e6, 1e6, "")?;
        if index > 0 && key.frame <= camera.keyframes[index - 1].frame {
            return refuse(&format!("{path}.frame"), "keyframes must ascend");
        }
        if let Some(focal) = key.focal_length_mm {
            in_range(
                &format!("{path}.focal_length_mm"),
                focal,
                1.0,
                5000.0,
                " mm",
            )?;
        }
        validate_pose(&path, camera, key.position, key.target)?;
    }
    Ok(())
}

fn validate_pose(
    path: &str,
    camera: &CameraSpec,
    position: [f64; 3],
    target: [f64; 3],
) -> Result<(), Refusal> {
    all_in_range(&format!("{path}.position"), &position, -REACH, REACH, " m")?;
    all_in_range(&format!("{path}.target"), &target, -REACH, REACH, " m")?;
    let forward = DVec3::from(target) - DVec3::from(position);
    if forward.length() < 1e-6 {
        return refuse(&format!("{path}.target"), "is where the camera stands");
    }
    if forward
        .normalize()
        .cross(DVec3::from(camera.up).normalize_or_zero())
        .length()
        < 1e-6
    {
        return refuse("camera.up", "is zero or along the line of sight");
    }
    Ok(())
}

fn validate_water(water: &WaterSpec) -> Result<(), Refusal> {
    in_range("water.index", water.index, 1.0, 3.0, "")?;
    all_in_range(
        "water.absorption_per_metre",
        &water.absorption_per_metre,
        0.0,
        1e4,
        " 1/m",
    )?;
    all_in_range(
        "water.scattering_per_metre",
        &water.scattering_per_metre,
        0.0,
        1e4,
        " 1/m",
    )?;
    if let Some(spray) = &water.spray {
        in_range(
            "water.spray.density_per_metre",
            spray.density_per_metre,
            0.0,
            1e4,
            " 1/m",
        )?;
        in_range(
            "water.spray.speed_m_per_s",
            spray.speed_m_per_s,
            1e-3,
            1e4,
            " m/s",
        )?;
    }
    Ok(())
}

fn validate_surroundings(spec: &LookSpec) -> Result<(), Refusal> {
    match &spec.sky {
        SkySpec::HosekWilkie { turbidity, albedo } => {
            in_range("sky.turbidity", *turbidity, 1.0, 10.0, "")?;
            all_in_range("sky.albedo", albedo, 0.0, 1.0, "")?;
        }
        SkySpec::Panorama {
            rotate_degrees,
            intensity,
            ..
        } => {
            in_range("sky.rotate_degrees", *rotate_degrees, -360.0, 360.0, "°")?;
            in_range("sky.intensity", *intensity, 0.0, 1e6, "")?;
        }
    }
    all_in_range("ground.colour", &spec.ground.colour, 0.0, 1.0, "")?;
    in_range("ground.variation", spec.ground.variation, 0.0, 1.0, "")?;
    in_range("ground.haze_m", spec.ground.haze_m, 1.0, 1e7, " m")?;
    if let Some(basin) = &spec.basin {
        in_range("basin.height_m", basin.height_m, 1e-3, 1e3, " m")?;
        in_range("basin.thickness_m", basin.thickness_m, 1e-3, 1e3, " m")?;
    }
    all_in_range("solids.colour", &spec.solids.colour, 0.0, 1.0, "")?;
    if let Some(windows) = &spec.solids.windows {
        in_range("solids.windows.storey_m", windows.storey_m, 1e-3, 1e3, " m")?;
        in_range("solids.windows.bay_m", windows.bay_m, 1e-3, 1e3, " m")?;
        in_range("solids.windows.lit", windows.lit, 0.0, 1.0, "")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
