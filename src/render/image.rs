//! Pictures, and the files that hold them.

mod exr_file;
mod pixels;
mod png_file;

use std::borrow::Cow;
use std::io::Write;
use std::path::Path;

use glam::{DMat4, DVec4};

use super::{RenderError, cryptomatte::Matte};
use swell_domain::eye::Eye;
use swell_scene::look::{ColourSpaceSpec, LightSpec, Window};

pub use exr_file::{read_exr_attributes, write_exr};
pub use pixels::{Pixels, read_exr, read_png, write_rgb_png};
pub use png_file::{png_header, read_png_attributes, write_png, write_png_with_attributes};

/// A picture and the channels beside it; rows from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Where its upper left pixel stands in the image that is shown: before it with overscan, within it with a crop.
    pub corner: [i32; 2],
    /// Columns and rows of the image that is shown.
    pub display: [u32; 2],
    /// Scene-linear Rec. 709, premultiplied by alpha; `width × height`.
    pub beauty: Vec<[f32; 4]>,
    /// What the look asked for.
    pub aovs: Aovs,
    /// Parts of the light that the look asked for: as the beauty, without coverage.
    pub lights: Vec<(LightSpec, Vec<[f32; 3]>)>,
    /// Which objects each pixel sees, where the look asks for that.
    pub matte: Option<Matte>,
    /// From where it was taken; `None` of a picture that no camera took.
    pub view: Option<View>,
    /// Of the light in its EXR; in memory it is that of Rec. 709.
    pub exr_space: ColourSpaceSpec,
}

/// The camera of a picture at the frame's instant, as the standard attributes of OpenEXR have it: matrices row by row, for points
/// that stand before them as rows (x, y, z, 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// To x right, y up, and z towards the viewer; metres.
    pub world_to_camera: [f32; 16],
    /// To the picture, (0, 0) its upper left corner and (1, 1) the lower right one, once divided by the last coordinate.
    pub world_to_ndc: [f32; 16],
    /// Frames a second.
    pub frames_per_second: f64,
}

impl View {
    /// That of a camera in the world.
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
            // Columns one after the other, of the transposed matrix, are rows.
            matrix.transpose().to_cols_array().map(|x| x as f32)
        };
        Self {
            world_to_camera: rows([camera[0], camera[1], camera[2], DVec4::W]),
            world_to_ndc: rows([across, down, DVec4::W, depth]),
            frames_per_second,
        }
    }
}

/// Channels beside the picture, at pixel centres and the frame's instant; `None` where not asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Aovs {
    /// Depth of the first surface along the optical axis, metres; 1e30 in the sky.
    pub z: Option<Vec<f32>>,
    /// World normal of the first surface; zero in the sky.
    pub n: Option<Vec<[f32; 3]>>,
    /// World position of the first surface, metres; zero in the sky.
    pub p: Option<Vec<[f32; 3]>>,
    /// Where the first surface will be in the next frame's picture less where it is, pixels; u points
    /// right and v up, as compositing programs read it.
    pub forward: Option<Vec<[f32; 2]>>,
    /// Water along the line of sight in front of what is solid, metres.
    pub thickness: Option<Vec<f32>>,
}

impl Image {
    /// A black, transparent picture without AOVs.
    pub fn new(width: u32, height: u32) -> Self {
        let size = [width, height];
        let corner = [0, 0];
        Self::of(Window { corner, size }, size)
    }

    /// As [`Image::new`], of the pixels of a window of an image of so many columns and rows.
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
    /// Beauty of each pixel of the image that is shown: black and transparent where it was not rendered.
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

/// Where a picture comes from; written into its file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Attributes {
    /// Frame number.
    pub frame: u32,
    /// Name of the shot.
    pub shot: String,
    /// Program and version.
    pub software: String,
    /// Of the scene's physics.
    pub scene_hash: String,
    /// Of the cache frame.
    pub cache_hash: String,
    /// Of the look.
    pub look_hash: String,
}

impl Attributes {
    /// Names as they stand in files, with values.
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

/// The attributes in the header of a PNG or EXR, by the file's ending; the pixels are not looked at. `None` for a file
/// of another ending.
///
/// # Errors
/// [`RenderError::Write`] or [`RenderError::Format`] where it cannot be opened, or its header is none.
pub fn read_header(path: &Path) -> Result<Option<Attributes>, RenderError> {
    match path.extension().and_then(|ending| ending.to_str()) {
        Some("png") => png_file::read_png_header(path).map(Some),
        Some("exr") => exr_file::read_exr_header(path).map(Some),
        _ => Ok(None),
    }
}

/// Writes beside the file and renames, so that a picture that exists is whole.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), RenderError> {
    let fault = |source| RenderError::Write {
        file: path.to_owned(),
        source,
    };
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let part = path.with_file_name(name);
    let mut file = std::fs::File::create(&part).map_err(fault)?;
    file.write_all(bytes)
        .and_then(|()| file.sync_all())
        .map_err(fault)?;
    std::fs::rename(&part, path).map_err(fault)
}
