//! View-frustum culling of particles and blocks: a splat outside the frame costs as much as one
//! inside.

use glam::Vec3;

use super::{
    paths::Path,
    uniform::{Block, Camera, Particle},
};
use swell_domain::parallel;

/// Distance within which a particle may affect a pixel, in particle spacings or splat radii,
/// whichever is longer. Puffs and drops of spray extend less than 5 radii. A splat reaches 1.3
/// spacings and ends where the field of kernels around it does: kernels up to 1.3 spacings further
/// on, with a support of 2.5. The rest is a margin for neighbours that move differently.
const REACH: f32 = 6.0;
/// Margin in pixels for small splats, which are drawn larger than they are.
const WIDER: f32 = 8.0;

/// View frustum of a camera: four planes through the eye, and the plane of the eye itself.
struct ViewFrustum {
    position: Vec3,
    /// Inward unit normals.
    planes: [Vec3; 5],
    /// Seconds from the frame's instant.
    seconds: f32,
}

impl ViewFrustum {
    /// Frustum of the whole padded frame, with the margin that filters need.
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

    /// Whether the camera may see anything within `reach` metres of a point.
    fn sees(&self, place: Vec3, reach: f32) -> bool {
        let from_eye = place - self.position;
        (self.planes.iter()).all(|plane| plane.dot(from_eye) > -reach)
    }
}

/// For each particle, whether one of a frame's cameras may see part of it on its path; without
/// `paths` particles stay in place. `spacing` is the distance between neighbours at rest, metres.
pub(super) fn in_frame(
    particles: &[Particle],
    paths: &[Path],
    cameras: &[Camera],
    spacing: f32,
) -> Vec<bool> {
    let views: Vec<ViewFrustum> = cameras.iter().map(ViewFrustum::of).collect();
    let longest = cameras.iter().fold(spacing, |most, it| most.max(it.radius));
    let reach = REACH * longest;
    parallel::map(0..particles.len(), |index| {
        let place = Vec3::from(particles[index].position);
        let way = |seconds: f32| match paths.get(index) {
            Some(path) => path.displacement(seconds).as_vec3(),
            None => Vec3::ZERO,
        };
        (views.iter()).any(|view| view.sees(place + way(view.seconds), reach))
    })
}

/// Keeps the blocks of which one of a frame's cameras may see a part.
pub(super) fn blocks_in_frame(mut blocks: Vec<Block>, cameras: &[Camera]) -> Vec<Block> {
    let views: Vec<ViewFrustum> = cameras.iter().map(ViewFrustum::of).collect();
    let radius = cameras
        .iter()
        .fold(0.0, |most: f32, it| most.max(it.radius));
    blocks.retain(|block| {
        let (low, high) = (Vec3::from(block.low), Vec3::from(block.high));
        let reach = 0.5 * (high - low).length() + radius;
        let way = |seconds: f32| seconds * Vec3::from(block.velocity);
        let is_seen = |view: &ViewFrustum| view.sees(0.5 * (low + high) + way(view.seconds), reach);
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
    use swell_files::parse_look;

    const SPACING: f32 = 0.1;
    /// Reach that a particle needs: a splat's 1.3 spacings, another 1.3 to the end of the field
    /// around it, and the kernel support of 2.5 there.
    const NEEDED: f32 = 5.1 * SPACING;

    /// Camera that looks along x, slightly off axis, `instant` frames from the frame itself.
    fn looks_along_x(instant: f64) -> Camera {
        let text = "[camera]\nfocal_length_mm = 36.0\nposition = [0.0, 1.0, 0.0]\n\
                    target = [1.0, 0.9, 0.2]\n\
                    [image]\nwidth = 160\nheight = 90\n[sky]\nmodel = \"hosek_wilkie\"\n";
        let look = parse_look(text, FilePath::new("look.toml")).unwrap();
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

    /// Whether a point projects into the padded frame, as `project` of camera.wgsl computes it.
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

    /// Nothing within the required reach of a culled particle is in the frame, and most particles
    /// are culled.
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
        // Number of culled particles with a point in the frame within `factor` times the required
        // reach.
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
        // Control: at twice the reach, about a fiftieth of all particles, those between 0.6 and
        // 1.02 metres off, would be missed.
        let missed = wrong(2.0);
        assert!(missed > particles.len() / 80, "{missed}");
        let left_out = found.iter().filter(|is_in| !**is_in).count();
        assert!((2500..3800).contains(&left_out), "{left_out}");
    }

    /// A particle that enters the frame within the shutter's time is kept.
    #[test]
    fn a_path_into_the_frame_counts() {
        let cameras = [looks_along_x(0.0), looks_along_x(0.5)];
        let away = at(Vec3::new(-3.0, 1.0, 0.0));
        // Ten metres in half a frame.
        let path = Path::straight(Vec3::X * 10.0 * 48.0);
        let found = |paths: &[Path], cameras: &[Camera]| in_frame(&[away], paths, cameras, SPACING);
        assert_eq!(found(&[path], &cameras), [true]);
        assert_eq!(found(&[path], &cameras[..1]), [false]);
        assert_eq!(found(&[], &cameras), [false]);
    }

    /// Every block with a point in the frame is kept and most others are culled; a block that
    /// enters the frame within the shutter's time is kept.
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
        // Blocks have a diagonal of 2.8 m, so some near the frame are kept too.
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
