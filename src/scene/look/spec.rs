//! Serde types of the look file, without logic. Ranges are checked and defaults filled in before
//! deserialization.

mod streams;

use std::path::PathBuf;

use serde::Deserialize;

use crate::Wall;

pub use streams::{WetLook, WhitewaterLook};

/// A look file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LookSpec {
    /// Pose and optics of the camera.
    pub camera: CameraSpec,
    /// Resolution, sampling and shutter.
    pub image: ImageSpec,
    /// Rendering method of the water.
    pub renderer: RendererSpec,
    /// Surface reconstruction from particles.
    pub surface: SurfaceSpec,
    /// Optical properties of the water.
    pub water: WaterSpec,
    /// Stream of spray, foam and bubbles; none unless named.
    pub whitewater: Option<WhitewaterLook>,
    /// Stream of the wetness of solids; none unless named.
    pub wet: Option<WetLook>,
    /// The sun.
    pub sun: SunSpec,
    /// Sky that lights the scene and is reflected by the water.
    pub sky: SkySpec,
    /// Plane at the domain's floor that extends to the horizon.
    pub ground: GroundSpec,
    /// Quay walls just outside the domain; none unless named.
    pub basin: Option<BasinSpec>,
    /// Plates for the scene's wave makers; not drawn unless named.
    pub wave_makers: Option<WaveMakersSpec>,
    /// Water beyond the domain; none unless named.
    pub sea: Option<SeaSpec>,
    /// Appearance of the scene's solids.
    pub solids: SolidsSpec,
    /// Conversion from scene-linear light to the PNG.
    pub view: ViewSpec,
    /// Files and channels to write.
    pub output: OutputSpec,
}

/// A static or keyframed camera, or one from a file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// mm; 0 for a camera from a file, which has its own.
    #[serde(default)]
    pub focal_length_mm: f64,
    /// Width and height of the film back, mm.
    pub film_back_mm: [f64; 2],
    /// Fit of the image to the film if their aspect ratios differ. If left out, the image takes the
    /// full width of the film, and a camera file must have the image's aspect ratio.
    pub fit: Option<FitSpec>,
    /// World position, metres; given with `target` in place of keyframes.
    pub position: Option<[f64; 3]>,
    /// World position that the camera looks at, metres.
    pub target: Option<[f64; 3]>,
    /// Up direction of the picture; unused with a camera from a file.
    #[serde(default)]
    pub up: [f64; 3],
    /// Thin lens; a pinhole unless named.
    pub lens: Option<LensSpec>,
    /// Camera file (glTF or USD as text), relative to the look file.
    pub file: Option<PathBuf>,
    /// Name of the camera in the file.
    pub name: Option<String>,
    /// Frame of the file at frame 1 of the shot; if left out, frame 0 is at the file's time 0.
    pub start: Option<f64>,
    /// Poses in ascending order of frames.
    #[serde(default, rename = "keyframe")]
    pub keyframes: Vec<KeyframeSpec>,
}

/// Fit of an image to a film of another aspect ratio.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum FitSpec {
    /// Full width of the film: Maya's Horizontal, USD's `adjustApertureHeight`.
    Width,
    /// Full height of the film: Maya's Vertical, USD's `adjustApertureWidth`.
    Height,
    /// Largest image within the film: Maya's Fill, USD's `cropAperture`.
    Fill,
    /// Smallest image that covers the film: Maya's Overscan, USD's `expandAperture`.
    Overscan,
}

impl FitSpec {
    /// All fits with the names used in looks.
    pub const NAMED: [(&'static str, Self); 4] = [
        ("width", Self::Width),
        ("height", Self::Height),
        ("fill", Self::Fill),
        ("overscan", Self::Overscan),
    ];
}

/// A thin lens.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensSpec {
    /// Focal length over the diameter of the aperture.
    pub f_stop: f64,
    /// Distance to the plane in focus along the optical axis, metres.
    pub focus_distance_m: f64,
}

/// Camera pose at one frame.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeyframeSpec {
    /// Frame number, possibly fractional; frame 1 is the first.
    pub frame: f64,
    /// World position, metres.
    pub position: [f64; 3],
    /// World position that the camera looks at, metres.
    pub target: [f64; 3],
    /// mm; that of the camera if left out.
    pub focal_length_mm: Option<f64>,
    /// Metres; that of the lens if left out.
    pub focus_distance_m: Option<f64>,
}

/// Resolution, sampling and shutter of the picture.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageSpec {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Additional pixels on each side of the image.
    pub overscan: u32,
    /// Left, upper, right and lower bounds of the rendered pixels; the whole image if left out.
    pub crop: Option<[f64; 4]>,
    /// Samples per pixel, spread over the pixel and the shutter.
    pub samples: u32,
    /// Fraction of a frame with the shutter open, centred on the frame; 0 disables motion blur.
    pub shutter: f64,
    /// Opening of the shutter over that time.
    pub shutter_curve: CurveSpec,
    /// Fractions of that time in which a trapezoidal shutter opens and closes.
    pub shutter_ramps: Option<[f64; 2]>,
}

/// Opening of a shutter over its open time.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum CurveSpec {
    /// Fully open throughout.
    Box,
    /// Opens linearly until the middle, then closes linearly.
    Triangle,
    /// Opens linearly, stays open, then closes linearly.
    Trapezoid,
}

/// Rendering of the water.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RendererSpec {
    /// Rendering method.
    pub method: MethodSpec,
}

/// Rendering methods for water.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum MethodSpec {
    /// Screen-space fluid rendering: smoothed splats. Fast.
    Ssfr,
    /// Ray casting through a level set of the particles. For final frames.
    Ray,
}

/// Smoothing filter for splat depths.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum FilterSpec {
    /// Curvature flow (van der Laan et al. 2009) with the world-space width of Bagar et al. (2010).
    CurvatureFlow,
    /// Narrow-range filter (Truong and Yuksel 2018).
    NarrowRange,
}

/// Shape of a splat.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum SplatSpec {
    /// Ellipsoid fitted to neighbours (Yu and Turk 2013); a lone particle is a ball
    /// of its own volume.
    Ellipsoid,
    /// Ball of the splat radius.
    Sphere,
}

/// Surface reconstruction.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurfaceSpec {
    /// Smoothing filter of the splats.
    pub filter: FilterSpec,
    /// Shape of a splat.
    pub splat: SplatSpec,
    /// Splat radius, metres; 0.87 particle spacings if left out.
    pub radius_m: Option<f64>,
    /// Standard deviation of the smoothing, world metres; default 0.5 particle spacings,
    /// 1.6 for spheres.
    pub smoothing_width_m: Option<f64>,
    /// Voxels per particle spacing in the level set for ray casting.
    pub voxels_per_spacing: f64,
    /// RMS slope of waves too small to be drawn, which widens the glitter.
    pub roughness: f64,
    /// Fine waves added to the normals; none unless named.
    pub ripple: Option<RippleSpec>,
}

/// Procedural ripples.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RippleSpec {
    /// Longest wavelength, metres.
    pub wavelength_m: f64,
    /// RMS slope.
    pub slope: f64,
}

/// Optical properties of the water.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaterSpec {
    /// Refractive index.
    pub index: f64,
    /// Absorption coefficient, linear red, green, blue, 1/m.
    pub absorption_per_metre: [f64; 3],
    /// Scattering coefficient, red, green, blue, 1/m. It makes deep water turquoise
    /// instead of black.
    pub scattering_per_metre: [f64; 3],
    /// White water where particles are detached or fast; none unless named.
    pub spray: Option<SpraySpec>,
    /// Sunlight refracted by the waves onto what is below; undeflected unless named.
    pub caustics: Option<CausticsSpec>,
}

/// Map of the sunlight that passes through the water.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CausticsSpec {
    /// Texels along the longer side of the covered ground.
    pub resolution: u32,
    /// Standard deviation of the normals' smoothing, metres; 1.5 particle spacings if left out.
    pub smoothing_width_m: Option<f64>,
}

/// Whitening of detached and fast water.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpraySpec {
    /// Extinction of fully aerated water, 1/m.
    pub density_per_metre: f64,
    /// Speed above which the surface starts to whiten, m/s.
    pub speed_m_per_s: f64,
}

/// The sun.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SunSpec {
    /// Azimuth: 0 along +x, 90 along +z.
    pub azimuth_degrees: f64,
    /// Elevation above the horizon.
    pub elevation_degrees: f64,
    /// Factor on the sunlight that a clear sky of this turbidity transmits; 0 disables the sun.
    pub intensity: f64,
}

/// Sky model.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "model", rename_all = "snake_case", deny_unknown_fields)]
pub enum SkySpec {
    /// Analytic sky of Hosek and Wilkie (2012).
    HosekWilkie {
        /// Turbidity, from 1 (clear) to 10 (hazy).
        turbidity: f64,
        /// Reflectance of the surrounding land, linear red, green, blue.
        albedo: [f64; 3],
        /// Whether haze near the ground follows the turbidity instead of the ground's `haze_m`.
        haze: bool,
    },
    /// A latitude-longitude panorama, scene-linear.
    Panorama {
        /// EXR file, relative to the look file.
        file: PathBuf,
        /// Rotation about the vertical axis.
        rotate_degrees: f64,
        /// Factor on the radiance.
        intensity: f64,
    },
}

/// The ground plane.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroundSpec {
    /// Reflectance, linear red, green, blue.
    pub colour: [f64; 3],
    /// Unevenness of the reflectance, 0 to 1.
    pub variation: f64,
    /// Distance at which haze removes 63 % of the contrast, metres; unused with the sky's own haze.
    pub haze_m: f64,
}

/// Quay walls along the sides of the domain.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BasinSpec {
    /// Height above the domain's floor, metres.
    pub height_m: f64,
    /// Thickness, metres.
    pub thickness_m: f64,
    /// Sides of the domain with a wall.
    pub sides: Vec<Wall>,
    /// Linear red, green, blue reflectance; default 1.1 times the ground's, white under a texture.
    pub colour: Option<[f64; 3]>,
    /// Texture projected along the axes.
    #[serde(rename = "texture")]
    pub laid: Option<TextureSpec>,
}

/// Plates for the scene's wave makers.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaveMakersSpec {
    /// Height above the domain's floor, metres.
    pub height_m: f64,
    /// Thickness, metres.
    pub thickness_m: f64,
    /// Reflectance, linear red, green, blue.
    pub colour: [f64; 3],
}

/// Water beyond the domain's sides.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SeaSpec {
    /// Still-water level above the domain's floor, metres.
    pub level_m: f64,
    /// Width of the band that blends the simulated water into the sea, metres.
    pub band_m: f64,
    /// Sides of the domain beyond which the sea extends.
    pub sides: Vec<Wall>,
    /// Waves of the sea; those of the scene if left out.
    pub waves: Option<SeaWavesSpec>,
}

/// Waves of a sea spectrum.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SeaWavesSpec {
    /// Significant wave height: four standard deviations of the elevation, metres.
    pub significant_height_m: f64,
    /// Peak period, seconds.
    pub peak_period_s: f64,
    /// Shortest period, seconds; 0.35 of the peak period if left out.
    pub shortest_period_s: Option<f64>,
    /// Main direction of propagation, from +x towards +z.
    pub direction_degrees: f64,
    /// Exponent s of the directional spreading (cos ½θ)^2s.
    pub spreading: f64,
    /// Seed of the random phases.
    pub seed: u32,
}

/// Appearance of the scene's solids.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolidsSpec {
    /// Reflectance, linear red, green, blue.
    pub colour: [f64; 3],
    /// Rows of windows on vertical faces; none unless named.
    pub windows: Option<WindowsSpec>,
    /// MTL file, relative to the look file.
    pub materials: Option<PathBuf>,
    /// Materials defined in the look.
    #[serde(default)]
    pub material: Vec<MaterialSpec>,
    /// Texture of solids without a material, projected along the axes.
    #[serde(rename = "texture")]
    pub laid: Option<TextureSpec>,
}

/// Material of a part of a solid.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialSpec {
    /// Name of the part, or of the mesh file without its extension.
    pub name: String,
    /// Linear red, green, blue reflectance; default white under a texture, else that of all solids.
    pub colour: Option<[f64; 3]>,
    /// Texture; none unless named.
    pub texture: Option<TextureSpec>,
    /// Whether the windows of `[solids]` may appear on it.
    pub windows: bool,
}

/// Texture on a solid.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TextureSpec {
    /// PNG, relative to the look file.
    pub file: PathBuf,
    /// Side length covered by the picture, metres; by the mesh's texture coordinates if left out.
    pub metres: Option<f64>,
}

/// Windows on vertical faces.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WindowsSpec {
    /// Height of a storey, metres.
    pub storey_m: f64,
    /// Distance between windows, metres.
    pub bay_m: f64,
    /// Fraction of the windows lit from within.
    pub lit: f64,
}

/// Conversion from scene-linear light to the PNG.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ViewSpec {
    /// Exposure in stops: scales the light by 2^stops.
    pub exposure_stops: f64,
    /// Tone curve of the PNG.
    pub transform: TransformSpec,
    /// Factor on the distance from grey, after the tone curve.
    pub saturation: f64,
    /// Exponent about middle grey, after the tone curve.
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
    /// Sobotka's AgX: a filmic log curve that desaturates bright colours towards white.
    Agx,
    /// ACES 1.0: reference rendering and output transform for 100-nit sRGB displays, dim surround.
    Aces,
    /// None: clips at 1 and encodes as sRGB.
    Srgb,
}

/// File formats.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum FormatSpec {
    /// 8 bits per channel, through the view transform.
    Png,
    /// Scene-linear OpenEXR, with AOVs.
    Exr,
}

/// Additional channels of the EXR.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
pub enum AovSpec {
    /// Depth along the optical axis, metres.
    Z,
    /// World-space normal of the first surface.
    N,
    /// World position of the first surface, metres.
    P,
    /// Screen-space motion to the next frame, pixels: u to the right, v upward.
    #[serde(rename = "forward")]
    Forward,
    /// Length of the line of sight within water, metres.
    #[serde(rename = "thickness")]
    Thickness,
}

/// Primaries and white point of the linear light.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum ColourSpaceSpec {
    /// ITU-R BT.709 primaries, D65 white.
    #[default]
    Rec709,
    /// AP1 primaries, ACES white.
    AcesCg,
}

/// Output of opaque objects seen directly.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum SolidsOutput {
    /// They are drawn.
    Draw,
    /// They are black and transparent, and occlude what is behind them.
    Holdout,
}

/// Components of a picture's light. They are disjoint and add up to the picture; spray dims each of
/// them where it covers the pixel.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum LightSpec {
    /// Reflection at the first water surface.
    Reflection,
    /// Refraction through that surface, without the light scattered in water.
    Refraction,
    /// Light scattered in water.
    Scattering,
    /// Glitter of the sun on that surface, and the sun's disc.
    Sun,
    /// The sky, and in-scattered light of the air.
    Sky,
    /// White water in the air.
    Spray,
    /// Opaque objects seen directly.
    Solids,
    /// Sunlight through water onto opaque objects, with caustics enabled.
    Caustics,
    /// Foam and bubbles of a whitewater stream.
    Foam,
}

impl LightSpec {
    /// All components in the order of the shaders' `light_parts`, with the names of their layers.
    pub const NAMED: [(&'static str, Self); 9] = [
        ("reflection", Self::Reflection),
        ("refraction", Self::Refraction),
        ("scattering", Self::Scattering),
        ("sun", Self::Sun),
        ("sky", Self::Sky),
        ("spray", Self::Spray),
        ("solids", Self::Solids),
        ("caustics", Self::Caustics),
        ("foam", Self::Foam),
    ];
}

/// Filter of the AOVs within a pixel.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum AovFilterSpec {
    /// Value at the pixel's centre, at the instant of the frame, through a pinhole.
    Centre,
    /// Mean over the samples of the picture: pixel, shutter and lens.
    Beauty,
}

/// Files and channels to write.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputSpec {
    /// File formats, at least one.
    pub formats: Vec<FormatSpec>,
    /// AOVs of the EXR.
    pub aovs: Vec<AovSpec>,
    /// Filter of the AOVs.
    pub aov_filter: AovFilterSpec,
    /// Colour space of the EXR.
    pub colour_space: ColourSpaceSpec,
    /// Output of ground, solids and walls.
    pub solids: SolidsOutput,
    /// Light layers of the EXR.
    pub lights: Vec<LightSpec>,
    /// Whether the EXR includes object mattes (Cryptomatte).
    pub cryptomatte: bool,
    /// Whether the sky is drawn; otherwise it is transparent.
    pub background: bool,
}
