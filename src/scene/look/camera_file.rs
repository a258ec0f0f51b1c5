//! A perspective camera that moves over time, as a file describes it.

use std::{fmt, sync::Arc};

use glam::{DMat3, DMat4, DVec3};

use super::Framing;
use crate::rate::Rate;

/// Pose of a camera in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// Position, metres.
    pub position: DVec3,
    /// Unit vector of the viewing direction.
    pub forward: DVec3,
    /// Unit vector towards the top of the picture, perpendicular to `forward`.
    pub up: DVec3,
}

/// A camera with its animation. Times are in seconds of the file.
pub trait CameraTrack: fmt::Debug + Send + Sync {
    /// Returns the transform from the camera to the world, which is in metres with y up; the camera
    /// looks along its own −z.
    fn at(&self, seconds: f64) -> DMat4;

    /// Returns the times of all keys, unordered.
    fn times(&self) -> Vec<f64>;

    /// Returns the key times of values that change, unordered.
    fn times_moved(&self) -> Vec<f64>;

    /// Returns width and height of the film in focal lengths: twice the tangents of half the fields
    /// of view. `shape` is the width of the image over its height, for a camera that specifies only
    /// one of the two.
    fn film(&self, seconds: f64, shape: f64) -> [f64; 2];

    /// Returns width over height of the film, if the file specifies it.
    fn aspect_ratio(&self) -> Option<f64>;

    /// Returns the offset of the film's centre from the optical axis, to the right and upward in
    /// the picture, in heights of the film.
    fn shift(&self, _seconds: f64) -> [f64; 2] {
        [0.0; 2]
    }

    /// Returns the f-number and the focus distance, metres; `None` for a pinhole.
    fn lens(&self, _seconds: f64) -> Option<[f64; 2]> {
        None
    }

    /// Returns the file's time codes per second; `None` for a format in seconds.
    fn rate(&self) -> Option<Rate> {
        None
    }
}

/// A perspective camera read from a file.
#[derive(Clone, Debug)]
pub struct CameraFile {
    track: Arc<dyn CameraTrack>,
    hash: blake3::Hash,
}

impl CameraFile {
    /// Creates the camera of a file. `hash` is the BLAKE3 hash of all bytes that determine it.
    pub fn new(track: impl CameraTrack + 'static, hash: blake3::Hash) -> Self {
        Self {
            track: Arc::new(track),
            hash,
        }
    }

    /// Returns the BLAKE3 hash of the file and of the buffers that animate its camera.
    pub(super) fn hash(&self) -> blake3::Hash {
        self.hash
    }

    /// Returns width over height, if the file specifies it.
    pub fn aspect_ratio(&self) -> Option<f64> {
        self.track.aspect_ratio()
    }

    /// Returns the focal length for a picture `picture_height_mm` high, mm. `framing` decides which
    /// part of the film the picture shows.
    pub fn focal_length_mm(&self, framing: &Framing, picture_height_mm: f64, seconds: f64) -> f64 {
        picture_height_mm / framing.shown(self.film(framing, seconds))[1]
    }

    /// Returns the offset of the picture's centre from the optical axis, to the right and upward,
    /// in heights of the picture.
    pub fn shift(&self, framing: &Framing, seconds: f64) -> [f64; 2] {
        let film = self.film(framing, seconds);
        let heights = film[1] / framing.shown(film)[1];
        self.track.shift(seconds).map(|of_film| of_film * heights)
    }

    /// Returns width and height of the film in focal lengths. Without an aspect ratio in the file,
    /// the film has that of the image.
    fn film(&self, framing: &Framing, seconds: f64) -> [f64; 2] {
        self.track.film(seconds, framing.shape())
    }

    /// Returns the f-number and the focus distance, metres; `None` for a pinhole.
    pub fn lens(&self, seconds: f64) -> Option<[f64; 2]> {
        self.track.lens(seconds)
    }

    /// Returns the longest focal length of the shot, mm.
    pub fn longest_focal_length_mm(&self, framing: &Framing, picture_height_mm: f64) -> f64 {
        let at = |seconds| self.focal_length_mm(framing, picture_height_mm, seconds);
        self.times().into_iter().map(at).fold(at(0.0), f64::max)
    }

    /// Returns the file's time codes per second; `None` for a format in seconds.
    pub(super) fn rate(&self) -> Option<Rate> {
        self.track.rate()
    }

    /// Returns the first and last key of values that change, seconds; `None` if nothing moves.
    pub fn moves(&self) -> Option<[f64; 2]> {
        let ends = self.track.times_moved().into_iter().map(|it| [it; 2]);
        ends.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])
    }

    /// Returns the times of all keys, seconds.
    pub fn times(&self) -> Vec<f64> {
        self.track.times()
    }

    /// Returns the camera's pose at a time, seconds.
    pub fn at(&self, seconds: f64) -> Stand {
        let world = self.track.at(seconds);
        let axes = DMat3::from_mat4(world);
        let forward = (-axes.z_axis).normalize();
        let up = axes.y_axis;
        Stand {
            position: world.w_axis.truncate(),
            forward,
            up: (up - forward * up.dot(forward)).normalize(),
        }
    }
}
