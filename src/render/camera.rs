//! The look's camera at an instant.

use glam::DVec3;

use super::{frame::Extent, samples::Sample, uniform};
use swell_domain::eye::Eye;
use swell_scene::look::{CameraSpec, Look};

/// Position and orientation of the camera in world space, with its focal length and lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pose {
    /// World position, metres.
    pub(super) position: DVec3,
    /// Unit vector to the picture's right; `up` points to its top and `forward` into it.
    pub(super) right: DVec3,
    pub(super) up: DVec3,
    pub(super) forward: DVec3,
    pub(super) focal_length_mm: f64,
    /// Offset of the picture's centre from the optical axis, to the right and to the top, in
    /// picture heights.
    pub(super) shift: [f64; 2],
    /// `None` for a pinhole camera.
    pub(super) lens: Option<Lens>,
}

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lens {
    /// Radius of the aperture, metres.
    pub(super) radius: f64,
    /// Distance to the plane in focus along the optical axis, metres.
    pub(super) focus: f64,
}

/// Quantities that keyframes set.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Keyed {
    position: DVec3,
    target: DVec3,
    focal_length_mm: f64,
    /// Focus distance, metres; 0 for a pinhole camera.
    focus: f64,
}

/// Returns the camera's pose at a frame number, which may be fractional.
pub(super) fn pose(look: &Look, frame: f64, frames_per_second: f64) -> Pose {
    let camera = &look.spec().camera;
    let seconds = look.camera_seconds(frame, frames_per_second);
    let lens = |focal_length_mm: f64, of_key: Option<f64>| {
        let [f_stop, own] = look.lens(seconds)?;
        let radius = 0.5e-3 * focal_length_mm / f_stop;
        let focus = of_key.unwrap_or(own);
        Some(Lens { radius, focus })
    };
    if let Some(file) = look.camera_file() {
        let stand = file.at(seconds);
        let framing = look.framing_of_file();
        let focal_length_mm = file.focal_length_mm(&framing, look.film_mm()[1], seconds);
        let [right, up] = upright(stand.forward, stand.up);
        return Pose {
            position: stand.position,
            right,
            up,
            forward: stand.forward,
            focal_length_mm,
            shift: file.shift(&framing, seconds),
            lens: lens(focal_length_mm, None),
        };
    }
    let keyed = keyed(camera, frame);
    let forward = (keyed.target - keyed.position).normalize();
    let [right, up] = upright(forward, camera.up.into());
    Pose {
        position: keyed.position,
        right,
        up,
        forward,
        focal_length_mm: keyed.focal_length_mm,
        shift: [0.0; 2],
        lens: lens(keyed.focal_length_mm, Some(keyed.focus)),
    }
}

/// Right and up vectors of a picture that looks along `forward` with `up` upright.
fn upright(forward: DVec3, up: DVec3) -> [DVec3; 2] {
    let right = forward.cross(up).normalize();
    [right, right.cross(forward)]
}

/// Focus distance, metres; 0 for a pinhole camera.
fn focus(camera: &CameraSpec, of_key: Option<f64>) -> f64 {
    let own = camera.lens.as_ref().map(|lens| lens.focus_distance_m);
    own.map_or(0.0, |own| of_key.unwrap_or(own))
}

/// Interpolates the keyframes at a frame number.
///
/// Cubic Hermite curves join the keyframes, with Catmull-Rom slopes at inner keys and zero slope at
/// both ends, so that moves start and stop softly. Before the first key and after the last one the
/// camera rests.
fn keyed(camera: &CameraSpec, frame: f64) -> Keyed {
    let keys: Vec<(f64, Keyed)> = if camera.keyframes.is_empty() {
        let pose = Keyed {
            position: camera.position.unwrap_or_default().into(),
            target: camera.target.unwrap_or_default().into(),
            focal_length_mm: camera.focal_length_mm,
            focus: focus(camera, None),
        };
        vec![(0.0, pose)]
    } else {
        camera
            .keyframes
            .iter()
            .map(|key| {
                let pose = Keyed {
                    position: key.position.into(),
                    target: key.target.into(),
                    focal_length_mm: key.focal_length_mm.unwrap_or(camera.focal_length_mm),
                    focus: focus(camera, key.focus_distance_m),
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
    let blend = |value: &dyn Fn(&Keyed) -> f64| {
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
    let vector = |pick: fn(&Keyed) -> DVec3| {
        DVec3::from_array([0, 1, 2].map(|axis| blend(&|p| pick(p)[axis])))
    };
    // Keeps an overshooting curve from moving the focus plane behind the lens.
    let nearest = keys[i].1.focus.min(keys[i + 1].1.focus);
    Keyed {
        position: vector(|p| p.position),
        target: vector(|p| p.target),
        focal_length_mm: blend(&|p| p.focal_length_mm),
        focus: blend(&|p| p.focus).max(0.5 * nearest),
    }
}

/// Longest focal length of the shot, pixels.
pub(super) fn longest_focal_px(look: &Look) -> f64 {
    look.focal_px(look.longest_focal_length_mm())
}

/// Inputs of the camera's uniform that do not come from the pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setting {
    pub(super) origin: DVec3,
    pub(super) extent: Extent,
    pub(super) particle_count: u32,
    pub(super) radius: f64,
    pub(super) near: f64,
    pub(super) frames_per_second: f64,
}

/// Returns the camera of a look at a frame number, which may be fractional, as a pinhole; its
/// position is in metres from `origin`.
pub fn eye(look: &Look, origin: DVec3, frame: f64, frames_per_second: f64) -> Eye {
    of_pose(look, &pose(look, frame, frames_per_second), origin)
}

/// Returns the f-number and the focus distance in metres of a look at a frame number; `None` for a
/// pinhole camera.
pub fn lens(look: &Look, frame: f64, frames_per_second: f64) -> Option<[f64; 2]> {
    let [f_stop, _] = look.lens(look.camera_seconds(frame, frames_per_second))?;
    let lens = pose(look, frame, frames_per_second).lens?;
    Some([f_stop, lens.focus])
}

fn of_pose(look: &Look, pose: &Pose, origin: DVec3) -> Eye {
    let image = &look.spec().image;
    let [right, up] = pose.shift.map(|part| part * f64::from(image.height));
    Eye {
        position: pose.position - origin,
        right: pose.right,
        up: pose.up,
        forward: pose.forward,
        focal: look.focal_px(pose.focal_length_mm),
        // Where the picture's centre is right of the axis, the axis is left of the centre.
        axis: [-right, up],
        size: [image.width, image.height],
    }
}

/// Moves an eye to a point of its lens and returns the offset in pixels, to the right and down, by
/// which the picture's centre must follow so that points in focus keep their position (Haeberli and
/// Akeley 1990, section 3.3).
///
/// A point at depth d then covers a disc of diameter A f |1/d_f − 1/d| on the film, where A is the
/// aperture's diameter. A thin lens would have f / (d_f − f) in place of f / d_f: its film moves
/// back to v = f d_f / (d_f − f) when it is focused, which narrows the field of view. Here the film
/// stays at f, so that a focus pull leaves the framing unchanged.
fn through_lens(eye: &mut Eye, lens: Option<Lens>, aperture: [f64; 2]) -> [f64; 2] {
    let Some(lens) = lens else {
        return [0.0; 2];
    };
    let [right, up] = aperture.map(|part| part * lens.radius);
    eye.position += eye.right * right + eye.up * up;
    [eye.focal * right / lens.focus, -eye.focal * up / lens.focus]
}

/// Builds the camera's uniform for one sample of a frame.
pub(super) fn camera(
    look: &Look,
    setting: &Setting,
    frame: f64,
    sample: Sample,
    index: u32,
) -> uniform::Camera {
    let instant = frame + sample.instant;
    let pose = pose(look, instant, setting.frames_per_second);
    let mut eye = of_pose(look, &pose, setting.origin);
    let shift = through_lens(&mut eye, pose.lens, sample.aperture);
    let extent = &setting.extent;
    let [before, image] = extent.image;
    let centre = [0, 1].map(|axis| {
        let middle = f64::from(before[axis]) + 0.5 * f64::from(image[axis]);
        (middle + eye.axis[axis] - sample.jitter[axis] + shift[axis]) as f32
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
        size: extent.size,
        margin: extent.margin,
        picture: extent.picture,
        weight: sample.weight as f32,
        sample_index: index,
        clock: (instant / setting.frames_per_second) as f32,
        frame_seconds: (1.0 / setting.frames_per_second) as f32,
        corner: extent.corner.map(|side| side as f32),
        near: setting.near as f32,
        ..uniform::Camera::default()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use std::path::Path;

    use super::*;
    use swell_files::parse_look;

    fn look(camera: &str) -> Look {
        let text = format!(
            "{camera}\n[image]\nwidth = 160\nheight = 90\n[sky]\nmodel = \"hosek_wilkie\"\n"
        );
        parse_look(&text, Path::new("look.toml")).unwrap()
    }

    /// A film of 36 × 24 mm in a camera file with a focal length of 35 mm, shifted 1.8 mm to the
    /// right and 1.2 mm down, under an image of 160 × 90: a millimetre on that film has as many
    /// pixels as the fit says, along both axes.
    #[test]
    fn the_film_of_a_file_is_fitted_too() {
        let folder = tempfile::tempdir().unwrap();
        let plate = include_str!("../files/look/usd_camera/plate.usda")
            .replace("1025: 50", "1025: 35")
            .replace(
                "verticalAperture = 20.25",
                "verticalAperture = 24\n    float horizontalApertureOffset = 1.8\n    float \
                 verticalApertureOffset = -1.2",
            );
        std::fs::write(folder.path().join("plate.usda"), plate).unwrap();
        let look = |fit: &str, film: &str| {
            let text = format!(
                "[camera]\nfile = \"plate.usda\"\n{fit}{film}[image]\nwidth = 160\nheight = 90\n\
                 [sky]\nmodel = \"hosek_wilkie\"\n"
            );
            parse_look(&text, &folder.path().join("look.toml"))
        };
        let (by_width, by_height) = (160.0 / 36.0, 90.0 / 24.0);
        // The look's own film sets only the aperture of a lens; no value of it moves anything.
        for film in ["", "film_back_mm = [36.0, 24.0]\n"] {
            for (fit, pixels) in [
                ("width", by_width),
                ("height", by_height),
                ("fill", by_width),
                ("overscan", by_height),
            ] {
                let look = look(&format!("fit = \"{fit}\"\n"), film).unwrap();
                let found = eye(&look, DVec3::ZERO, 1.0, 24.0);
                let [across, down] = found.axis;
                // The file holds 32-bit lengths: 2⁻²⁴ of 155 pixels is 9e-6.
                for (found, mm) in [(found.focal, 35.0), (across, -1.8), (down, -1.2)] {
                    assert!((found - mm * pixels).abs() < 1e-5, "{fit}: {found}");
                }
                assert!((longest_focal_px(&look) - 35.0 * pixels).abs() < 1e-5);
            }
        }
        let refused = look("", "").unwrap_err().to_string();
        assert!(refused.contains("camera.fit"), "{refused}");
    }

    /// A shot whose frames are numbered from 1001, compared with the values of usd-core 26.11 at
    /// time code 1001 + (frame − 1) · 24 / rate: position, direction, focal length.
    #[test]
    fn a_camera_s_file_begins_at_its_own_frame() {
        let folder = tempfile::tempdir().unwrap();
        let plate = include_str!("../files/look/usd_camera/plate.usda");
        std::fs::write(folder.path().join("plate.usda"), plate).unwrap();
        let look = |start: &str| {
            let text = format!(
                "[camera]\nfile = \"plate.usda\"\n{start}\n[image]\nwidth = 160\nheight = 90\n\
                 [sky]\nmodel = \"hosek_wilkie\"\n"
            );
            parse_look(&text, &folder.path().join("look.toml")).unwrap()
        };
        let begun = look("start = 1001");
        let rows = [
            (24.0, 1.0, [0.0, 3.0, 8.0], [0.0, 0.0, -1.0], 35.0),
            (
                24.0,
                3.5,
                [1.25, 3.0, 7.75],
                [-0.054514502, 0.0, -0.998512979],
                36.5625,
            ),
            (
                24.0,
                61.0,
                [-2.0, 3.0, 5.6],
                [-0.5, 0.0, -0.866025404],
                50.0,
            ),
            (
                60.0,
                3.5,
                [0.5, 3.0, 7.9],
                [-0.021814885, 0.0, -0.999762027],
                35.625,
            ),
            (
                60.0,
                20.0,
                [3.8, 3.0, 7.24],
                [-0.165047606, 0.0, -0.986285602],
                39.75,
            ),
        ];
        for (rate, frame, place, forward, focal) in rows {
            let pose = pose(&begun, frame, rate);
            // OpenUSD stores angles and lengths as 32-bit floats.
            assert!(
                (pose.position - DVec3::from(place)).length() < 1e-6,
                "{frame}"
            );
            assert!(
                (pose.forward - DVec3::from(forward)).length() < 1e-6,
                "{frame}"
            );
            assert!((pose.focal_length_mm - focal).abs() < 1e-5, "{frame}");
        }
        let said = |look: &Look, frames, rate| look.lint_camera(frames, rate);
        for frames in [[1, 24], [1, 1], [20, 72]] {
            assert!(said(&begun, frames, 24.0).is_empty(), "{frames:?}");
        }
        let rates = said(&begun, [1, 24], 60.0);
        assert!(
            rates.len() == 1
                && rates[0].starts_with("camera.file: the file has 24 time codes a second, by its"),
            "{rates:?}"
        );
        // Controls: without `start` the camera rests at its first key, or after its last one; both
        // cause a warning.
        let plain = look("");
        assert_eq!(pose(&plain, 20.0, 24.0).position, DVec3::new(0.0, 3.0, 8.0));
        let text = said(&plain, [1, 24], 24.0).concat();
        assert!(
            text.contains("over frames 1001 to 1025 of its file"),
            "{text}"
        );
        assert!(text.contains("camera.start = 1001"), "{text}");
        assert!(
            said(&begun, [30, 40], 24.0)
                .concat()
                .contains("frames 1030 to 1040")
        );
        assert!(said(&plain, [1001, 1010], 24.0).is_empty());
        assert_ne!(begun.hash(), plain.hash());
    }

    #[test]
    fn keyframes_are_met_and_joined_smoothly() {
        let key = |frame: u32, x: f64| {
            format!(
                "[[camera.keyframe]]\nframe = {frame}\nposition = [{x:.1}, 2.0, 0.0]\n\
                 target = [99.0, 0.0, 0.0]\n"
            )
        };
        let text = format!(
            "[camera]\nfocal_length_mm = 36.0\n{}{}{}",
            key(1, 0.0),
            key(11, 1.0),
            key(31, 5.0)
        );
        let keyed = look(&text);
        let x = |frame: f64| pose(&keyed, frame, 24.0).position.x;
        assert_eq!(
            [x(-5.0), x(1.0), x(11.0), x(31.0), x(90.0)],
            [0.0, 0.0, 1.0, 5.0, 5.0]
        );
        // The slope is continuous across the middle key, and zero at the ends.
        let slope = |frame: f64| (x(frame + 1e-5) - x(frame - 1e-5)) / 2e-5;
        assert!((slope(11.0 - 1e-4) - slope(11.0 + 1e-4)).abs() < 1e-3);
        assert!(slope(1.0 + 1e-4).abs() < 1e-3 && slope(31.0 - 1e-4).abs() < 1e-3);
        // With a focal length equal to the film's width of 36 mm, the focal length is the picture's
        // width, 160 pixels.
        assert!((look(&text).focal_px(36.0) - 160.0).abs() < 1e-12);
    }

    #[test]
    fn clocks_count_seconds_from_frame_zero() {
        let text = "[camera]\nfocal_length_mm = 36.0\nposition = [0.0, 1.0, 0.0]\n\
                    target = [1.0, 1.0, 0.0]\n";
        let setting = Setting {
            origin: DVec3::ZERO,
            extent: Extent {
                image: [[16, 19], [160, 90]],
                ..Extent::default()
            },
            particle_count: 0,
            radius: 0.1,
            near: 0.01,
            frames_per_second: 24.0,
        };
        let sample = Sample {
            instant: 0.25,
            ..Sample::STILL
        };
        let found = camera(&look(text), &setting, 48.0, sample, 0);
        // Frame 48 at 24 frames per second, a quarter of a frame later.
        assert_eq!(found.clock, (48.25f64 / 24.0) as f32);
        assert_eq!(found.seconds, (0.25f64 / 24.0) as f32);
        assert_eq!(found.frame_seconds, (1.0f64 / 24.0) as f32);
        assert_eq!(found.centre, [16.0 + 80.0, 19.0 + 45.0]);
    }

    /// Points in focus keep their position from any point of the lens; others move by the radius of
    /// their disc.
    #[test]
    fn the_plane_in_focus_stays() {
        let text = "[camera]\nfocal_length_mm = 36.0\nposition = [0.0, 1.0, 0.0]\n\
                    target = [1.0, 1.0, 0.0]\n\
                    lens = { f_stop = 2.0, focus_distance_m = 6.0 }\n";
        let look = look(text);
        let pose = pose(&look, 1.0, 24.0);
        let lens = pose.lens.unwrap();
        assert!((lens.radius - 0.009).abs() < 1e-12);
        let pinhole = of_pose(&look, &pose, DVec3::ZERO);
        let shift = |depth: f64, aperture: [f64; 2]| {
            let point = DVec3::new(depth, 1.7, 0.4);
            let place = |eye: &Eye, middle: [f64; 2]| {
                let d = point - eye.position;
                let along = d.dot(eye.forward);
                [
                    middle[0] + eye.focal * d.dot(eye.right) / along,
                    middle[1] - eye.focal * d.dot(eye.up) / along,
                ]
            };
            let mut eye = pinhole;
            let middle = through_lens(&mut eye, Some(lens), aperture);
            let (a, b) = (place(&eye, middle), place(&pinhole, [0.0; 2]));
            [a[0] - b[0], a[1] - b[1]]
        };
        for aperture in [[1.0, 0.0], [0.0, 1.0], [-0.6, 0.8]] {
            let [x, y] = shift(6.0, aperture);
            assert!(x.abs() < 1e-9 && y.abs() < 1e-9, "{x} {y}");
            let [x, y] = shift(12.0, aperture);
            let radius = 160.0 * 0.009 * (1.0 / 6.0 - 1.0 / 12.0);
            assert!((x.hypot(y) - radius).abs() < 1e-9, "{x} {y} {radius}");
        }
    }

    #[test]
    fn the_focus_distance_follows_its_keys() {
        let key = |frame: u32, focus: f64| {
            format!(
                "[[camera.keyframe]]\nframe = {frame}\nposition = [0.0, 2.0, 0.0]\n\
                 target = [9.0, 0.0, 0.0]\n\
                 focus_distance_m = {focus:?}\n"
            )
        };
        let text = format!(
            "[camera]\nfocal_length_mm = 36.0\nlens = {{ f_stop = 2.8, focus_distance_m = 5.0 }}\n\
             {}{}",
            key(1, 2.0),
            key(11, 8.0)
        );
        let look = look(&text);
        let at = |frame: f64| pose(&look, frame, 24.0).lens.unwrap().focus;
        assert_eq!([at(0.0), at(1.0), at(11.0), at(50.0)], [2.0, 2.0, 8.0, 8.0]);
        // Halfway between two keys with zero slope.
        assert!((at(6.0) - 5.0).abs() < 1e-12);
    }
}
