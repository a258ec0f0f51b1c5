//! Opaque geometry that moves within a frame's shutter.
//!
//! A sample shows each solid in its pose at the sample's instant: the corners of its triangles are
//! moved on the host, the shadow map is drawn again, and the hierarchy for rays keeps its nodes and
//! gets new boxes.

use std::{fmt, sync::Arc};

use glam::{DAffine3, DQuat, DVec3, Vec3};

use super::{
    RenderScene,
    buffers::{RAYS, SET_NODES, SET_TRIANGLES, TRIANGLES},
    closed::Closed,
    samples::{Moments, Sample, samples_of},
    tree::Hierarchy,
    uniform::{Carried, Rays, Triangle},
};
use swell_domain::pose::Pose;
use swell_gpu::program::Program;
use swell_scene::look::{AovSpec, Look, MethodSpec};

/// Material codes of a pixel.
const CODES: usize = 256;

/// A part of the opaque geometry that moves as a rigid body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mover {
    /// Index in [`RenderScene::solids`].
    Solid(usize),
    /// Index in [`RenderScene::wave_makers`].
    WaveMaker(usize),
}

/// Motion of a part of the opaque geometry.
#[derive(Clone, Debug)]
pub struct SetMotion {
    /// What moves.
    pub mover: Mover,
    /// Its poses.
    pub path: PosePath,
}

/// Poses over time, by the seconds from the frame's instant; at 0 the pose in which
/// [`RenderScene`] holds the geometry.
#[derive(Clone)]
pub struct PosePath(Arc<dyn Fn(f64) -> Pose + Send + Sync>);

impl PosePath {
    /// Wraps a function from seconds to poses.
    pub fn new(pose: impl Fn(f64) -> Pose + Send + Sync + 'static) -> Self {
        Self(Arc::new(pose))
    }

    /// Returns the map from positions at the frame's instant to those `seconds` later, metres;
    /// `None` where both poses are equal.
    pub(super) fn way(&self, seconds: f64) -> Option<DAffine3> {
        let [from, to] = [0.0, seconds].map(&*self.0);
        (from != to).then(|| {
            let turn = match from.turn == to.turn {
                true => DQuat::IDENTITY,
                false => to.turn * from.turn.conjugate(),
            };
            // Where the body's point at the origin goes.
            let origin = to.place(from.back(DVec3::ZERO));
            DAffine3::from_rotation_translation(turn, origin)
        })
    }
}

impl fmt::Debug for PosePath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "PosePath({:?})", (self.0)(0.0))
    }
}

/// Instants of the look's samples, seconds from the frame's, as the device gets them; where rays
/// are cast also the first and the last of the times of each sample's rays.
fn instants(look: &Look, scene: &RenderScene) -> Vec<f32> {
    let seconds = |instant: f64| (instant / scene.frames_per_second) as f32;
    let is_ray = look.spec().renderer.method == MethodSpec::Ray;
    let samples = samples_of(look);
    let of = |sample: &Sample| {
        let span = is_ray.then(|| Moments::of(look, sample).span);
        let instants = [sample.instant]
            .into_iter()
            .chain(span.into_iter().flatten());
        instants.map(seconds)
    };
    samples.iter().flat_map(of).collect()
}

/// Whether anything moves within the look's shutter.
pub(super) fn is_blurred(look: &Look, scene: &RenderScene) -> bool {
    let instants = instants(look, scene);
    let moves = |motion: &SetMotion| {
        let mut instants = instants.iter();
        instants.any(|&it| motion.path.way(it.into()).is_some())
    };
    scene.moving.iter().any(moves)
}

/// Maps from positions at the frame to those at the next frame, relative to the domain's least
/// corner, for [`AovSpec::Forward`], by material code; `None` where nothing moves or the look does
/// not want it. `codes` are those of the scene's motions, 0 for what is not drawn.
pub(super) fn carried(look: &Look, scene: &RenderScene, codes: &[u32]) -> Option<Vec<Carried>> {
    if !look.wants(AovSpec::Forward) {
        return None;
    }
    let drawn = scene
        .moving
        .iter()
        .zip(codes)
        .filter(|(_, code)| **code > 0);
    let ways = drawn.filter_map(|(motion, &code)| {
        let way = motion.path.way(1.0 / scene.frames_per_second)?;
        Some((code, from_corner(way, scene.domain.min)))
    });
    let mut all = vec![rows(&DAffine3::IDENTITY); CODES];
    let mut moves = false;
    for (code, way) in ways {
        all[code as usize] = rows(&way);
        moves = true;
    }
    moves.then_some(all)
}

fn rows(way: &DAffine3) -> Carried {
    let rows = way.matrix3.transpose();
    let row = |axis: DVec3, shift: f64| axis.extend(shift).as_vec4().to_array();
    Carried {
        x: row(rows.x_axis, way.translation.x),
        y: row(rows.y_axis, way.translation.y),
        z: row(rows.z_axis, way.translation.z),
    }
}

/// The same map of positions relative to `corner`.
fn from_corner(way: DAffine3, corner: DVec3) -> DAffine3 {
    DAffine3 {
        translation: way.transform_point3(corner) - corner,
        ..way
    }
}

/// Opaque geometry on the device, of which a part moves from sample to sample.
#[derive(Clone, Debug)]
pub(super) struct MovingSet {
    paths: Vec<PosePath>,
    /// Least corner of the domain, metres.
    corner: DVec3,
    /// Instants of the look's samples, seconds from the frame's.
    instants: Vec<f32>,
    /// Triangles at the frame's instant, then texture mappings.
    set: Vec<Triangle>,
    /// Number of triangles.
    count: usize,
    /// For each entry of `set`, 0 or the number of its motion, from 1.
    movers: Vec<u32>,
    /// Instant on the device, and the first and last time of its rays, seconds from the frame's.
    stands: [f32; 3],
    /// `None` where the look casts no rays.
    rays: Option<(Rays, Hierarchy)>,
}

impl MovingSet {
    /// Takes triangles and texture mappings, each with 0 or the number of its motion.
    pub(super) fn new(
        (look, scene): (&Look, &RenderScene),
        triangles: (&[Triangle], &[u32]),
        places: (&[Triangle], &[u32]),
    ) -> Self {
        Self {
            paths: scene.moving.iter().map(|it| it.path.clone()).collect(),
            corner: scene.domain.min,
            instants: instants(look, scene),
            set: [triangles.0, places.0].concat(),
            count: triangles.0.len(),
            movers: [triangles.1, places.1].concat(),
            stands: [0.0; 3],
            rays: None,
        }
    }

    /// Moves the hierarchy for rays too, of which the device has `rays`.
    pub(super) fn cast(&mut self, rays: Rays, hierarchy: Hierarchy) {
        self.rays = Some((rays, hierarchy));
    }

    /// Maps of the motions `seconds` after the frame's instant; `None` for those that rest.
    fn ways(&self, seconds: f32) -> Vec<Option<DAffine3>> {
        let way = |path: &PosePath| {
            let way = path.way(seconds.into())?;
            Some(from_corner(way, self.corner))
        };
        self.paths.iter().map(way).collect()
    }

    /// Entry `index` moved by the motions' maps; `None` where it rests.
    fn moved(&self, index: usize, ways: &[Option<DAffine3>]) -> Option<Triangle> {
        let mover = *self.movers.get(index)? as usize;
        let way = (*ways.get(mover.checked_sub(1)?)?)?;
        let wide = |p: [f32; 3]| Vec3::from(p).as_dvec3();
        let point = |p: [f32; 3]| way.transform_point3(wide(p)).as_vec3().to_array();
        let along = |v: [f32; 3]| way.transform_vector3(wide(v)).as_vec3().to_array();
        let it = self.set[index];
        Some(match index < self.count {
            true => Triangle {
                a: point(it.a),
                b: point(it.b),
                c: point(it.c),
                ..it
            },
            // A texture mapping: two gradients and a point.
            false => Triangle {
                a: along(it.a),
                b: along(it.b),
                c: point(it.c),
                ..it
            },
        })
    }

    /// Triangles and texture mappings at an instant.
    fn at(&self, seconds: f32) -> Vec<Triangle> {
        let ways = self.ways(seconds);
        (0..self.set.len())
            .map(|index| self.moved(index, &ways).unwrap_or(self.set[index]))
            .collect()
    }

    /// Iterates over the moving triangles at the instants of all samples.
    pub(super) fn swept(&self) -> impl Iterator<Item = Triangle> {
        self.instants.iter().flat_map(move |&seconds| {
            let ways = self.ways(seconds);
            (0..self.count).filter_map(move |index| self.moved(index, &ways))
        })
    }

    /// Ways of the corners over the times of a sample's rays: those of a straight and even motion.
    fn ways_over(&self, [start, end]: [f32; 2]) -> Vec<Triangle> {
        let mut ways = self.at(end);
        ways.truncate(self.count);
        for (way, from) in ways.iter_mut().zip(self.at(start)) {
            let corners = [&mut way.a, &mut way.b, &mut way.c];
            for (to, from) in corners.into_iter().zip([from.a, from.b, from.c]) {
                *to = (Vec3::from(*to) - Vec3::from(from)).to_array();
            }
        }
        ways
    }

    /// Uploads the geometry for an instant, and for rays with times from `span`, in seconds from
    /// the frame, and fits the boxes of closed bodies to it.
    pub(super) fn stand_at(
        &mut self,
        (seconds, span): (f32, [f32; 2]),
        program: &Program,
        closed: &mut Closed,
    ) {
        let stands = [seconds, span[0], span[1]];
        if self.stands == stands {
            return;
        }
        self.stands = stands;
        let set = self.at(seconds);
        let ways = match self.rays {
            Some(_) => self.ways_over(span),
            None => Vec::new(),
        };
        let (triangles, places) = set.split_at(self.count);
        closed.fit(triangles);
        program.upload(TRIANGLES, 0, &set);
        if let Some((rays, hierarchy)) = &mut self.rays {
            let swept = ends(seconds, span).map(|part| along(triangles, &ways, part));
            hierarchy.fit(&[&swept[0], &swept[1]]);
            let tree = hierarchy.packed(triangles);
            (rays.set_low, rays.set_step) = (tree.low, tree.step);
            program.upload(RAYS, 0, &[*rays]);
            program.upload(SET_NODES, 0, &tree.nodes);
            program.upload(
                SET_TRIANGLES,
                0,
                &[&tree.sorted, places, &hierarchy.sorted(&ways)].concat(),
            );
        }
    }
}

/// First and last time of a sample's rays since its instant, over the time between them.
fn ends(seconds: f32, [start, end]: [f32; 2]) -> [f32; 2] {
    match end > start {
        true => [start, end].map(|time| (time - seconds) / (end - start)),
        false => [0.0; 2],
    }
}

/// Triangles moved by a part of their ways.
fn along(triangles: &[Triangle], ways: &[Triangle], part: f32) -> Vec<Triangle> {
    let shift = |p: [f32; 3], way: [f32; 3]| (Vec3::from(p) + part * Vec3::from(way)).to_array();
    let pairs = triangles.iter().zip(ways);
    pairs
        .map(|(it, way)| Triangle {
            a: shift(it.a, way.a),
            b: shift(it.b, way.b),
            c: shift(it.c, way.c),
            ..*it
        })
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use super::*;

    fn one(a: [f32; 3], b: [f32; 3], c: [f32; 3]) -> Triangle {
        Triangle {
            a,
            b,
            c,
            ..Triangle::default()
        }
    }

    /// Coordinate of a texture at a point by its mapping, as in materials.wgsl.
    fn texture(place: &Triangle, p: DVec3) -> f64 {
        let wide = |p: [f32; 3]| Vec3::from(p).as_dvec3();
        f64::from(f32::from_bits(place.material)) + wide(place.a).dot(p - wide(place.c))
    }

    /// A set of two triangles and two mappings, of which the first ones move.
    fn set(path: PosePath) -> MovingSet {
        let triangle = one([1.0, 2.0, 3.0], [2.0, 2.5, 3.0], [1.0, 4.0, 3.5]);
        let place = Triangle {
            material: 0.25f32.to_bits(),
            ..one([0.5, -0.3, 0.2], [0.1, 0.4, 0.0], [1.0, 2.0, 3.0])
        };
        MovingSet {
            paths: vec![path],
            corner: DVec3::new(10.0, 20.0, 30.0),
            instants: vec![-0.5, 0.0, 0.5],
            set: vec![triangle, triangle, place, place],
            count: 2,
            movers: vec![1, 0, 1, 0],
            stands: [0.0; 3],
            rays: None,
        }
    }

    #[test]
    fn triangles_and_their_textures_move_together() {
        let pose = |t: f64| Pose {
            rest: DVec3::new(11.0, 22.0, 33.0),
            centre: DVec3::new(11.0, 22.0 + t, 33.0),
            turn: DQuat::from_rotation_y(0.4 + 2.0 * t),
        };
        let set = set(PosePath::new(pose));
        let moved = set.at(0.5);
        let wide = |p: [f32; 3]| Vec3::from(p).as_dvec3();
        // The world's position of a corner at the start, and after half a second.
        let start = pose(0.0).back(wide(set.set[0].b) + set.corner);
        let after = pose(0.5).place(start) - set.corner;
        assert!(wide(moved[0].b).distance(after) < 1e-5);
        let [before, after] = [&set.set[0].b, &moved[0].b].map(|p| wide(*p));
        assert!((texture(&moved[2], after) - texture(&set.set[2], before)).abs() < 1e-5);
        // Controls: without its motion, the mapping gives another colour there; and what rests.
        assert!((texture(&set.set[2], after) - texture(&set.set[2], before)).abs() > 0.1);
        assert_eq!(
            [&moved[1], &moved[3]].map(|it| it.c),
            [&set.set[1], &set.set[3]].map(|it| it.c)
        );
        assert_eq!(set.at(0.0)[0].b, set.set[0].b);
        // The frame's instant is not among what is swept: nothing moves then.
        assert_eq!(set.swept().count(), 2);
    }

    #[test]
    fn a_path_that_rests_has_no_way() {
        let resting = PosePath::new(|_| Pose {
            turn: DQuat::from_rotation_x(0.3),
            ..Pose::START
        });
        assert!(resting.way(0.7).is_none());
        let slides = PosePath::new(|t| Pose {
            centre: t * DVec3::X,
            turn: DQuat::from_rotation_x(0.3),
            ..Pose::START
        });
        let way = slides.way(0.7).unwrap();
        assert_eq!(way.matrix3, glam::DMat3::IDENTITY);
        assert!((way.translation - 0.7 * DVec3::X).length() < 1e-15);
    }
}
