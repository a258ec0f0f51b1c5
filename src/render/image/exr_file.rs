//! Scene-linear OpenEXR: beauty as half, AOVs as float, and provenance attributes.

use std::path::Path;

use exr::meta::attribute::EnvironmentMap;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples,
    ImageAttributes, IntegerBounds, Layer, LayerAttributes, LineOrder, Text, Vec2, WritableImage,
};
use glam::{DMat3, DVec3};
use half::f16;

use super::super::{
    RenderError,
    colour::{REC_709, Space},
    cryptomatte::Matte,
    sky::white_luminance,
};
use super::{Attributes, Image, write_whole};
use swell_scene::look::{ColourSpaceSpec, LightSpec};

/// Encoding of all files.
const ENCODING: Encoding = Encoding {
    compression: Compression::ZIP16,
    blocks: Blocks::ScanLines,
    line_order: LineOrder::Increasing,
};

fn text(value: &str) -> Text {
    Text::new_or_none(value).unwrap_or_else(|| Text::from("?"))
}

fn chromaticity([x, y]: [f64; 2]) -> Vec2<f32> {
    Vec2(x as f32, y as f32)
}

/// Conversion from Rec. 709 to the light of a file; `None` where both are the same.
struct Light(Option<DMat3>);

impl Light {
    fn to(space: ColourSpaceSpec) -> Self {
        let is_same = space == ColourSpaceSpec::Rec709;
        Self((!is_same).then(|| REC_709.to(Space::of(space))))
    }

    /// Converts one channel of a pixel.
    fn half(&self, pixel: [f32; 3], channel: usize) -> f16 {
        let value = match &self.0 {
            Some(matrix) => matrix.row(channel).dot(DVec3::from(pixel.map(f64::from))) as f32,
            None => pixel[channel],
        };
        // The largest half is 65 504; a brighter glint would become infinite.
        f16::from_f32(value.min(65504.0))
    }
}

/// Writes a single-part OpenEXR file.
///
/// `R G B A` and the light components (`sun.R/.G/.B`, …) are half; the AOVs `Z`, `N.X/.Y/.Z`,
/// `P.X/.Y/.Z`, `forward.u/.v`, `thickness.Y` and the Cryptomatte layer are float. Compression is
/// lossless ZIP. The display window is the image as shown, the data window the rendered part. The
/// light is in the picture's `exr_space`, and the file states its chromaticities. A picture with a
/// camera gets the standard attributes `worldToCamera`, `worldToNDC`, `framesPerSecond` and
/// `whiteLuminance`.
///
/// # Errors
/// [`RenderError::Write`] if the file cannot be written, [`RenderError::Format`] if the picture
/// cannot be encoded.
pub fn write_exr(path: &Path, image: &Image, attributes: &Attributes) -> Result<(), RenderError> {
    let space = Space::of(image.exr_space);
    let light = Light::to(image.exr_space);
    let mut channels = Vec::new();
    for (index, name) in ["R", "G", "B"].into_iter().enumerate() {
        let pixels = image.beauty.iter();
        let samples = pixels.map(|&[r, g, b, _]| light.half([r, g, b], index));
        channels.push(AnyChannel::new(name, FlatSamples::F16(samples.collect())));
    }
    let alpha = image.beauty.iter().map(|pixel| f16::from_f32(pixel[3]));
    channels.push(AnyChannel::new("A", FlatSamples::F16(alpha.collect())));
    for (part, pixels) in &image.lights {
        let named = LightSpec::NAMED.iter().find(|(_, light)| light == part);
        for (index, suffix) in ["R", "G", "B"].into_iter().enumerate() {
            let name = format!("{}.{suffix}", named.map_or("", |(name, _)| name));
            let samples = pixels.iter().map(|&pixel| light.half(pixel, index));
            channels.push(AnyChannel::new(
                name.as_str(),
                FlatSamples::F16(samples.collect()),
            ));
        }
    }
    let mut float = |name: &str, samples: Vec<f32>| {
        channels.push(AnyChannel::new(name, FlatSamples::F32(samples)));
    };
    let aovs = &image.aovs;
    if let Some(z) = &aovs.z {
        float("Z", z.clone());
    }
    for (prefix, values) in [("N", &aovs.n), ("P", &aovs.p)] {
        for (axis, suffix) in ["X", "Y", "Z"].into_iter().enumerate() {
            if let Some(values) = values {
                let samples = values.iter().map(|v| v[axis]).collect();
                float(&format!("{prefix}.{suffix}"), samples);
            }
        }
    }
    if let Some(motion) = &aovs.forward {
        float("forward.u", motion.iter().map(|v| v[0]).collect());
        float("forward.v", motion.iter().map(|v| v[1]).collect());
    }
    if let Some(thickness) = &aovs.thickness {
        float("thickness.Y", thickness.clone());
    }
    for (name, samples) in image.matte.iter().flat_map(Matte::channels) {
        float(&name, samples);
    }

    let size = Vec2(image.width as usize, image.height as usize);
    let shown = Vec2(image.display[0] as usize, image.display[1] as usize);
    let view = image.view.as_ref();
    let layer_attributes = LayerAttributes {
        layer_position: Vec2(image.corner[0], image.corner[1]),
        software_name: Some(text(&attributes.software)),
        world_to_camera: view.map(|view| view.world_to_camera),
        world_to_normalized_device: view.map(|view| view.world_to_ndc),
        frames_per_second: view.map(|view| rational(view.frames_per_second)),
        white_luminance: view.map(|_| white_luminance() as f32),
        ..LayerAttributes::default()
    };
    let layer = Layer::new(
        size,
        layer_attributes,
        ENCODING,
        AnyChannels::sort(channels.into()),
    );
    let mut header = ImageAttributes::new(IntegerBounds::from_dimensions(shown));
    let [red, green, blue] = space.primaries.map(chromaticity);
    header.chromaticities = Some(exr::meta::attribute::Chromaticities {
        red,
        green,
        blue,
        white: chromaticity(space.white),
    });
    for (name, value) in attributes.texts() {
        if name != "software" {
            header
                .other
                .insert(text(name), AttributeValue::Text(text(value)));
        }
    }
    for (name, value) in image.matte.iter().flat_map(Matte::attributes) {
        let value = AttributeValue::Text(text(&value));
        header.other.insert(text(&name), value);
    }
    let frame = i32::try_from(attributes.frame).unwrap_or(i32::MAX);
    header
        .other
        .insert(text("frame"), AttributeValue::I32(frame));
    let picture = exr::image::Image::empty(header).with_layer(layer);
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture
        .write()
        .to_buffered(&mut bytes)
        .map_err(|error| RenderError::Format {
            file: path.to_owned(),
            message: error.to_string(),
        })?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes).ok_or_else(|| RenderError::Format {
        file: path.to_owned(),
        message: "the header that was just written cannot be read".to_owned(),
    })?;
    write_whole(path, &bytes)
}

/// Bytes of a latitude-longitude picture of light in linear Rec. 709, half, lossless ZIP.
///
/// # Errors
/// [`RenderError::Scene`] if it cannot be encoded.
pub(crate) fn lat_long(size: [u32; 2], texels: &[[f16; 4]]) -> Result<Vec<u8>, RenderError> {
    let channels = ["R", "G", "B"].into_iter().enumerate().map(|(k, name)| {
        let samples = texels.iter().map(|texel| texel[k]).collect();
        AnyChannel::new(name, FlatSamples::F16(samples))
    });
    let attributes = LayerAttributes {
        environment_map: Some(EnvironmentMap::LatitudeLongitude),
        ..LayerAttributes::default()
    };
    let size = Vec2(size[0] as usize, size[1] as usize);
    let layer = Layer::new(
        size,
        attributes,
        ENCODING,
        AnyChannels::sort(channels.collect()),
    );
    let header = ImageAttributes::new(IntegerBounds::from_dimensions(size));
    let picture = exr::image::Image::empty(header).with_layer(layer);
    let mut bytes = std::io::Cursor::new(Vec::new());
    let encoded = picture.write().to_buffered(&mut bytes);
    encoded.map_err(|error| RenderError::Scene(format!("the sky's picture: {error}")))?;
    let mut bytes = bytes.into_inner();
    let sorted = sort_attributes(&mut bytes);
    sorted.ok_or_else(|| RenderError::Scene("the sky's picture has no header".to_owned()))?;
    Ok(bytes)
}

/// Frame rate as a rational number, as broadcasting writes it: whole, over 1001, or in thousandths.
fn rational(rate: f64) -> (i32, u32) {
    let over = |parts: u32| (rate * f64::from(parts)).round() as i32;
    let near = |parts: u32| (f64::from(over(parts)) / f64::from(parts) / rate - 1.0).abs() < 1e-6;
    let parts = [1, 1001].into_iter().find(|&parts| near(parts));
    let parts = parts.unwrap_or(1000);
    (over(parts), parts)
}

/// Sorts the header's attributes by name. The encoder keeps them in a hash map, whose order changes
/// from run to run; equal pictures must give equal bytes. Offsets in the file stay valid because
/// the header keeps its length.
fn sort_attributes(bytes: &mut [u8]) -> Option<()> {
    // Magic number and version, followed by entries of name\0 type\0 length value up to an empty
    // name.
    const START: usize = 8;
    let mut entries: Vec<Vec<u8>> = Vec::new();
    let mut at = START;
    while *bytes.get(at)? != 0 {
        let name = bytes.get(at..)?.iter().position(|&byte| byte == 0)?;
        let kind_at = at + name + 1;
        let kind = bytes.get(kind_at..)?.iter().position(|&byte| byte == 0)?;
        let length_at = kind_at + kind + 1;
        let length = u32::from_le_bytes(bytes.get(length_at..length_at + 4)?.try_into().ok()?);
        let end = length_at + 4 + length as usize;
        entries.push(bytes.get(at..end)?.to_vec());
        at = end;
    }
    entries.sort_unstable();
    bytes[START..at].copy_from_slice(&entries.concat());
    Some(())
}

/// Reads the attributes of an EXR as far as it has them. Decodes the whole file, so that a
/// truncated one is an error.
///
/// # Errors
/// [`RenderError::Format`] if the file cannot be opened or is not a complete EXR.
pub fn read_exr_attributes(path: &Path) -> Result<Attributes, RenderError> {
    let whole = exr::prelude::read_all_data_from_file(path);
    whole.map_err(|error| undecoded(path, &error))?;
    read_exr_header(path)
}

/// Reads the attributes from an EXR's header only.
///
/// # Errors
/// [`RenderError::Format`] if the file cannot be opened or its header is invalid.
pub(super) fn read_exr_header(path: &Path) -> Result<Attributes, RenderError> {
    let meta = exr::meta::MetaData::read_from_file(path, true);
    let meta = meta.map_err(|error| undecoded(path, &error))?;
    let mut attributes = Attributes::default();
    for header in &meta.headers {
        if let Some(software) = &header.own_attributes.software_name {
            attributes.software = software.to_string();
        }
        let shared = header.shared_attributes.other.iter();
        for (name, value) in shared.chain(&header.own_attributes.other) {
            match value {
                AttributeValue::Text(value) => {
                    attributes.set(&name.to_string(), value.to_string());
                }
                AttributeValue::I32(value) if *name == text("frame") => {
                    attributes.frame = u32::try_from(*value).unwrap_or(0);
                }
                _ => {}
            }
        }
    }
    Ok(attributes)
}

fn undecoded(path: &Path, error: &exr::error::Error) -> RenderError {
    RenderError::Format {
        file: path.to_owned(),
        message: error.to_string(),
    }
}
