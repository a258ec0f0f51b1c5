//! Keys of a look.

mod streams;

use super::super::key::{Interval, Key, words};
use swell_scene::look::{FitSpec, MOST_SAMPLES, MOST_VOXELS};

use streams::{WET, WHITEWATER};

pub(in super::super) const KEYS: &[Key] = &[
    Key::table("camera", CAMERA).about(
        "Where the picture is taken from: a camera, still, keyframed or from a file of glTF or USD",
    ),
    Key::table("image", IMAGE)
        .default("{}")
        .about("Size and sampling"),
    Key::table("renderer", RENDERER)
        .default("{}")
        .about("How the water is drawn"),
    Key::table("surface", SURFACE)
        .default("{}")
        .about("How splats become a surface"),
    Key::table("water", WATER)
        .default("{}")
        .about("What the water is like inside"),
    Key::table("whitewater", WHITEWATER)
        .absent()
        .about("Spray, foam and bubbles of a stream that `swell whitewater` made"),
    Key::table("wet", WET)
        .absent()
        .about("Solids that stay wet, by a stream that `swell wet` made"),
    Key::table("sun", SUN).default("{}").about("The sun"),
    Key::table("sky", SKY).about("What the water mirrors"),
    Key::table("ground", GROUND)
        .default("{}")
        .about("The plane at the domain's floor, which runs to the horizon"),
    Key::table("basin", BASIN)
        .absent()
        .about("Quay walls just outside the domain's sides"),
    Key::table("wave_makers", WAVE_MAKERS)
        .absent()
        .about("The scene's wave makers as plates, where they stand at the frame"),
    Key::table("sea", SEA)
        .absent()
        .about("Water beyond the domain's sides, as far as the horizon"),
    Key::table("solids", SOLIDS)
        .default("{}")
        .about("The scene's solids"),
    Key::table("view", VIEW)
        .default("{}")
        .about("From scene-linear light to a picture"),
    Key::table("output", OUTPUT)
        .default("{}")
        .about("What is written"),
];

/// Metres. Farther from the origin, `f32` positions are coarser than a millimetre.
const PLACE: Interval = -1e5..=1e5;

/// A fraction or a reflectance.
const PART: Interval = 0.0..=1.0;

const FOCAL_LENGTH: Interval = 1.0..=5000.0;

/// Size of a wall or a storey, metres.
const SIZE: Interval = 1e-3..=1e3;

/// Absorption or scattering coefficient of water, 1/m.
const PER_METRE: Interval = 0.0..=1e4;

const DEGREES: Interval = -360.0..=360.0;

const FITS: &[&str] = &words(&FitSpec::NAMED);

const CAMERA: &[Key] = &[
    Key::number("focal_length_mm", FOCAL_LENGTH)
        .unit("mm")
        .without(&["file"])
        .about("focal length"),
    Key::vector("film_back_mm", 2, 1.0..=500.0)
        .unit("mm")
        .default("[36.0, 20.25]")
        .about("width and height of the exposed film"),
    Key::choice("fit", FITS)
        .computed(|| "the film's width; a `file`'s camera must be of the image's shape".to_owned())
        .about(
            "how the image lies on a film of another shape: as wide or as high as the film, as \
             large as fits on it, or as small as holds all of it",
        ),
    Key::vector("position", 3, PLACE)
        .unit("metres")
        .absent()
        .without(&["keyframe", "file"])
        .about("where it stands, with `target`"),
    Key::vector("target", 3, PLACE)
        .unit("metres")
        .absent()
        .without(&["keyframe", "file"])
        .about("what it looks at"),
    Key::vector("up", 3, -1.0..=1.0)
        .default("[0.0, 1.0, 0.0]")
        .without(&["file"])
        .also(", neither zero nor along the line of sight")
        .about("direction that stands upright in the picture"),
    Key::table("lens", LENS)
        .absent()
        .about("A thin lens in place of the pinhole: depth of field"),
    Key::text(
        "file",
        "a glTF file (.glb, .gltf) or USD as text (.usda), relative to the look file",
    )
    .absent()
    .about(
        "camera from a file, animated, instead of `position`, `target` and `focal_length_mm`; \
         frame k is at k / fps seconds",
    ),
    Key::text(
        "name",
        "the name of a camera's node, or of a camera, in `file`; of USD its path will do too",
    )
    .absent()
    .with("file")
    .about("which of its cameras; may be left out where there is one"),
    Key::number("start", -1e6..=1e6)
        .absent()
        .with("file")
        .about(
            "the file's frame that is frame 1 of the shot, such as 1001: of USD a time code, of \
             glTF a frame of the shot's rate",
        ),
    Key::tables("keyframe", KEYFRAME)
        .without(&["file"])
        .about("Poses at frames, in ascending order, instead of position and target"),
];

/// Focus distance, metres.
const FOCUS: Interval = 1e-3..=1e5;

const LENS: &[Key] = &[
    Key::number("f_stop", 0.1..=1000.0).about("focal length over the aperture's diameter"),
    Key::number("focus_distance_m", FOCUS)
        .unit("metres")
        .about("to the plane that is sharp, along the optical axis"),
];

const KEYFRAME: &[Key] = &[
    Key::number("frame", -1e6..=1e6)
        .also(", each after the one before")
        .about("frame number; frame 1 is the first"),
    Key::vector("position", 3, PLACE)
        .unit("metres")
        .about("where the camera stands"),
    Key::vector("target", 3, PLACE)
        .unit("metres")
        .about("what it looks at"),
    Key::number("focal_length_mm", FOCAL_LENGTH)
        .unit("mm")
        .computed(|| "the camera's own".to_owned())
        .about("focal length"),
    Key::number("focus_distance_m", FOCUS)
        .unit("metres")
        .computed(|| "the lens's own".to_owned())
        .also(", with [camera.lens]")
        .about("to the plane that is sharp"),
];

const IMAGE: &[Key] = &[
    Key::whole("width", 1..=32768)
        .unit("pixels")
        .default("640")
        .about("width"),
    Key::whole("height", 1..=32768)
        .unit("pixels")
        .default("360")
        .about("height"),
    Key::whole("overscan", 0..=8192)
        .unit("pixels")
        .default("0")
        .also(", not together with crop")
        .about("pixels on each side beyond the image, in the EXR's data window alone"),
    Key::vector("crop", 4, 0.0..=32768.0)
        .unit("pixels")
        .absent()
        .also(", whole, x0 < x1 and y0 < y1 within the image")
        .about(
            "[x0, y0, x1, y1] from the upper left corner: only these pixels are rendered, x1 and \
             y1 are the first beyond them",
        ),
    Key::whole("samples", 1..=MOST_SAMPLES)
        .default("3")
        .about("samples a pixel, spread over the pixel and over the shutter"),
    Key::number("shutter", PART)
        .unit("of a frame")
        .default("0.0")
        .about("how long the shutter is open, centred on the frame; 0 is no motion blur"),
    Key::choice("shutter_curve", &["box", "triangle", "trapezoid"])
        .default("\"box\"")
        .about("how far it is open over that time: at once, steadily up and down, or with ramps"),
    Key::vector("shutter_ramps", 2, PART)
        .unit("of the open time")
        .only("shutter_curve", &["trapezoid"])
        .default("[0.25, 0.25]")
        .also(", at most 1 together")
        .about("how long it takes to open and to close"),
];

const RENDERER: &[Key] = &[Key::choice("method", &["ssfr", "ray"])
    .default("\"ssfr\"")
    .about(
        "splats in screen space, fast, or rays through a level set of the \
         particles, for final frames",
    )];

const SURFACE: &[Key] = &[
    Key::choice("filter", &["curvature_flow", "narrow_range"])
        .default("\"curvature_flow\"")
        .about(
            "van der Laan 2009 with the world-space width of Bagar 2010, or Truong and Yuksel 2018",
        ),
    Key::choice("splat", &["ellipsoid", "sphere"])
        .default("\"ellipsoid\"")
        .about(
            "what a particle is splatted as, with `method = \"ssfr\"`: flattened as its neighbours \
             lie (Yu and Turk 2013), or a ball",
        ),
    Key::number("radius_m", 1e-4..=100.0)
        .unit("metres")
        .computed(|| "0.87 particle spacings".to_owned())
        .about(
            "splat radius; ellipsoids are as much larger or smaller as it is than \
             what it is if left out",
        ),
    Key::number("smoothing_width_m", 0.0..=100.0)
        .unit("metres")
        .computed(|| "0.5 particle spacings, 1.6 of balls".to_owned())
        .about("standard deviation of the smoothing, in the world"),
    Key::number("voxels_per_spacing", 1.0..=MOST_VOXELS)
        .default("2.0")
        .about("voxels a particle spacing of the level set, with `method = \"ray\"`"),
    Key::number("roughness", 1e-3..=1.0).default("0.08").about(
        "root mean square slope of the waves too small to be drawn, which widens the glitter",
    ),
    Key::table("ripple", RIPPLE)
        .absent()
        .about("Fine waves drawn into the normals"),
];

const RIPPLE: &[Key] = &[
    Key::number("wavelength_m", 1e-3..=1000.0)
        .unit("metres")
        .about("longest wave"),
    Key::number("slope", PART).about("root mean square slope"),
];

const WATER: &[Key] = &[
    Key::number("index", 1.0..=3.0)
        .default("1.333")
        .about("refractive index"),
    Key::vector("absorption_per_metre", 3, PER_METRE)
        .unit("1/m")
        .default("[0.34, 0.057, 0.0064]")
        .about("red, green, blue"),
    Key::vector("scattering_per_metre", 3, PER_METRE)
        .unit("1/m")
        .default("[0.0, 0.0, 0.0]")
        .about("red, green, blue: what makes deep water turquoise, not black"),
    Key::table("spray", SPRAY)
        .absent()
        .about("White water where particles are thrown clear or fast"),
    Key::table("caustics", CAUSTICS)
        .absent()
        .also(", with `method = \"ray\"`")
        .about(
            "Sunlight that the water's waves bend and bundle on what lies below; \
             straight on where left out",
        ),
];

const CAUSTICS: &[Key] = &[
    Key::whole("resolution", 16..=8192)
        .unit("texels")
        .default("1024")
        .about(
            "along the longer side of the ground that the map of light covers: the \
             domain's, with the sea's band",
        ),
    Key::number("smoothing_width_m", 0.0..=100.0)
        .unit("metres")
        .computed(|| "1.5 particle spacings".to_owned())
        .about(
            "standard deviation with which the surface's normals are smoothed for it: particles \
             leave bumps, which would bundle light too",
        ),
];

const SPRAY: &[Key] = &[
    Key::number("density_per_metre", PER_METRE)
        .unit("1/m")
        .about("optical density of fully aerated water"),
    Key::number("speed_m_per_s", 1e-3..=1e4)
        .unit("m/s")
        .about("speed from which the surface begins to whiten"),
];

const SUN: &[Key] = &[
    Key::number("azimuth_degrees", DEGREES)
        .unit("degrees")
        .default("60.0")
        .about("0 is along +x, 90 along +z"),
    Key::number("elevation_degrees", 0.5..=90.0)
        .unit("degrees")
        .default("40.0")
        .about("above the horizon"),
    Key::number("intensity", 0.0..=1000.0)
        .default("1.0")
        .about("factor on the sun that a clear sky of this turbidity lets through; 0 is none"),
];

const CLEAR: &[&str] = &["hosek_wilkie"];
const PANORAMA: &[&str] = &["panorama"];

const SKY: &[Key] = &[
    Key::choice("model", &["hosek_wilkie", "panorama"])
        .about("Hosek and Wilkie 2012, or a latitude-longitude picture"),
    Key::number("turbidity", 1.0..=10.0)
        .only("model", CLEAR)
        .default("3.0")
        .about("1 (clear) to 10 (hazy)"),
    Key::vector("albedo", 3, PART)
        .only("model", CLEAR)
        .default("[0.15, 0.15, 0.15]")
        .about("reflectance of the land around, red, green, blue"),
    Key::flag("haze")
        .only("model", CLEAR)
        .default("false")
        .about(
            "whether air takes the contrast as this turbidity says, in place of ground.haze_m: \
             63 % within 5.6 km at 3",
        ),
    Key::text("file", "an EXR file, relative to the look file")
        .only("model", PANORAMA)
        .about("scene-linear picture"),
    Key::number("rotate_degrees", DEGREES)
        .unit("degrees")
        .only("model", PANORAMA)
        .default("0.0")
        .about("turn about the vertical"),
    Key::number("intensity", 0.0..=1e6)
        .only("model", PANORAMA)
        .default("1.0")
        .about("factor on its radiance"),
];

const COLOUR: Key = Key::vector("colour", 3, PART).about("reflectance, linear red, green, blue");

const GROUND: &[Key] = &[
    COLOUR.default("[0.30, 0.28, 0.25]"),
    Key::number("variation", PART)
        .default("0.25")
        .about("how uneven that is"),
    Key::number("haze_m", 1.0..=1e7)
        .unit("metres")
        .default("500.0")
        .about("distance after which air has taken 63 % of the contrast"),
];

const BASIN: &[Key] = &[
    Key::number("height_m", SIZE)
        .unit("metres")
        .about("above the domain's floor"),
    Key::number("thickness_m", SIZE)
        .unit("metres")
        .default("0.6")
        .about("of the walls"),
    Key::choices("sides", SIDES)
        .default("[\"-z\", \"+z\"]")
        .about("at which walls stand"),
    COLOUR.computed(|| "1.1 times the ground's, white under a texture".to_owned()),
    LAID,
];

/// Texture of objects without texture coordinates.
const LAID: Key = Key::table("texture", LAID_TEXTURE)
    .absent()
    .about("A picture on what of them has no material, multiplied by `colour`");

const LAID_TEXTURE: &[Key] = &[
    Key::text("file", "a PNG file, relative to the look file").about("sRGB picture, repeated"),
    Key::number("metres", SIZE)
        .unit("metres")
        .about("what one picture covers, laid on along the axis that a face looks along most"),
];

const SIDES: &[&str] = &["-x", "+x", "-z", "+z"];

const WAVE_MAKERS: &[Key] = &[
    Key::number("height_m", SIZE)
        .unit("metres")
        .about("above the domain's floor"),
    Key::number("thickness_m", SIZE)
        .unit("metres")
        .default("0.3")
        .about("of the plates, away from the water"),
    COLOUR.default("[0.42, 0.45, 0.46]"),
];

const SEA: &[Key] = &[
    Key::number("level_m", SIZE)
        .unit("metres")
        .about("still water, above the domain's floor"),
    Key::number("band_m", SIZE)
        .unit("metres")
        .default("6.0")
        .about("from the domain's side to where the sea has its own waves alone"),
    Key::choices("sides", SIDES)
        .default("[\"-x\", \"+x\", \"-z\", \"+z\"]")
        .also(", at least one")
        .about("beyond which there is water"),
    Key::table("waves", SEA_WAVES)
        .computed(|| "those of the scene's generation zone; none where it has none".to_owned())
        .about("Waves of the sea: JONSWAP's, spread over directions"),
];

const SEA_WAVES: &[Key] = &[
    Key::number("significant_height_m", 0.0..=100.0)
        .unit("metres")
        .about("four times the root of the elevation's variance"),
    Key::number("peak_period_s", 1e-2..=100.0)
        .unit("s")
        .about("of the highest waves"),
    Key::number("shortest_period_s", 1e-2..=100.0)
        .unit("s")
        .computed(|| "0.35 of the peak's".to_owned())
        .also(", below the peak's")
        .about("of the shortest waves"),
    Key::number("direction_degrees", DEGREES)
        .unit("degrees")
        .default("0.0")
        .about("where they go: 0 is along +x, 90 along +z"),
    Key::number("spreading", 0.5..=1000.0)
        .default("12.0")
        .about(
            "s of the spread over directions, cos^2s of half the angle; a larger one is narrower",
        ),
    Key::whole("seed", 0..=u32::MAX)
        .default("0")
        .about("another number makes another sea of the same spectrum"),
];

const SOLIDS: &[Key] = &[
    COLOUR.default("[0.55, 0.52, 0.48]"),
    Key::table("windows", WINDOWS)
        .absent()
        .about("Rows of windows on upright faces"),
    Key::text("materials", "an MTL file, relative to the look file")
        .absent()
        .about(
            "colours (Kd) and textures (map_Kd) of the meshes' parts, by the names of their \
             materials (usemtl), groups or objects",
        ),
    Key::tables("material", MATERIAL)
        .about("Materials of parts of the scene's meshes, before those of `materials`"),
    LAID,
];

const MATERIAL: &[Key] = &[
    Key::text(
        "name",
        "the name of a material (usemtl), group (g) or object (o) of a mesh, or of its \
         file without the ending",
    )
    .about("what it is for"),
    COLOUR.computed(|| "white under a texture, else that of all solids".to_owned()),
    Key::table("texture", TEXTURE)
        .absent()
        .about("A picture on it, multiplied by `colour`"),
    Key::flag("windows")
        .default("true")
        .about("whether the windows of [solids] may be on it"),
];

const TEXTURE: &[Key] = &[
    Key::text("file", "a PNG file, relative to the look file").about("sRGB picture, repeated"),
    Key::number("metres", SIZE)
        .unit("metres")
        .computed(|| "laid on by the mesh's texture coordinates (vt)".to_owned())
        .about("what one picture covers, laid on along the axis that a face looks along most"),
];

const WINDOWS: &[Key] = &[
    Key::number("storey_m", SIZE)
        .unit("metres")
        .about("height of a storey"),
    Key::number("bay_m", SIZE)
        .unit("metres")
        .about("width from window to window"),
    Key::number("lit", PART)
        .default("0.0")
        .about("fraction of the windows that are lit from within"),
];

/// Keys that affect only the PNG.
pub(super) const VIEW: &[Key] = &[
    Key::number("exposure_stops", -20.0..=20.0)
        .unit("stops")
        .default("0.0")
        .about("factor of 2 to this power on the light, in the PNG only"),
    Key::choice("transform", &["agx", "aces", "srgb"])
        .default("\"agx\"")
        .about(
            "tone curve of the PNG: Sobotka's, which lets colours run to white, the ACES 1.0 \
             output for sRGB displays, or none",
        ),
    Key::number("saturation", 0.0..=3.0)
        .default("1.0")
        .about("factor on the distance from grey after the tone curve"),
    Key::number("contrast", 0.2..=3.0)
        .default("1.0")
        .about("power about middle grey after the tone curve"),
];

const LIGHTS: &[&str] = &[
    "reflection",
    "refraction",
    "scattering",
    "sun",
    "sky",
    "spray",
    "solids",
    "caustics",
    "foam",
];

const OUTPUT: &[Key] = &[
    Key::choices("formats", &["png", "exr"])
        .default("[\"png\"]")
        .also(", at least one")
        .about("8 bits through the view, or scene-linear with AOVs"),
    Key::choices("aovs", &["Z", "N", "P", "forward", "thickness"])
        .default("[]")
        .also(", with formats = [\"exr\"]")
        .about(
            "depth along the axis, m; normal; position, m; motion to the next frame, pixels, u to \
             the right, v upward; water along the line of sight, m",
        ),
    Key::choice("aov_filter", &["centre", "beauty"])
        .default("\"centre\"")
        .about(
            "what of a pixel the channels show: its centre at the frame's instant, or the mean of \
             the picture's samples; Z, N, P and forward over those that meet something",
        ),
    Key::choice("colour_space", &["rec709", "acescg"])
        .default("\"rec709\"")
        .about(
            "primaries and white of the EXR's linear light: Rec. 709 with D65, or ACEScg (AP1) \
             with the white of ACES, adapted by Bradford",
        ),
    Key::choice("solids", &["draw", "holdout"])
        .default("\"draw\"")
        .about(
            "whether ground, solids and walls are in the picture, or black and transparent where \
             they are seen directly, so that they cut the water",
        ),
    Key::choices("lights", LIGHTS)
        .default("[]")
        .also(", with formats = [\"exr\"]")
        .about(
            "parts of the light in layers of their own, premultiplied; all of \
             them add up to R, G, B",
        ),
    Key::flag("cryptomatte")
        .default("false")
        .also(", with formats = [\"exr\"]")
        .about(
            "mattes of water, spray, ground, walls and each solid, by the name of its mesh's file, \
             as Cryptomatte's layer CryptoObject",
        ),
    Key::flag("background")
        .default("true")
        .about("whether the sky is in the picture, or left transparent"),
];
