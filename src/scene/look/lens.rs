//! The lens of a look: its own, or that of the camera file.

use super::{Look, camera_file::CameraFile};

impl Look {
    /// Returns the f-number and the focus distance, metres: those of the look's own lens without
    /// keyframes, or else those of the camera file at a time of the file. `None` for a pinhole.
    pub fn lens(&self, seconds: f64) -> Option<[f64; 2]> {
        match &self.spec.camera.lens {
            Some(own) => Some([own.f_stop, own.focus_distance_m]),
            None => self.camera_file()?.lens(seconds),
        }
    }

    /// Returns the longest focal length of the shot, mm.
    pub fn longest_focal_length_mm(&self) -> f64 {
        let camera = &self.spec.camera;
        let own = (self.camera_file()).map_or(camera.focal_length_mm, |file| {
            file.longest_focal_length_mm(&self.framing_of_file(), self.film_mm()[1])
        });
        let keys = camera.keyframes.iter();
        keys.filter_map(|key| key.focal_length_mm)
            .fold(own, f64::max)
    }

    /// Returns the diameter of the blur disc of a point at infinity, pixels, at its largest in the
    /// shot; a point at half the focus distance has the same. `None` for a pinhole.
    pub fn widest_blur_px(&self) -> Option<f64> {
        let camera = &self.spec.camera;
        let times = self.camera_file().into_iter().flat_map(CameraFile::times);
        let lenses = times.chain([0.0]).map(|seconds| self.lens(seconds));
        // Uses the widest aperture and the nearest focus, even if they occur at different times.
        let [f_stop, own] = lenses
            .flatten()
            .reduce(|[f, d], [f_stop, focus]| [f.min(f_stop), d.min(focus)])?;
        let focus = (camera.keyframes.iter())
            .filter_map(|key| key.focus_distance_m)
            .fold(own, f64::min);
        let focal = self.longest_focal_length_mm();
        let pixels = self.focal_px(focal);
        Some(pixels * 1e-3 * focal / f_stop / focus)
    }
}
