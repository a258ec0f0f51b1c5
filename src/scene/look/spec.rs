//! The look file as written, its numbers in range and its defaults laid down: serde types, no logic.

use std::path::PathBuf;

use serde::Deserialize;

use crate::Wall;

/// A look file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LookSpec {
    /// Where the picture is taken from.
    pub camera: CameraSpec,
    /// Size and sampling.
    pub image: ImageSpec,
    /// How the water is drawn.
    pub renderer: RendererSpec,
    /// How splats become a surface.
    pub surface: SurfaceSpec,
    /// What the water is like inside.
    pub water: WaterSpec,
    /// A stream of spray, foam and bubbles; none is drawn unless named.
    pub whitewater: Option<WhitewaterLook>,
    /// The sun.
    pub sun: SunSpec,
    /// What the water mirrors.
    pub sky: SkySpec,
    /// The plane at the domain's floor, which runs to the horizon.
    pub ground: GroundSpec,
    /// Quay walls just outside the domain's sides; none unless named.
    pub basin: Option<BasinSpec>,
    /// The scene's wave makers; not drawn unless named.
    pub wave_makers: Option<WaveMakersSpec>,
    /// Water beyond the domain; none unless named.
    pub sea: Option<SeaSpec>,
    /// The scene's solids.
    pub solids: SolidsSpec,
    /// From scene-linear light to a picture.
    pub view: ViewSpec,
    /// What is written.
    pub output: OutputSpec,
}

/// A camera in millimetres, still, keyframed or from a file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// mm; 0 of a camera from a file, which has its own.
    #[serde(default)]
    pub focal_length_mm: f64,
    /// Width and height of the exposed film, mm.
    pub film_back_mm: [f64; 2],
    /// How the image lies on the film, where their shapes differ; where left out, on all of the film's width, and a file's camera is of
    /// the image's shape.
    pub fit: Option<FitSpec>,
    /// World metres; with `target`, instead of keyframes.
    pub position: Option<[f64; 3]>,
    /// World metres.
    pub target: Option<[f64; 3]>,
    /// Direction that stands upright in the picture; nothing of a camera from a file.
    #[serde(default)]
    pub up: [f64; 3],
    /// A thin lens; a pinhole unless named.
    pub lens: Option<LensSpec>,
    /// glTF file with the camera, relative to the look file.
    pub file: Option<PathBuf>,
    /// Of the camera in it.
    pub name: Option<String>,
    /// Frame of the file that is frame 1 of the shot; frame 0 is the file's time 0 where left out.
    pub start: Option<f64>,
    /// Poses at frames, in ascending order.
    #[serde(default, rename = "keyframe")]
    pub keyframes: Vec<KeyframeSpec>,
}

/// How an image lies on a film of another shape.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum FitSpec {
    /// As wide as the film: Maya's Horizontal, USD's `adjustApertureHeight`.
    Width,
    /// As high as the film: Maya's Vertical, USD's `adjustApertureWidth`.
    Height,
    /// As large as fits on the film: Maya's Fill, USD's `cropAperture`.
    Fill,
    /// As small as holds all of the film: Maya's Overscan, USD's `expandAperture`.
    Overscan,
}

impl FitSpec {
    /// All of them, by the words of looks.
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
    /// Focal length over the aperture's diameter.
    pub f_stop: f64,
    /// To the plane that is sharp, along the optical axis, metres.
    pub focus_distance_m: f64,
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
    /// Metres; the lens's own where left out.
    pub focus_distance_m: Option<f64>,
}

/// Size and sampling of the picture.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ImageSpec {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Pixels on each side beyond the image.
    pub overscan: u32,
    /// Left, upper, right and lower end of the pixels that are rendered; all of the image where left out.
    pub crop: Option<[f64; 4]>,
    /// Samples a pixel, spread over the pixel and over the shutter.
    pub samples: u32,
    /// Fraction of a frame for which the shutter is open, centred on the frame; 0 = no motion blur.
    pub shutter: f64,
    /// How far it is open over that time.
    pub shutter_curve: CurveSpec,
    /// Shares of that time in which a trapezoid's shutter opens and closes.
    pub shutter_ramps: Option<[f64; 2]>,
}

/// How far a shutter is open while it is.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum CurveSpec {
    /// Wholly, all the time.
    Box,
    /// Steadily more up to the middle, and less after it.
    Triangle,
    /// Steadily more while it opens, then wholly, then steadily less.
    Trapezoid,
}

/// How the water is drawn.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RendererSpec {
    /// Which way.
    pub method: MethodSpec,
}

/// Ways to draw the water.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum MethodSpec {
    /// Screen-space fluid rendering: splats, smoothed. Fast.
    Ssfr,
    /// Rays through a level set of the particles. For final frames.
    Ray,
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

/// What a particle is splatted as.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum SplatSpec {
    /// Flattened and stretched as its neighbours lie (Yu and Turk 2013); a lone one is a ball of its own volume.
    Ellipsoid,
    /// A ball of the splat radius.
    Sphere,
}

/// How splats become a surface.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurfaceSpec {
    /// Which filter.
    pub filter: FilterSpec,
    /// What a particle is splatted as.
    pub splat: SplatSpec,
    /// Splat radius, metres; 0.87 particle spacings where left out.
    pub radius_m: Option<f64>,
    /// Standard deviation of the smoothing, metres in the world; 0.5 particle spacings where left out, 1.6 of balls.
    pub smoothing_width_m: Option<f64>,
    /// Voxels a particle spacing of the level set that rays are cast into.
    pub voxels_per_spacing: f64,
    /// Root mean square slope of the waves too small to be drawn, which widens the glitter.
    pub roughness: f64,
    /// Fine waves drawn into the normals; none unless named.
    pub ripple: Option<RippleSpec>,
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
#[serde(deny_unknown_fields)]
pub struct WaterSpec {
    /// Refractive index.
    pub index: f64,
    /// Red, green, blue, 1/m.
    pub absorption_per_metre: [f64; 3],
    /// Red, green, blue, 1/m: what makes deep water turquoise, not black.
    pub scattering_per_metre: [f64; 3],
    /// White water where particles are thrown clear or fast; none unless named.
    pub spray: Option<SpraySpec>,
    /// Sunlight that waves bend onto what lies below; straight on unless named.
    pub caustics: Option<CausticsSpec>,
}

/// The map of sunlight that comes through the water.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CausticsSpec {
    /// Texels along the longer side of the ground that it covers.
    pub resolution: u32,
    /// Standard deviation with which the surface's normals are smoothed for it, metres; 1.5 particle spacings where left out.
    pub smoothing_width_m: Option<f64>,
}

/// How a stream of whitewater is drawn.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WhitewaterLook {
    /// Name of the stream, of `CACHE/whitewater`.
    pub stream: String,
    /// Optical density within a whitewater particle, 1/m.
    pub density_per_metre: f64,
    /// Factor on its radius.
    pub size: f64,
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
#[serde(deny_unknown_fields)]
pub struct SunSpec {
    /// 0 = along +x, 90 = along +z.
    pub azimuth_degrees: f64,
    /// Above the horizon.
    pub elevation_degrees: f64,
    /// Factor on the sun that a clear sky of this turbidity lets through; 0 = none.
    pub intensity: f64,
}

/// What the water mirrors.
#[derive(Clone, Debug, Deserialize)]
#[serde(tag = "model", rename_all = "snake_case", deny_unknown_fields)]
pub enum SkySpec {
    /// Hosek and Wilkie 2012.
    HosekWilkie {
        /// 1 (clear) to 10 (hazy).
        turbidity: f64,
        /// Reflectance of the land around, red, green, blue.
        albedo: [f64; 3],
        /// Whether the air near the ground is as clear as the turbidity says, whatever the ground's haze is.
        haze: bool,
    },
    /// A latitude-longitude panorama, scene-linear.
    Panorama {
        /// EXR, relative to the look file.
        file: PathBuf,
        /// Turn about the vertical.
        rotate_degrees: f64,
        /// Factor on its radiance.
        intensity: f64,
    },
}

/// The ground plane.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroundSpec {
    /// Reflectance, linear red, green, blue.
    pub colour: [f64; 3],
    /// How uneven that is, 0 to 1.
    pub variation: f64,
    /// Distance after which air has taken 63 % of the contrast, metres; without effect where the sky's own haze is drawn.
    pub haze_m: f64,
}

/// Quay walls along sides of the domain.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BasinSpec {
    /// Above the domain's floor, metres.
    pub height_m: f64,
    /// Metres.
    pub thickness_m: f64,
    /// Where they stand.
    pub sides: Vec<Wall>,
    /// Reflectance, linear red, green, blue; 1.1 times the ground's where left out, white under a texture.
    pub colour: Option<[f64; 3]>,
    /// A picture on them, laid on along axes.
    #[serde(rename = "texture")]
    pub laid: Option<TextureSpec>,
}

/// The scene's wave makers, as plates.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WaveMakersSpec {
    /// Above the domain's floor, metres.
    pub height_m: f64,
    /// Metres.
    pub thickness_m: f64,
    /// Reflectance, linear red, green, blue.
    pub colour: [f64; 3],
}

/// Water beyond the domain's sides.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SeaSpec {
    /// Still water above the domain's floor, metres.
    pub level_m: f64,
    /// Over which the edge of the simulated water goes over into the sea, metres.
    pub band_m: f64,
    /// Beyond which it lies.
    pub sides: Vec<Wall>,
    /// Its own waves; the scene's where left out.
    pub waves: Option<SeaWavesSpec>,
}

/// Waves of a sea.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SeaWavesSpec {
    /// Four times the root of the elevation's variance, metres.
    pub significant_height_m: f64,
    /// Seconds.
    pub peak_period_s: f64,
    /// Seconds; 0.35 of the peak's where left out.
    pub shortest_period_s: Option<f64>,
    /// Where they go, from +x towards +z.
    pub direction_degrees: f64,
    /// s of (cos ½θ)^2s.
    pub spreading: f64,
    /// Of chance.
    pub seed: u32,
}

/// How the scene's solids look.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SolidsSpec {
    /// Reflectance, linear red, green, blue.
    pub colour: [f64; 3],
    /// Rows of windows on upright faces; none unless named.
    pub windows: Option<WindowsSpec>,
    /// MTL file, relative to the look file.
    pub materials: Option<PathBuf>,
    /// Materials of the look's own.
    #[serde(default)]
    pub material: Vec<MaterialSpec>,
    /// A picture on what has no material, laid on along axes.
    #[serde(rename = "texture")]
    pub laid: Option<TextureSpec>,
}

/// How a part of a solid looks.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialSpec {
    /// Of the part, or of the mesh file without its ending.
    pub name: String,
    /// Reflectance, linear red, green, blue; white under a texture and that of all solids else where left out.
    pub colour: Option<[f64; 3]>,
    /// A picture on it; none unless named.
    pub texture: Option<TextureSpec>,
    /// Whether the windows of `[solids]` may be on it.
    pub windows: bool,
}

/// A picture on a solid.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TextureSpec {
    /// PNG, relative to the look file.
    pub file: PathBuf,
    /// That it covers, metres; as the mesh's texture coordinates say where left out.
    pub metres: Option<f64>,
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
    pub lit: f64,
}

/// From scene-linear light to a picture.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
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
        super::default_of(super::keys::VIEW)
    }
}

/// Tone curves.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum TransformSpec {
    /// Sobotka's AgX: a filmic curve in log light that lets colours run to white.
    Agx,
    /// ACES 1.0: reference rendering transform and output transform for sRGB displays of 100 nits in a dim room.
    Aces,
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

/// Primaries and white of linear light.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum ColourSpaceSpec {
    /// ITU-R BT.709, white D65.
    #[default]
    Rec709,
    /// AP1 with the white of ACES.
    AcesCg,
}

/// What becomes of what is opaque and seen directly.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum SolidsOutput {
    /// It is in the picture.
    Draw,
    /// It is black and transparent, and cuts what stands behind it.
    Holdout,
}

/// Parts of a picture's light. Each light belongs to one, so that all of them add up to the picture; what spray covers is dimmed in
/// each of them.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum LightSpec {
    /// What the first surface of the water mirrors.
    Reflection,
    /// What comes through that surface, but for what water scatters.
    Refraction,
    /// What water scatters.
    Scattering,
    /// Glitter of the sun on that surface, and the sun's disc.
    Sun,
    /// The sky, and the light of the air before something.
    Sky,
    /// White water in the air.
    Spray,
    /// What is opaque and seen directly.
    Solids,
    /// Sunlight that came through water onto something opaque in it, of a look with caustics.
    Caustics,
    /// Foam and bubbles of a stream of whitewater.
    Foam,
}

impl LightSpec {
    /// All of them, in the order of the shaders' `light_parts`, with the names of their layers.
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

/// What of a pixel the channels beside the picture show.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum AovFilterSpec {
    /// Its centre, at the frame's instant, through a pinhole.
    Centre,
    /// The mean over the picture's samples: over the pixel, the shutter and the lens.
    Beauty,
}

/// What is written.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputSpec {
    /// At least one.
    pub formats: Vec<FormatSpec>,
    /// In the EXR.
    pub aovs: Vec<AovSpec>,
    /// What of a pixel they show.
    pub aov_filter: AovFilterSpec,
    /// Of the EXR's light.
    pub colour_space: ColourSpaceSpec,
    /// What becomes of ground, solids and walls.
    pub solids: SolidsOutput,
    /// Layers of the EXR.
    pub lights: Vec<LightSpec>,
    /// Whether the EXR has mattes of objects.
    pub cryptomatte: bool,
    /// Whether the sky is in the picture, or left transparent.
    pub background: bool,
}
