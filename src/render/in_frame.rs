//! Which particles may be seen in a frame: those beside it cost a splat as much as those in it.

use glam::Vec3;
use rayon::prelude::*;

use super::{
    paths::Path,
    uniform::{Block, Camera, Particle},
};

/// How far from a particle it may change a pixel, in particle spacings or splat radii, whichever are longer. Puffs and drops of spray
/// lie less than 5 radii away. A splat reaches 1.3 spacings, and ends where the field of kernels about it does, which reach 2.5 from 1.3
/// further on; the rest is for neighbours that go another way.
const REACH: f32 = 6.0;
/// Pixels by which what is small is drawn larger.
const WIDER: f32 = 8.0;

/// What a camera sees: four planes through the eye, and the one in front of it.
struct View {
    position: Vec3,
    /// Unit vectors inward.
    planes: [Vec3; 5],
    /// From the frame's instant.
    seconds: f32,
}

impl View {
    /// Of the whole frame, also of what lies about the picture for filters.
    fn of(camera: &Camera) -> Self {
        let [right, up, forward] = [camera.right, camera.up, camera.forward].map(Vec3::from);
        let slope = |axis: usize, pixel: f32| {
            (pixel - camera.corner[axis] - camera.centre[axis]) / camera.focal
        };
        let [width, height] = camera.size.map(|side| side as f32);
        let (left, top) = (slope(0, -WIDER), slope(1, -WIDER));
        let (far_right, bottom) = (slope(0, width + WIDER), slope(1, height + WIDER));
        Self {
            position: camera.position.into(),
            planes: [
                right - left * forward,
                far_right * forward - right,
                -up - top * forward,
                bottom * forward + up,
                forward,
            ]
            .map(Vec3::normalize),
            seconds: camera.seconds,
        }
    }

    /// What is `reach` about a place at most, metres.
    fn sees(&self, place: Vec3, reach: f32) -> bool {
        let from_eye = place - self.position;
        (self.planes.iter()).all(|plane| plane.dot(from_eye) > -reach)
    }
}

/// Of each particle, whether one of a frame's cameras may see something of it on its path; without `paths` they stand. `spacing` lies
/// between neighbours at rest, metres.
pub(super) fn in_frame(
    particles: &[Particle],
    paths: &[Path],
    cameras: &[Camera],
    spacing: f32,
) -> Vec<bool> {
    let views: Vec<View> = cameras.iter().map(View::of).collect();
    let longest = cameras.iter().fold(spacing, |most, it| most.max(it.radius));
    let reach = REACH * longest;
    (particles.par_iter().enumerate())
        .map(|(index, particle)| {
            let place = Vec3::from(particle.position);
            let way = |seconds: f32| match paths.get(index) {
                Some(path) => path.way(seconds).as_vec3(),
                None => Vec3::ZERO,
            };
            (views.iter()).any(|view| view.sees(place + way(view.seconds), reach))
        })
        .collect()
}

/// Those blocks of which one of a frame's cameras may see something.
pub(super) fn blocks_in_frame(mut blocks: Vec<Block>, cameras: &[Camera]) -> Vec<Block> {
    let views: Vec<View> = cameras.iter().map(View::of).collect();
    let radius = cameras
        .iter()
        .fold(0.0, |most: f32, it| most.max(it.radius));
    blocks.retain(|block| {
        let (low, high) = (Vec3::from(block.low), Vec3::from(block.high));
        let reach = 0.5 * (high - low).length() + radius;
        let way = |seconds: f32| seconds * Vec3::from(block.velocity);
        let is_seen = |view: &View| view.sees(0.5 * (low + high) + way(view.seconds), reach);
        views.iter().any(is_seen)
    });
    blocks
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use std::path::Path as FilePath;

    use glam::DVec3;

    use super::*;
    use crate::{
        camera::{Setting, camera},
        frame::Extent,
        samples::Sample,
    };
    use swell_scene::look::Look;

    const SPACING: f32 = 0.1;
    /// What a particle needs: a splat's 1.3 spacings, as far to the end of the field about it, and the 2.5 of a kernel there.
    const NEEDED: f32 = 5.1 * SPACING;

    /// One that looks along x from a step aside, `instant` frames from the frame itself.
    fn looks_along_x(instant: f64) -> Camera {
        let text = "[camera]\nfocal_length_mm = 36.0\nposition = [0.0, 1.0, 0.0]\ntarget = [1.0, 0.9, 0.2]\n\
                    [image]\nwidth = 160\nheight = 90\n[sky]\nmodel = \"hosek_wilkie\"\n";
        let look = Look::parse(text, FilePath::new("look.toml")).unwrap();
        let setting = Setting {
            origin: DVec3::ZERO,
            extent: Extent::of(&look),
            particle_count: 0,
            radius: 0.087,
            near: 0.01,
            frames_per_second: 24.0,
        };
        let sample = Sample {
            instant,
            ..Sample::STILL
        };
        camera(&look, &setting, 1.0, sample, 0)
    }

    fn at(position: Vec3) -> Particle {
        Particle {
            position: position.to_array(),
            ..Particle::default()
        }
    }

    /// Whether a place lies in the padded frame, as `project` of camera.wgsl has it.
    fn is_drawn(camera: &Camera, place: Vec3) -> bool {
        let d = place - Vec3::from(camera.position);
        let [x, y, z] = [camera.right, camera.up, camera.forward].map(|axis| d.dot(axis.into()));
        let pixel = [x, -y].map(|side| camera.focal * side / z);
        let is_in = |axis: usize| {
            let pixel = camera.corner[axis] + camera.centre[axis] + pixel[axis];
            (0.0..camera.size[axis] as f32).contains(&pixel)
        };
        z > 0.0 && is_in(0) && is_in(1)
    }

    /// Nothing that a particle that was left out needs is in the frame; and of the particles about it most are left out.
    #[test]
    fn what_is_left_out_changes_no_pixel() {
        let camera = looks_along_x(0.0);
        let mut seed = 7u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 8_388_608.0 - 1.0
        };
        let particles: Vec<Particle> = (0..4000)
            .map(|_| at(6.0 * Vec3::new(random(), random(), random())))
            .collect();
        let found = in_frame(&particles, &[], &[camera], SPACING);
        // How many of those left out have a place in the frame, within so many times what they need.
        let mut wrong = |factor: f32| {
            let left_out = particles.iter().zip(&found).filter(|(_, is_in)| !**is_in);
            let reaches = left_out.filter(|(particle, _)| {
                (0..1000).any(|_| {
                    let way = Vec3::new(random(), random(), random()).normalize();
                    let off = factor * NEEDED * way;
                    is_drawn(&camera, Vec3::from(particle.position) + off)
                })
            });
            reaches.count()
        };
        assert_eq!(wrong(1.0), 0);
        // The control: of what needs twice as much, the particles between 0.6 and 1.02 metres off, a fiftieth of all would be missed.
        let missed = wrong(2.0);
        assert!(missed > particles.len() / 80, "{missed}");
        let left_out = found.iter().filter(|is_in| !**is_in).count();
        assert!((2500..3800).contains(&left_out), "{left_out}");
    }

    /// One that comes into the frame within the shutter's time belongs to it.
    #[test]
    fn a_path_into_the_frame_counts() {
        let cameras = [looks_along_x(0.0), looks_along_x(0.5)];
        let away = at(Vec3::new(-3.0, 1.0, 0.0));
        // Ten metres ahead in half a frame.
        let path = Path::straight(Vec3::X * 10.0 * 48.0);
        let found = |paths: &[Path], cameras: &[Camera]| in_frame(&[away], paths, cameras, SPACING);
        assert_eq!(found(&[path], &cameras), [true]);
        assert_eq!(found(&[path], &cameras[..1]), [false]);
        assert_eq!(found(&[], &cameras), [false]);
    }

    /// A block of which any place is in the frame is kept, most others are not; one that comes into it within the shutter's time is.
    #[test]
    fn blocks_that_are_left_out_are_in_no_pixel() {
        let cameras = [looks_along_x(0.0), looks_along_x(0.5)];
        let steps = || (0..9).map(|step| step as f32 / 8.0);
        let (mut kept, mut drawn) = (0, 0);
        let places = || (-7..7).map(|step| 0.9 * step as f32);
        let all =
            places().flat_map(|x| places().flat_map(move |y| places().map(move |z| [x, y, z])));
        for low in all {
            let block = Block {
                low,
                high: low.map(|c| c + 1.6),
                ..Block::default()
            };
            let is_kept = !blocks_in_frame(vec![block], &cameras[..1]).is_empty();
            let is_at = |x: f32, y: f32, z: f32| {
                is_drawn(&cameras[0], Vec3::from(low) + 1.6 * Vec3::new(x, y, z))
            };
            let is_drawn = steps().any(|x| steps().any(|y| steps().any(|z| is_at(x, y, z))));
            assert!(is_kept || !is_drawn, "{low:?}");
            kept += usize::from(is_kept);
            drawn += usize::from(is_drawn);
        }
        // Their diagonal is 2.8 m: about those that are drawn some others are kept.
        assert!(
            drawn > 200 && kept < 2 * drawn && kept < 1400,
            "{drawn} {kept}"
        );
        let away = Block {
            low: [-3.5, 0.5, -0.5],
            high: [-2.5, 1.5, 0.5],
            velocity: [10.0 * 48.0, 0.0, 0.0],
            ..Block::default()
        };
        assert!(blocks_in_frame(vec![away], &cameras[..1]).is_empty());
        assert_eq!(blocks_in_frame(vec![away], &cameras).len(), 1);
    }
}
