//! Predicts a render without a device and without writing anything.

use std::fs;

use super::{
    Asked, RenderJobError, RenderRequest,
    folder::Folder,
    pictures::{is_current, pictures, whole_attributes},
    wanted,
};

/// Prediction of a render.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct ExpectedRender {
    /// Frames of this process's share.
    pub frames: Vec<u32>,
    /// Those of them whose pictures exist.
    pub standing: Vec<u32>,
    /// Bytes of the pictures of one frame: the mean over existing frames; `None` if none exist.
    pub frame_bytes: Option<u64>,
}

impl ExpectedRender {
    /// Predicted bytes of the pictures to be made; `None` if unknown.
    pub fn bytes(&self) -> Option<u64> {
        let made = self.frames.len() - self.standing.len();
        match made {
            0 => Some(0),
            made => Some(self.frame_bytes? * made as u64),
        }
    }
}

/// Examines existing pictures as a render would; renders nothing.
///
/// # Errors
/// Those of [`render`](super::render) that need no device.
pub fn expected(request: &RenderRequest) -> Result<ExpectedRender, RenderJobError> {
    let Asked {
        cache,
        streams,
        frames,
        numbering,
        ..
    } = Asked::open(request)?;
    let of_frame = |frame| cache.frame_hash(frame).ok().map(str::to_owned);
    Folder::look(
        &request.directory,
        &wanted(request, &cache, (&frames, numbering), &of_frame)?,
    )?;
    let mut found = ExpectedRender::default();
    let mut bytes = 0;
    for &frame in &frames {
        let attributes = whole_attributes(&cache, request, &streams, frame)?;
        let mut stands = true;
        let mut size = 0;
        for (name, format) in pictures(&cache, &request.look, frame, numbering) {
            let file = request.directory.join(name);
            stands &= is_current(&file, format, &attributes);
            size += fs::metadata(&file).map_or(0, |meta| meta.len());
        }
        if stands {
            found.standing.push(frame);
            bytes += size;
        }
    }
    found.frames = frames;
    found.frame_bytes = bytes.checked_div(found.standing.len() as u64);
    if request.overwrite {
        found.standing.clear();
    }
    Ok(found)
}
