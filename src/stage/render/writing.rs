//! Writes a frame's pictures while the next frame is drawn.

use std::{
    sync::Arc,
    thread::{JoinHandle, spawn},
    time::Instant,
};

use super::{
    FolderError, RenderEvent, RenderJobError, RenderOutcome, RenderRequest, folder::Folder,
    pictures::write,
};
use swell_domain::output::Lock;
use swell_render::{Attributes, Image};
use swell_scene::look::FormatSpec;

/// A frame that is drawn but not yet written.
pub(super) struct DrawnFrame {
    pub(super) frame: u32,
    /// When work on it began.
    pub(super) begin: Instant,
    pub(super) image: Image,
    /// Name and format of each of its pictures.
    pub(super) pictures: Vec<(String, FormatSpec)>,
    pub(super) attributes: Attributes,
    /// Keeps other processes from rendering the frame.
    pub(super) claim: Lock,
}

/// A frame whose pictures are being written.
pub(super) struct Writing {
    frame: u32,
    /// Returns the seconds since work on the frame began, and the bytes written.
    thread: JoinHandle<Result<(f64, u64), RenderJobError>>,
}

impl Writing {
    pub(super) fn begin(drawn: DrawnFrame, folder: &Arc<Folder>, request: &RenderRequest) -> Self {
        let (folder, look) = (folder.clone(), request.look.clone());
        let frame = drawn.frame;
        let thread = spawn(move || {
            let mut bytes = 0;
            for (name, format) in &drawn.pictures {
                let mut draft = folder.draft(name);
                write(
                    draft.path(),
                    *format,
                    &drawn.image,
                    &drawn.attributes,
                    &look,
                )?;
                bytes += draft.publish().map_err(FolderError::File)?;
            }
            drop(drawn.claim);
            Ok((drawn.begin.elapsed().as_secs_f64(), bytes))
        });
        Self { frame, thread }
    }

    /// Whether the pictures are on disk or have failed.
    pub(super) fn is_finished(&self) -> bool {
        self.thread.is_finished()
    }

    /// Waits until the pictures are on disk. Returns the frame, the seconds it took in total, and
    /// the bytes.
    ///
    /// # Errors
    /// [`RenderJobError::Render`] or [`RenderJobError::Folder`] if a picture cannot be written.
    fn end(self) -> Result<(u32, f64, u64), RenderJobError> {
        let written = self.thread.join();
        let (seconds, bytes) = written.unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
        Ok((self.frame, seconds, bytes))
    }
}

/// Waits for the pictures that are being written, and reports them.
pub(super) fn end_writing(
    writing: &mut Option<Writing>,
    outcome: &mut RenderOutcome,
    tell: &mut dyn FnMut(RenderEvent),
) -> Result<(), RenderJobError> {
    if let Some(writing) = writing.take() {
        let (frame, seconds, bytes) = writing.end()?;
        outcome.rendered += 1;
        tell(RenderEvent::Frame {
            frame,
            seconds,
            skipped: false,
            bytes,
        });
    }
    Ok(())
}
