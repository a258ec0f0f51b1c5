//! The look file as written: serde types, every default beside its field, no logic.

use std::path::PathBuf;

use serde::Deserialize;

/// A look file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LookSpec {
    /// Where the picture is taken from.
    pub camera: CameraSpec,
    /// Size and sampling.
    #[serde(default)]
    pub image: ImageSpec,
    /// How splats become a surface.
    #[serde(default)]
    pub surface: SurfaceSpec,
    /// What the water is like inside.
    #[serde(default)]
    pub water: WaterSpec,
    /// The sun.
    #[serde(default)]
    pub sun: SunSpec,
    /// What the water mirrors.
    pub sky: SkySpec,
    /// The plane at the domain's floor, which runs to the horizon.
    #[serde(default)]
    pub ground: GroundSpec,
    /// Quay walls just outside the domain's sides; none unless named.
    pub basin: Option<BasinSpec>,
    /// The scene's solids.
    #[serde(default)]
    pub solids: SolidsSpec,
    /// From scene-linear light to a picture.
    #[serde(default)]
    pub view: ViewSpec,
    /// What is written.
    #[serde(default)]
    pub output: OutputSpec,
}

/// A pinhole camera in millimetres, still or keyframed.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// mm.
    pub focal_length_mm: f64,
    /// Width and height of the exposed film, mm; its shape must be the image's.
    #[serde(default = "film_back")]
    pub film_back_mm: [f64; 2],
    /// World metres; with `target`, instead of keyframes.
    pub position: Option<[f64; 3]>,
    /// World metres.
    pub target: Option<[f64; 3]>,
    /// Direction that stands upright in the picture.
    #[serde(default = "up")]
    pub up: [f64; 3],
    /// Poses at frames, in ascending order.
    #[serde(default, rename = "keyframe")]
    pub keyframes: Vec<KeyframeSpec>,
}

/// The camera at one frame.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeyframeSpec {
    /// Frame number; frame 1 is the first.
    pub frame: f64,
    /// World metres.
    pub position: [f64; 3],
    /// World metres.
    pub target: [f64; 3],
    /// mm; the camera's own where left out.
    pub focal_length_mm: Option<f64>,
}

fn film_back() -> [f64; 2] {
    [36.0, 20.25]
}

fn up() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

/// Size and sampling of the picture.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ImageSpec {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Samples a pixel, spread over the pixel and over the shutter.
    pub samples: u32,
    /// Fraction of a frame for which the shutter is open, centred on the frame; 0 = no motion blur.
    pub shutter: f64,
}

impl Default for ImageSpec {
    fn default() -> Self {
        Self {
            width: 640,
            height: 360,
            samples: 3,
            shutter: 0.0,
        }
    }
}

/// The filter that turns splats into a surface.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum FilterSpec {
    /// van der Laan 2009 with the world-space width of Bagar 2010.
    CurvatureFlow,
    /// Truong and Yuksel 2018.
    NarrowRange,
}

/// How splats become a surface.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurfaceSpec {
    /// Which filter.
    pub filter: FilterSpec,
    /// Splat radius, metres; 0.87 particle spacings where left out.
    pub radius_m: Option<f64>,
    /// Standard deviation of the smoothing, metres in the world; 1.6 particle spacings where left out.
    pub smoothing_width_m: Option<f64>,
    /// Root mean square slope of the waves too small to be drawn, which widens the glitter.
    pub roughness: f64,
    /// Fine waves drawn into the normals; none unless named.
    pub ripple: Option<RippleSpec>,
}

impl Default for SurfaceSpec {
    fn default() -> Self {
        Self {
            filter: FilterSpec::CurvatureFlow,
            radius_m: None,
            smoothing_width_m: None,
            roughness: 0.08,
            ripple: None,
        }
    }
}

/// Procedural ripples.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RippleSpec {
    /// Longest wave, metres.
    pub wavelength_m: f64,
    /// Root mean square slope.
    pub slope: f64,
}

/// What the water is like inside.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WaterSpec {
    /// Refractive index.
    pub index: f64,
    /// Red, green, blue, 1/m.
    pub absorption_per_metre: [f64; 3],
    /// Red, green, blue, 1/m: what makes deep water turquoise, not black.
    pub scattering_per_metre: [f64; 3],
    /// White water where particles are thrown clear or fast; none unless named.
    pub spray: Option<SpraySpec>,
}

impl Default for WaterSpec {
    fn default() -> Self {
        Self {
            index: 1.333,
            absorption_per_metre: [0.34, 0.057, 0.0064],
            scattering_per_metre: [0.0; 3],
            spray: None,
        }
    }
}

/// Whitening of thrown and fast water.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpraySpec {
    /// Optical density of fully aerated water, 1/m.
    pub density_per_metre: f64,
    /// Speed from which the surface begins to whiten, m/s.
    pub speed_m_per_s: f64,
}

/// The sun.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SunSpec {
    /// 0 = along +x, 90 = along +z.
    pub azimuth_degrees: f64,
    /// Above the horizon.
    pub elevation_degrees: f64,
    /// Factor on the sun that a clear sky of this turbidity lets through; 0 = none.
    pub intensity: f64,
}

impl Default for SunSpec {
    fn default() -> Self {
        Self {
            azimuth_degrees: 60.0,
            elevation_degrees: 40.0,
            intensity: 1.0,
        }
    }
}

/// What the water mirrors.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "model", rename_all = "snake_case", deny_unknown_fields)]
pub enum SkySpec {
    /// Hosek and Wilkie 2012.
    HosekWilkie {
        /// 1 (clear) to 10 (hazy).
        #[serde(default = "turbidity")]
        turbidity: f64,
        /// Reflectance of the land around, red, green, blue.
        #[serde(default = "albedo")]
        albedo: [f64; 3],
    },
    /// A latitude-longitude panorama, scene-linear.
    Panorama {
        /// EXR, relative to the look file.
        file: PathBuf,
        /// Turn about the vertical.
        #[serde(default)]
        rotate_degrees: f64,
        /// Factor on its radiance.
        #[serde(default = "one")]
        intensity: f64,
    },
}

fn turbidity() -> f64 {
    3.0
}

fn albedo() -> [f64; 3] {
    [0.15, 0.15, 0.15]
}

fn one() -> f64 {
    1.0
}

/// The ground plane.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GroundSpec {
    /// Reflectance, linear red, green, blue.
    pub colour: [f64; 3],
    /// How uneven that is, 0 to 1.
    pub variation: f64,
    /// Distance after which air has taken 63 % of the contrast, metres.
    pub haze_m: f64,
}

impl Default for GroundSpec {
    fn default() -> Self {
        Self {
            colour: [0.30, 0.28, 0.25],
            variation: 0.25,
            haze_m: 500.0,
        }
    }
}

/// Quay walls along the domain's ±z sides.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BasinSpec {
    /// Above the domain's floor, metres.
    pub height_m: f64,
    /// Metres.
    #[serde(default = "thickness")]
    pub thickness_m: f64,
}

fn thickness() -> f64 {
    0.6
}

/// How the scene's solids look.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SolidsSpec {
    /// Reflectance, linear red, green, blue.
    pub colour: [f64; 3],
    /// Rows of windows on upright faces; none unless named.
    pub windows: Option<WindowsSpec>,
}

impl Default for SolidsSpec {
    fn default() -> Self {
        Self {
            colour: [0.55, 0.52, 0.48],
            windows: None,
        }
    }
}

/// Windows on upright faces.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WindowsSpec {
    /// Height of a storey, metres.
    pub storey_m: f64,
    /// Width from window to window, metres.
    pub bay_m: f64,
    /// Fraction of the windows that are lit from within.
    #[serde(default)]
    pub lit: f64,
}

/// From scene-linear light to a picture.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ViewSpec {
    /// Factor of 2 to this power on the light, in the PNG only.
    pub exposure_stops: f64,
    /// Tone curve of the PNG.
    pub transform: TransformSpec,
    /// Factor on the distance from grey after the tone curve.
    pub saturation: f64,
    /// Power about middle grey after the tone curve.
    pub contrast: f64,
}

impl Default for ViewSpec {
    fn default() -> Self {
        Self {
            exposure_stops: 0.0,
            transform: TransformSpec::Agx,
            saturation: 1.0,
            contrast: 1.0,
        }
    }
}

/// Tone curves.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum TransformSpec {
    /// Sobotka's AgX: a filmic curve in log light that lets colours run to white.
    Agx,
    /// None: clipped at 1, sRGB-encoded.
    Srgb,
}

/// File formats.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum FormatSpec {
    /// 8 bits, through the view transform.
    Png,
    /// Scene-linear, with AOVs.
    Exr,
}

/// Extra channels of the EXR.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum AovSpec {
    /// Depth along the optical axis, metres.
    Z,
    /// World normal of the first surface.
    N,
    /// World position of the first surface, metres.
    P,
    /// Screen motion to the next frame, pixels: u to the right, v upward.
    #[serde(rename = "forward")]
    Forward,
    /// Water along the line of sight, metres.
    #[serde(rename = "thickness")]
    Thickness,
}

/// What is written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OutputSpec {
    /// At least one.
    pub formats: Vec<FormatSpec>,
    /// In the EXR.
    pub aovs: Vec<AovSpec>,
    /// Whether the sky is in the picture, or left transparent.
    pub background: bool,
}

impl Default for OutputSpec {
    fn default() -> Self {
        Self {
            formats: vec![FormatSpec::Png],
            aovs: Vec::new(),
            background: true,
        }
    }
}
