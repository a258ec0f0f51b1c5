//! What of a look is allowed, and hardly what was meant: each found by a number, and said with it.

use std::f64::consts::PI;

use super::{super::words::shown, Look};

/// Seconds by which times that are meant to be one may differ.
const ROUNDING: f64 = 1e-6;

impl Look {
    /// What of the look is allowed and hardly meant, a sentence each, with its key first and the number that it was judged by.
    pub fn lints(&self) -> Vec<String> {
        let lens = self.lint_lens().into_iter();
        lens.chain(self.lint_library()).collect()
    }

    /// What of a camera from a file, which moves, is hardly meant where these frames are drawn, first and last: that it counts
    /// other frames than the shot does, or stands still over all of them, as its keys lie elsewhere: those of a shot that is
    /// counted from 1001.
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
            "camera.start: the camera moves over frames {begin} to {end} of its file, and stands still over frames {from} to {to}, \
             which are drawn{remedy}"
        ))
    }

    /// N samples show a point as N ghosts, evenly over its disc: of c pixels across, each has π c² / 4 N pixels of it.
    fn lint_lens(&self) -> Option<String> {
        let blur = self.widest_blur_px()?;
        let samples = self.spec.image.samples;
        let wanted = (PI / 4.0 * blur * blur).ceil();
        (f64::from(samples) < wanted).then(|| {
            format!(
                "image.samples: the lens draws a point at infinity, or at half of the focus distance, as a disc {blur:.1} pixels \
                 wide, and {samples} samples are as many ghosts of it; they are closer than a pixel from {wanted} on"
            )
        })
    }
}
