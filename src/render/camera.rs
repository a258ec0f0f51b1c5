//! The look's camera at an instant.

use glam::DVec3;

use super::uniform;
use crate::domain::eye::Eye;
use crate::scene::look::{CameraSpec, Look};

/// A pose in world space, metres, and a focal length in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pose {
    pub(super) position: DVec3,
    pub(super) target: DVec3,
    pub(super) focal_length_mm: f64,
}

/// The camera at a frame number, which may lie between two.
///
/// Keyframes are joined by cubic Hermite curves whose slopes are those of Catmull and Rom inside and zero at
/// both ends, so that a move starts and stops softly; before the first and after the last it stands still.
pub(super) fn pose(camera: &CameraSpec, frame: f64) -> Pose {
    let keys: Vec<(f64, Pose)> = if camera.keyframes.is_empty() {
        let position = camera.position.unwrap_or_default().into();
        let target = camera.target.unwrap_or_default().into();
        let focal_length_mm = camera.focal_length_mm;
        let pose = Pose {
            position,
            target,
            focal_length_mm,
        };
        vec![(0.0, pose)]
    } else {
        camera
            .keyframes
            .iter()
            .map(|key| {
                let pose = Pose {
                    position: key.position.into(),
                    target: key.target.into(),
                    focal_length_mm: key.focal_length_mm.unwrap_or(camera.focal_length_mm),
                };
                (key.frame, pose)
            })
            .collect()
    };
    let last = keys.len() - 1;
    if frame <= keys[0].0 {
        return keys[0].1;
    }
    if frame >= keys[last].0 {
        return keys[last].1;
    }
    let i = keys.partition_point(|key| key.0 <= frame) - 1;
    let span = keys[i + 1].0 - keys[i].0;
    let t = (frame - keys[i].0) / span;
    let blend = |value: &dyn Fn(&Pose) -> f64| {
        let at = |k: usize| value(&keys[k].1);
        let slope = |k: usize| {
            if k == 0 || k == last {
                0.0
            } else {
                (at(k + 1) - at(k - 1)) / (keys[k + 1].0 - keys[k - 1].0)
            }
        };
        let (t2, t3) = (t * t, t * t * t);
        (2.0 * t3 - 3.0 * t2 + 1.0) * at(i)
            + (t3 - 2.0 * t2 + t) * span * slope(i)
            + (3.0 * t2 - 2.0 * t3) * at(i + 1)
            + (t3 - t2) * span * slope(i + 1)
    };
    let vector = |pick: fn(&Pose) -> DVec3| {
        DVec3::from_array([0, 1, 2].map(|axis| blend(&|p| pick(p)[axis])))
    };
    Pose {
        position: vector(|p| p.position),
        target: vector(|p| p.target),
        focal_length_mm: blend(&|p| p.focal_length_mm),
    }
}

/// Focal length in pixels of the picture.
pub(super) fn focal_px(look: &Look, focal_length_mm: f64) -> f64 {
    let spec = look.spec();
    focal_length_mm / spec.camera.film_back_mm[0] * f64::from(spec.image.width)
}

/// Longest focal length of the shot, pixels.
pub(super) fn longest_focal_px(look: &Look) -> f64 {
    let camera = &look.spec().camera;
    let longest = camera
        .keyframes
        .iter()
        .filter_map(|key| key.focal_length_mm)
        .fold(camera.focal_length_mm, f64::max);
    focal_px(look, longest)
}

/// Where in the pixel and in the shutter a sample lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    /// Pixels from the pixel's centre.
    pub(super) jitter: [f64; 2],
    /// Frames from the frame's instant.
    pub(super) instant: f64,
    /// Part of the pixel's mean.
    pub(super) weight: f64,
}

/// The samples of one frame: Halton points over the pixel, evenly spaced instants over the shutter.
pub(super) fn samples(count: u32, shutter: f64) -> Vec<Sample> {
    let halton = |base: u32, index: u32| {
        let (mut value, mut scale, mut rest) = (0.0, 1.0, index);
        while rest > 0 {
            scale /= f64::from(base);
            value += scale * f64::from(rest % base);
            rest /= base;
        }
        value
    };
    let points: Vec<[f64; 2]> = (1..=count).map(|i| [halton(2, i), halton(3, i)]).collect();
    // Few points of the sequence lean to one side, which would shift the picture.
    let mean =
        [0, 1].map(|axis| points.iter().map(|point| point[axis]).sum::<f64>() / f64::from(count));
    points
        .iter()
        .zip(0u32..)
        .map(|(point, i)| Sample {
            jitter: [point[0] - mean[0], point[1] - mean[1]],
            instant: ((f64::from(i) + 0.5) / f64::from(count) - 0.5) * shutter,
            weight: 1.0 / f64::from(count),
        })
        .collect()
}

/// What of the camera's uniform does not come from the pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setting {
    pub(super) origin: DVec3,
    pub(super) size: [u32; 2],
    pub(super) margin: [u32; 2],
    pub(super) particle_count: u32,
    pub(super) radius: f64,
    pub(super) near: f64,
    pub(super) frames_per_second: f64,
}

/// The camera of a look at a frame number, which may lie between two, in metres from `origin` in the world.
pub fn eye(look: &Look, origin: DVec3, frame: f64) -> Eye {
    let spec = look.spec();
    let pose = pose(&spec.camera, frame);
    let forward = (pose.target - pose.position).normalize();
    let right = forward.cross(DVec3::from(spec.camera.up)).normalize();
    Eye {
        position: pose.position - origin,
        right,
        up: right.cross(forward),
        forward,
        focal: focal_px(look, pose.focal_length_mm),
        size: [spec.image.width, spec.image.height],
    }
}

/// The uniform for one sample of a frame.
pub(super) fn camera(
    look: &Look,
    setting: &Setting,
    frame: f64,
    sample: Sample,
    index: u32,
) -> uniform::Camera {
    let instant = frame + sample.instant;
    let eye = eye(look, setting.origin, instant);
    let picture = eye.size;
    let centre = [0, 1].map(|axis| {
        let middle = f64::from(setting.margin[axis]) + 0.5 * f64::from(picture[axis]);
        (middle - sample.jitter[axis]) as f32
    });
    uniform::Camera {
        position: eye.position.as_vec3().to_array(),
        seconds: (sample.instant / setting.frames_per_second) as f32,
        right: eye.right.as_vec3().to_array(),
        focal: eye.focal as f32,
        up: eye.up.as_vec3().to_array(),
        particle_count: setting.particle_count,
        forward: eye.forward.as_vec3().to_array(),
        radius: setting.radius as f32,
        centre,
        size: setting.size,
        margin: setting.margin,
        picture,
        weight: sample.weight as f32,
        sample_index: index,
        clock: (instant / setting.frames_per_second) as f32,
        frame_seconds: (1.0 / setting.frames_per_second) as f32,
        near: setting.near as f32,
        ..uniform::Camera::default()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use std::path::Path;

    use super::*;

    fn look(camera: &str) -> Look {
        let text = format!(
            "{camera}\n[image]\nwidth = 160\nheight = 90\n[sky]\nmodel = \"hosek_wilkie\"\n"
        );
        Look::parse(&text, Path::new("look.toml")).unwrap()
    }

    #[test]
    fn keyframes_are_met_and_joined_smoothly() {
        let key = |frame: u32, x: f64| {
            format!(
                "[[camera.keyframe]]\nframe = {frame}\nposition = [{x:.1}, 2.0, 0.0]\ntarget = [99.0, 0.0, 0.0]\n"
            )
        };
        let text = format!(
            "[camera]\nfocal_length_mm = 36.0\n{}{}{}",
            key(1, 0.0),
            key(11, 1.0),
            key(31, 5.0)
        );
        let spec = look(&text).spec().camera.clone();
        let x = |frame: f64| pose(&spec, frame).position.x;
        assert_eq!(
            [x(-5.0), x(1.0), x(11.0), x(31.0), x(90.0)],
            [0.0, 0.0, 1.0, 5.0, 5.0]
        );
        // The slope is continuous across the middle key, and zero at the ends.
        let slope = |frame: f64| (x(frame + 1e-5) - x(frame - 1e-5)) / 2e-5;
        assert!((slope(11.0 - 1e-4) - slope(11.0 + 1e-4)).abs() < 1e-3);
        assert!(slope(1.0 + 1e-4).abs() < 1e-3 && slope(31.0 - 1e-4).abs() < 1e-3);
        // Halfway along a film back of 36 mm at 36 mm, 160 pixels: the focal length is the width.
        assert!((focal_px(&look(&text), 36.0) - 160.0).abs() < 1e-12);
    }

    #[test]
    fn clocks_count_seconds_from_frame_zero() {
        let text = "[camera]\nfocal_length_mm = 36.0\nposition = [0.0, 1.0, 0.0]\ntarget = [1.0, 1.0, 0.0]\n";
        let setting = Setting {
            origin: DVec3::ZERO,
            size: [192, 128],
            margin: [16, 19],
            particle_count: 0,
            radius: 0.1,
            near: 0.01,
            frames_per_second: 24.0,
        };
        let sample = Sample {
            jitter: [0.0; 2],
            instant: 0.25,
            weight: 1.0,
        };
        let found = camera(&look(text), &setting, 48.0, sample, 0);
        // Frame 48 at 24 a second, a quarter of a frame later.
        assert_eq!(found.clock, (48.25f64 / 24.0) as f32);
        assert_eq!(found.seconds, (0.25f64 / 24.0) as f32);
        assert_eq!(found.frame_seconds, (1.0f64 / 24.0) as f32);
        assert_eq!(found.centre, [16.0 + 80.0, 19.0 + 45.0]);
    }

    #[test]
    fn samples_are_centred_on_pixel_and_shutter() {
        for count in [1, 2, 3, 4, 16] {
            let samples = samples(count, 0.5);
            let sum = |value: fn(&Sample) -> f64| samples.iter().map(value).sum::<f64>();
            assert!(sum(|s| s.jitter[0]).abs() < 1e-12);
            assert!(sum(|s| s.jitter[1]).abs() < 1e-12);
            assert!(sum(|s| s.instant).abs() < 1e-12);
            assert!((sum(|s| s.weight) - 1.0).abs() < 1e-12);
            assert!(samples.iter().all(|s| s.instant.abs() < 0.25));
        }
        assert!(samples(4, 0.0).iter().all(|s| s.instant == 0.0));
    }
}
