//! Pictures and their files.

mod exr_file;
mod pixels;
mod png_file;

use std::borrow::Cow;
use std::path::Path;

use glam::{DMat4, DVec4};

use super::{RenderError, cryptomatte::Matte};
use swell_domain::{eye::Eye, output};
use swell_scene::look::{ColourSpaceSpec, LightSpec, Window};

pub(crate) use exr_file::lat_long;
pub use exr_file::{read_exr_attributes, write_exr};
pub use pixels::{Pixels, read_exr, read_png, write_rgb_png};
pub use png_file::{png_header, read_png_attributes, write_png, write_png_with_attributes};

/// A picture with its additional channels. Rows begin at the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Position of the upper left pixel in the display window, pixels: negative with overscan,
    /// positive with a crop.
    pub corner: [i32; 2],
    /// Columns and rows of the display window.
    pub display: [u32; 2],
    /// Scene-linear Rec. 709, premultiplied by alpha; `width × height` pixels.
    pub beauty: Vec<[f32; 4]>,
    /// Additional channels that the look requests.
    pub aovs: Aovs,
    /// Light components that the look requests, in the units of the beauty and without coverage.
    pub lights: Vec<(LightSpec, Vec<[f32; 3]>)>,
    /// Cryptomatte layer, where the look requests one.
    pub matte: Option<Matte>,
    /// Camera of the picture; `None` for a picture without a camera.
    pub view: Option<CameraAttributes>,
    /// Colour space of the light in the EXR file; in memory the light is always Rec. 709.
    pub exr_space: ColourSpaceSpec,
}

/// Camera of a picture at the frame's instant, in the form of OpenEXR's standard attributes:
/// row-major matrices that row vectors (x, y, z, 1) multiply from the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraAttributes {
    /// From world space to camera space: x right, y up, z towards the viewer; metres.
    pub world_to_camera: [f32; 16],
    /// From world space to the picture after division by the last coordinate, with (0, 0) in its
    /// upper left corner and (1, 1) in the lower right one.
    pub world_to_ndc: [f32; 16],
    /// Frames per second.
    pub frames_per_second: f64,
}

impl CameraAttributes {
    /// Converts a camera in world space.
    pub fn of(eye: &Eye, frames_per_second: f64) -> Self {
        let [width, height] = eye.size.map(f64::from);
        let (right, up, forward) = (eye.right, eye.up, eye.forward);
        let columns = [right, up, -forward];
        let camera = columns.map(|axis| axis.extend(-axis.dot(eye.position)));
        let depth = -camera[2];
        let middle = [0.5 + eye.axis[0] / width, 0.5 + eye.axis[1] / height];
        let across = eye.focal / width * camera[0] + middle[0] * depth;
        let down = middle[1] * depth - eye.focal / height * camera[1];
        let rows = |columns: [DVec4; 4]| {
            let matrix = DMat4::from_cols_array_2d(&columns.map(|c| c.to_array()));
            // The columns of the transposed matrix are the rows.
            matrix.transpose().to_cols_array().map(|x| x as f32)
        };
        Self {
            world_to_camera: rows([camera[0], camera[1], camera[2], DVec4::W]),
            world_to_ndc: rows([across, down, DVec4::W, depth]),
            frames_per_second,
        }
    }
}

/// Arbitrary output variables, sampled at pixel centres and the frame's instant; `None` where not
/// requested.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Aovs {
    /// Depth of the first surface along the optical axis, metres; 1e30 in the sky.
    pub z: Option<Vec<f32>>,
    /// World-space normal of the first surface; zero in the sky.
    pub n: Option<Vec<[f32; 3]>>,
    /// World-space position of the first surface, metres; zero in the sky.
    pub p: Option<Vec<[f32; 3]>>,
    /// Motion of the first surface to the next frame's picture, pixels; u points right and v up, as
    /// compositing programs read it.
    pub forward: Option<Vec<[f32; 2]>>,
    /// Length of water along the line of sight in front of opaque geometry, metres.
    pub thickness: Option<Vec<f32>>,
}

impl Image {
    /// Returns a black, transparent picture without additional channels.
    pub fn new(width: u32, height: u32) -> Self {
        let size = [width, height];
        let corner = [0, 0];
        Self::of(Window { corner, size }, size)
    }

    /// Like [`Image::new`], for a window of an image with `display` columns and rows.
    pub fn of(window: Window, display: [u32; 2]) -> Self {
        let [width, height] = window.size;
        Self {
            width,
            height,
            corner: window.corner,
            display,
            beauty: vec![[0.0; 4]; width as usize * height as usize],
            aovs: Aovs::default(),
            lights: Vec::new(),
            matte: None,
            view: None,
            exr_space: ColourSpaceSpec::default(),
        }
    }
}

impl Image {
    /// Returns the beauty of every pixel of the display window; pixels that were not rendered are
    /// black and transparent.
    pub fn shown(&self) -> Cow<'_, [[f32; 4]]> {
        if self.corner == [0; 2] && self.display == [self.width, self.height] {
            return Cow::Borrowed(&self.beauty);
        }
        let [width, height] = self.display.map(|side| side as i32);
        let within = |at: i32, axis: usize, size: u32| {
            let at = at - self.corner[axis];
            (0..size as i32).contains(&at).then_some(at as usize)
        };
        let pixel = |y: i32, x: i32| {
            let (row, column) = (within(y, 1, self.height)?, within(x, 0, self.width)?);
            self.beauty.get(row * self.width as usize + column).copied()
        };
        (0..height)
            .flat_map(|y| (0..width).map(move |x| (y, x)))
            .map(|(y, x)| pixel(y, x).unwrap_or_default())
            .collect()
    }
}

/// Provenance of a picture, written into its file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Attributes {
    /// Frame number.
    pub frame: u32,
    /// Name of the shot.
    pub shot: String,
    /// Program and version.
    pub software: String,
    /// Hash of the scene's physics.
    pub scene_hash: String,
    /// Hash of the cache frame.
    pub cache_hash: String,
    /// Hash of the look.
    pub look_hash: String,
}

impl Attributes {
    /// Names of the attributes in files, with their values.
    fn texts(&self) -> [(&'static str, &str); 5] {
        [
            ("shot", &self.shot),
            ("software", &self.software),
            ("swell:scene_hash", &self.scene_hash),
            ("swell:cache_hash", &self.cache_hash),
            ("swell:look_hash", &self.look_hash),
        ]
    }

    fn set(&mut self, name: &str, value: String) {
        match name {
            "shot" => self.shot = value,
            "software" => self.software = value,
            "swell:scene_hash" => self.scene_hash = value,
            "swell:cache_hash" => self.cache_hash = value,
            "swell:look_hash" => self.look_hash = value,
            _ => {}
        }
    }
}

/// Reads the attributes from the header of a PNG or EXR, chosen by the file's extension, without
/// decoding pixels. Returns `None` for any other extension.
///
/// # Errors
/// [`RenderError::Write`] or [`RenderError::Format`] if the file cannot be opened or its header is
/// invalid.
pub fn read_header(path: &Path) -> Result<Option<Attributes>, RenderError> {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("png") => png_file::read_png_header(path).map(Some),
        Some("exr") => exr_file::read_exr_header(path).map(Some),
        _ => Ok(None),
    }
}

/// Writes a picture that is complete when it exists.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), RenderError> {
    output::write(path, bytes).map_err(|error| RenderError::Write {
        file: path.to_owned(),
        source: error.source,
    })
}
