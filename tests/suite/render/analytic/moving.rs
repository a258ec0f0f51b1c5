//! Moving solids within an open shutter: each sample shows them in their pose at its instant.

use glam::{DQuat, DVec3};
use swell::domain::body::{Body, BodyState, Freedom, MassProperties};
use swell::domain::bounds::Bounds;
use swell::domain::particles::Particles;
use swell::domain::pose::Pose;
use swell::render::{Image, Mover, PosePath, RenderScene, SetMotion};
use swell::scene::moving_solid::{FreeBody, GivenMass, MovingSolid};
use swell::scene::solid_path::{BodiesAround, SolidPath};
use swell::scene::{PlacedMesh, Placement, Wall};

use super::geometry::box_mesh;
use super::support::{Eye, Setup, context, draw, scene, uniform_sky};

const METHODS: [&str; 2] = ["ssfr", "ray"];
/// Seconds between frames.
const FRAME: f64 = 1.0 / 24.0;
/// Samples of a picture.
const SAMPLES: u32 = 32;
/// Instants of the shutter at which the expected coverage is evaluated.
const FINE: u32 = 2000;
/// Half the diagonal of a pixel, in which a sample may lie, and a tenth for a plate's thickness and
/// for the shadow map's texels.
const NEAR_PX: f64 = 0.8;

/// A thin plate, edges along both axes across `axis`.
#[derive(Clone, Copy)]
struct Plate {
    axis: usize,
    centre: DVec3,
    half: [f64; 2],
}

impl Plate {
    fn edges(&self) -> [DVec3; 2] {
        [1, 2].map(|k| DVec3::AXES[(self.axis + k) % 3])
    }

    fn bounds(&self) -> Bounds {
        let [u, v] = self.edges();
        let half = self.half[0] * u + self.half[1] * v + 1e-3 * DVec3::AXES[self.axis];
        Bounds {
            min: self.centre - half,
            max: self.centre + half,
        }
    }

    /// Distance of a point of the plate's plane from its outline, metres, positive within.
    fn depth(&self, pose: Pose, point: DVec3) -> f64 {
        let off = pose.back(point) - self.centre;
        let [u, v] = self.edges();
        let [du, dv] = [(u, 0), (v, 1)].map(|(e, k)| self.half[k] - off.dot(e).abs());
        match du < 0.0 && dv < 0.0 {
            true => -du.hypot(dv),
            false => du.min(dv),
        }
    }
}

/// Expected mean over the shutter at a point of the plate's plane: the share of time for which the
/// plate is there, and its tolerance. Samples divide the shutter evenly, so that each edge that
/// passes is known to half of a sample and one more, whose position in the pixel decides; and where
/// an edge lingers within the pixel, the samples of that time are of either side.
fn expected(
    plate: &Plate,
    pose: &dyn Fn(f64) -> Pose,
    shutter: f64,
    (point, metres_a_pixel): (DVec3, f64),
) -> [f64; 2] {
    let (mut there, mut near, mut crossings) = (0, 0, 0);
    let mut last = None;
    for k in 0..FINE {
        let t = ((f64::from(k) + 0.5) / f64::from(FINE) - 0.5) * shutter * FRAME;
        let depth = plate.depth(pose(t), point);
        there += u32::from(depth > 0.0);
        near += u32::from(depth.abs() < NEAR_PX * metres_a_pixel);
        crossings += u32::from(last.is_some_and(|last: f64| (last > 0.0) != (depth > 0.0)));
        last = Some(depth);
    }
    let share = |count: u32| f64::from(count) / f64::from(FINE);
    let tolerance = share(near) + 1.5 * f64::from(crossings) / f64::from(SAMPLES);
    [share(there), tolerance]
}

/// How a picture agrees with what is expected.
#[derive(Debug, Default)]
struct Agreement {
    /// Pixels out of tolerance.
    wrong: usize,
    /// Largest difference over its tolerance.
    worst: f64,
    /// Pixels that the plate covers for a part of the time and whose tolerance is below a quarter.
    partial: usize,
}

impl Agreement {
    fn add(&mut self, found: f64, [expected, tolerance]: [f64; 2]) {
        self.wrong += usize::from((found - expected).abs() > tolerance);
        self.worst = self
            .worst
            .max((found - expected).abs() / tolerance.max(1e-3));
        self.partial += usize::from(tolerance < 0.25 && (0.25..0.75).contains(&expected));
    }
}

/// The camera that sees a plate in front of the sky alone, 20 m away.
fn eye() -> Eye {
    Eye::new([5.0, 4.0, -15.0], [5.0, 8.0, 5.0], 240.0)
}

fn upright() -> Plate {
    Plate {
        axis: 2,
        centre: DVec3::new(5.0, 8.0, 5.0),
        half: [1.25, 0.4],
    }
}

fn setup(method: &'static str, shutter: f64) -> Setup {
    Setup {
        method,
        samples: SAMPLES,
        shutter,
        background: false,
        ..Setup::new(eye())
    }
}

/// An open box with a plate that has this path.
fn scene_of(plate: &Plate, path: Option<PosePath>) -> RenderScene {
    let mover = Mover::Solid(0);
    RenderScene {
        solids: vec![box_mesh(plate.bounds())],
        moving: path
            .map(|path| SetMotion { mover, path })
            .into_iter()
            .collect(),
        ..scene(0.4, 1.0)
    }
}

fn picture(setup: &Setup, scene: &RenderScene) -> Image {
    let none = Particles::default();
    draw(&context(), setup, &uniform_sky, scene, &none, 1)
}

/// Compares how much a plate covers of the sky with what is expected from `pose` and `shutter`.
fn covers(image: &Image, plate: &Plate, pose: &dyn Fn(f64) -> Pose, shutter: f64) -> Agreement {
    let eye = eye();
    let mut agreement = Agreement::default();
    for (i, value) in image.beauty.iter().enumerate() {
        let along = eye.direction(i);
        let far = (plate.centre - eye.position)[plate.axis] / along[plate.axis];
        let point = eye.position + far * along;
        let pixel = far * along.dot(eye.forward()) / eye.focal;
        agreement.add(
            value[3].into(),
            expected(plate, pose, shutter, (point, pixel)),
        );
    }
    agreement
}

/// Slides by 40 pixels of [`eye`] within half a frame.
fn slide(t: f64) -> Pose {
    Pose {
        centre: 3.4 * t / (0.5 * FRAME) * DVec3::X,
        ..Pose::START
    }
}

#[test]
fn a_sliding_plate_covers_pixels_for_the_time_that_it_is_there() {
    let plate = upright();
    let moves = Some(PosePath::new(slide));
    for method in METHODS {
        let blurred = picture(&setup(method, 0.5), &scene_of(&plate, moves.clone()));
        let found = covers(&blurred, &plate, &slide, 0.5);
        assert!(
            found.wrong == 0 && found.partial > 200,
            "{method}: {found:?}"
        );
        // Controls: a closed shutter, a plate that rests, and one that moves by half more.
        let sharp = picture(&setup(method, 0.0), &scene_of(&plate, moves.clone()));
        let resting = picture(&setup(method, 0.5), &scene_of(&plate, None));
        let faster = PosePath::new(|t| slide(1.5 * t));
        let faster = picture(&setup(method, 0.5), &scene_of(&plate, Some(faster)));
        for (name, image) in [("sharp", &sharp), ("resting", &resting)] {
            let found = covers(image, &plate, &slide, 0.5);
            assert!(found.wrong > 200, "{method} {name}: {found:?}");
        }
        let found = covers(&faster, &plate, &slide, 0.5);
        assert!(found.wrong > 10, "{method} faster: {found:?}");
        // A closed shutter shows the pose at the frame, with and without a path.
        let rests = picture(&setup(method, 0.0), &scene_of(&plate, None));
        assert_eq!(sharp.beauty, rests.beauty, "{method}");
    }
}

/// A camera that looks down at the floor from below a plate, which the sun above shades.
#[test]
fn its_shadow_is_blurred_as_it_is() {
    let plate = Plate {
        axis: 1,
        centre: DVec3::new(5.0, 9.0, 5.0),
        half: [0.15, 0.25],
    };
    // Forty pixels of 1/60 m.
    let pose = |t: f64| Pose {
        centre: 0.667 * t / (0.5 * FRAME) * DVec3::X,
        ..Pose::START
    };
    let eye = Eye {
        up: DVec3::Z,
        ..Eye::new([5.0, 4.0, 5.0], [5.0, 0.0, 5.0], 240.0)
    };
    let shot = |method: &'static str, shutter: f64, scene: &RenderScene| {
        let setup = Setup {
            method,
            samples: SAMPLES,
            shutter,
            sun: [0.0, 90.0, 1.0],
            ground: [0.5; 3],
            ..Setup::new(eye)
        };
        let none = Particles::default();
        draw(&context(), &setup, &|_, _| [0.0; 3], scene, &none, 1)
    };
    let agreement = |image: &Image, lit: &Image| {
        let mut agreement = Agreement::default();
        for (i, (value, lit)) in image.beauty.iter().zip(&lit.beauty).enumerate() {
            let along = eye.direction(i);
            let far = eye.position.y / -along.y;
            let below = eye.position + far * along;
            let point = DVec3::new(below.x, plate.centre.y, below.z);
            let pixel = far * along.dot(eye.forward()) / eye.focal;
            let dark = 1.0 - f64::from(value[0] / lit[0]);
            agreement.add(dark, expected(&plate, &pose, 0.5, (point, pixel)));
        }
        agreement
    };
    for method in METHODS {
        let lit = shot(method, 0.0, &scene(0.4, 1.0));
        assert!(lit.beauty.iter().all(|value| value[0] > 0.01), "{method}");
        let moving = scene_of(&plate, Some(PosePath::new(pose)));
        let found = agreement(&shot(method, 0.5, &moving), &lit);
        assert!(
            found.wrong == 0 && found.partial > 100,
            "{method}: {found:?}"
        );
        // Control: the shadow map of the frame's instant.
        let found = agreement(&shot(method, 0.0, &moving), &lit);
        assert!(found.wrong > 100, "{method}: {found:?}");
    }
}

/// Twice the distance and twice the angle after a second.
const PUSH: f64 = 5530.0;
const TWIST: f64 = 3700.0;
/// Spin at the frame, rad/s.
const SPIN: f64 = 12.0;

/// State of a body that is thrown aside and turns ever faster in the picture's plane, at rest but
/// for a slow spin at the frame.
fn thrown(t: f64, start: f64) -> BodyState {
    let angle = SPIN * t + 0.5 * TWIST * t * t;
    BodyState {
        time: start + t,
        centre: upright().centre + 0.5 * PUSH * t * t * DVec3::X,
        turn: DQuat::from_rotation_z(angle),
        velocity: PUSH * t * DVec3::X,
        spin: (SPIN + TWIST * t) * DVec3::Z,
    }
}

/// The plate as a body.
fn floating(plate: &Plate) -> MovingSolid {
    let mesh = box_mesh(plate.bounds());
    let body = Body {
        mass: MassProperties::of_mesh(&mesh, 500.0),
        velocity: [0.0; 6],
        freedom: Freedom::ALL,
        moorings: Vec::new(),
    };
    MovingSolid {
        placed: PlacedMesh {
            file: "plate.obj".into(),
            file_hash: String::new(),
            placement: Placement::default(),
            mesh,
            holes: Default::default(),
            rounding: DVec3::ZERO,
            faults: Vec::new(),
        },
        slide: None,
        turn: None,
        track: None,
        sequence: None,
        body: Some(FreeBody {
            index: 0,
            body,
            collides: false,
            reach: 2.0,
            given: GivenMass::default(),
        }),
        floor: None,
    }
}

#[test]
fn a_bodys_path_leads_through_its_states_in_the_frames_around() {
    let plate = upright();
    let start = 5.0 * FRAME;
    let [before, now, after] = [-1.0, 0.0, 1.0].map(|frames| [thrown(frames * FRAME, start)]);
    let around = BodiesAround {
        before: Some(&before),
        now: &now,
        after: Some(&after),
    };
    let solid = floating(&plate);
    let path = |around: BodiesAround<'_>| {
        let path = SolidPath::new(&solid, around);
        PosePath::new(move |seconds| path.pose(start + seconds))
    };
    let truth = |t: f64| {
        let state = thrown(t, start);
        Pose {
            rest: plate.centre,
            centre: state.centre,
            turn: state.turn,
        }
    };
    for method in METHODS {
        let shot = |shutter: f64, around: BodiesAround<'_>| {
            let image = picture(
                &setup(method, shutter),
                &scene_of(&plate, Some(path(around))),
            );
            covers(&image, &plate, &truth, 1.0)
        };
        let found = shot(1.0, around);
        // A ray has any time in its sample: an edge is known to one sample more.
        let most = if method == "ray" { 2.5 / 1.5 } else { 1.0 };
        assert!(
            found.worst < most && found.partial > 50,
            "{method}: {found:?}"
        );
        // Controls: the state of the frame alone, with its slow spin; one side alone; a closed
        // shutter.
        let alone = shot(1.0, BodiesAround::alone(&now));
        let half = BodiesAround {
            before: None,
            ..around
        };
        let half = shot(1.0, half);
        let closed = shot(0.0, around);
        for (name, found) in [("alone", alone), ("half", half), ("closed", closed)] {
            assert!(found.wrong > 50, "{method} {name}: {found:?}");
        }
    }
}

#[test]
fn motion_vectors_of_solids_lead_to_the_next_frame() {
    let (plate, eye) = (upright(), eye());
    let pose = move |t: f64| Pose {
        rest: plate.centre,
        centre: plate.centre + t / FRAME * DVec3::new(0.5, -0.3, 0.0),
        turn: DQuat::from_rotation_z(0.4 * t / FRAME),
    };
    // A pixel towards a corner of the plate.
    let pixel = 30 * 64 + 42;
    let along = eye.direction(pixel);
    let far = (plate.centre - eye.position).z / along.z;
    let point = eye.position + far * along;
    assert!(plate.depth(pose(0.0), point) > 0.1);
    let next = pose(FRAME).place(point);
    let truth = eye.place(next - eye.position) - eye.place(along);
    assert!(truth.x.abs() > 3.0 && truth.y.abs() > 3.0, "{truth}");
    for method in METHODS {
        for shutter in [0.0, 0.5] {
            let shown = |path: Option<PosePath>| {
                let image = picture(&setup(method, shutter), &scene_of(&plate, path));
                let [u, v] = image.aovs.forward.unwrap()[pixel].map(f64::from);
                (u - truth.x).hypot(v - truth.y)
            };
            // The plate's front is a millimetre before its plane: 5e-5 of the distance, and of the
            // 40 pixels that anything is from the middle.
            let off = shown(Some(PosePath::new(pose)));
            assert!(off < 5e-3, "{method} {shutter}: {off}");
            // Control: a solid without a path rests.
            let off = shown(None);
            assert!(off > 3.0, "{method} {shutter}: {off}");
        }
    }
}

/// The plate of a wave maker moves as a solid of the same shape does.
#[test]
fn a_wave_makers_plate_is_drawn_as_a_solid_of_its_shape_is() {
    let path = PosePath::new(slide);
    let motion = |mover| {
        let path = path.clone();
        vec![SetMotion { mover, path }]
    };
    let plate = RenderScene {
        wave_makers: vec![(
            Wall {
                axis: 0,
                is_max: false,
            },
            5.5,
        )],
        moving: motion(Mover::WaveMaker(0)),
        ..scene(0.4, 1.0)
    };
    let solid = RenderScene {
        solids: vec![box_mesh(Bounds {
            min: DVec3::new(4.5, 0.0, 0.0),
            max: DVec3::new(5.5, 9.0, 10.0),
        })],
        moving: motion(Mover::Solid(0)),
        ..scene(0.4, 1.0)
    };
    let resting = RenderScene {
        moving: Vec::new(),
        ..plate.clone()
    };
    for method in METHODS {
        let setup = Setup {
            more: "[wave_makers]\nheight_m = 9.0\nthickness_m = 1.0\n".to_owned(),
            ..setup(method, 0.5)
        };
        // Seen, and in motion: coverage, and the motion to the next frame.
        let shown = |scene: &RenderScene| {
            let image = picture(&setup, scene);
            let alphas: Vec<f32> = image.beauty.iter().map(|value| value[3]).collect();
            (alphas, image.aovs.forward.unwrap())
        };
        let (found, expected) = (shown(&plate), shown(&solid));
        assert!(found == expected, "{method}");
        assert!(expected.0.iter().any(|alpha| (0.2..0.8).contains(alpha)));
        // Control: what rests.
        let rests = shown(&resting);
        assert!(rests.0 != expected.0 && rests.1 != expected.1, "{method}");
    }
}
