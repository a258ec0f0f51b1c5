//! Warnings for legal but suspicious values of a look, each with the number that it is based on.

use std::f64::consts::PI;

use super::{super::words::shown, Look};

/// Times closer than this are the same, seconds.
const ROUNDING: f64 = 1e-6;

impl Look {
    /// Returns the warnings of the look, one sentence each, beginning with the key.
    pub fn lints(&self) -> Vec<String> {
        let lens = self.lint_lens().into_iter();
        lens.chain(self.lint_library()).collect()
    }

    /// Returns warnings about an animated camera file if the frames from `frames[0]` to `frames[1]`
    /// are rendered: the file has another frame rate than the shot, or its keys are all outside of
    /// these frames, so that the camera is static (a shot numbered from 1001, for example).
    pub fn lint_camera(&self, frames: [u32; 2], frames_per_second: f64) -> Vec<String> {
        let rate = (self.camera_file()).and_then(|file| {
            file.moves()?;
            file.rate()?.lint("camera.file", frames_per_second)
        });
        let still = self.lint_still_camera(frames, frames_per_second);
        rate.into_iter().chain(still).collect()
    }

    fn lint_still_camera(&self, [first, last]: [u32; 2], frames_per_second: f64) -> Option<String> {
        let file = self.camera_file()?;
        let [begins, ends] = file.moves()?;
        let [from, to] =
            [first, last].map(|k| self.camera_seconds(f64::from(k), frames_per_second));
        if begins <= to + ROUNDING && ends >= from - ROUNDING {
            return None;
        }
        let rate = file
            .rate()
            .map_or(frames_per_second, |it| it.codes_per_second);
        let [begin, end, from, to] =
            [begins, ends, from, to].map(|seconds| shown((seconds * rate * 1e3).round() / 1e3));
        let start = self.spec.camera.start.map_or(String::new(), shown);
        let remedy = match start == begin {
            true => String::new(),
            false => format!("; camera.start = {begin} makes the first of its frames frame 1"),
        };
        Some(format!(
            "camera.start: the camera moves over frames {begin} to {end} of its file, and stands \
             still over frames {from} to {to}, which are drawn{remedy}"
        ))
    }

    /// N samples show a point as N ghosts, spread over its disc: each has π c² / 4 N pixels of a
    /// disc c pixels wide.
    fn lint_lens(&self) -> Option<String> {
        let blur = self.widest_blur_px()?;
        let samples = self.spec.image.samples;
        let wanted = (PI / 4.0 * blur * blur).ceil();
        (f64::from(samples) < wanted).then(|| {
            format!(
                "image.samples: the lens draws a point at infinity, or at half of the focus \
                 distance, as a disc {blur:.1} pixels wide, and {samples} samples show as many \
                 ghosts of it; from {wanted} samples on they are closer than a pixel"
            )
        })
    }
}
