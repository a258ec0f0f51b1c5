//! Tests with inflow and outflow counted by hand.

use super::{
    super::{
        mesh::tests::{box_mesh, sphere},
        pose::Pose,
    },
    *,
};

pub(super) const D: f64 = 0.1;

pub(super) fn block(min: [f64; 3], max: [f64; 3]) -> Shape {
    Shape::from(bounds(min, max))
}

/// A nozzle 0.4 m long, 0.3 × 0.2 m wide.
pub(super) fn nozzle(velocity: DVec3) -> Emitter<Shape> {
    Emitter {
        shape: block([0.0; 3], [0.4, 0.3, 0.2]),
        velocity,
        level: None,
        window: Window::default(),
    }
}

pub(super) fn with(emitters: Vec<Emitter<Shape>>, drains: Vec<Drain<Shape>>) -> Sources {
    Sources {
        emitters,
        drains,
        spacing: D,
        frames_per_second: 25.0,
        domain: bounds([-5.0; 3], [5.0; 3]),
    }
}

fn bounds(min: [f64; 3], max: [f64; 3]) -> Bounds {
    let [min, max] = [min, max].map(DVec3::from_array);
    Bounds { min, max }
}

/// Distance to boxes, over the nozzle and beyond.
fn solid(boxes: &[Bounds]) -> SignedDistance {
    let meshes: Vec<_> = boxes.iter().map(|it| box_mesh(*it)).collect();
    let around = bounds([-1.0; 3], [2.0; 3]);
    let all = SignedDistance::from_meshes(&meshes, &around, 0.5 * D).unwrap();
    all.expect("boxes")
}

/// All that enters until the end of a frame, where nothing moves it.
pub(super) fn run(sources: &Sources, frames: u32) -> (Particles, u32, Vec<Exchange>) {
    meeting(sources, &Solids::still(None), frames)
}

/// Same with solids.
fn meeting(sources: &Sources, solids: &Solids<'_>, frames: u32) -> (Particles, u32, Vec<Exchange>) {
    let (mut particles, mut next_id) = (Particles::default(), 0);
    let exchanges = (1..=frames)
        .map(|frame| sources.exchange(frame, solids, &mut particles, &mut next_id))
        .collect();
    (particles, next_id, exchanges)
}

/// 2 m/s through 3 × 2 positions: after 3 s 6 m of water, 60 layers of 6, whatever the frame rate.
/// All are positions of one moving lattice, so that no two are closer than the spacing.
#[test]
fn a_flow_brings_velocity_times_cross_section() {
    let sources = with(vec![nozzle(DVec3::new(2.0, 0.0, 0.0))], Vec::new());
    let (particles, next_id, exchanges) = run(&sources, 75);
    assert_eq!((particles.len(), next_id), (360, 360));
    assert_eq!(particles.id, (0..360).collect::<Vec<_>>());
    let counts: Vec<u64> = exchanges.iter().map(|exchange| exchange.entered).collect();
    // 0.8 layers per frame: four frames with one layer, and one without.
    assert!(counts.iter().all(|&n| n == 0 || n == 6), "{counts:?}");
    assert_eq!(counts[..5].iter().sum::<u64>(), 24, "{counts:?}");
    // If the water keeps its velocity, all of it forms one lattice.
    let mut places: Vec<[i64; 3]> = Vec::new();
    let (mut particles, mut next_id) = (Particles::default(), 0);
    for frame in 1..=75 {
        for x in &mut particles.position {
            x[0] += 2.0 / 25.0;
        }
        sources.exchange(frame, &Solids::still(None), &mut particles, &mut next_id);
    }
    let first = particles.position[0][0];
    for x in &particles.position {
        let steps = (x[0] - first) / D as f32;
        assert!((steps - steps.round()).abs() < 1e-3, "{x:?}");
        let across = [f64::from(x[1]), f64::from(x[2])].map(|x| (x / D - 0.5).round() as i64);
        places.push([steps.round() as i64, across[0], across[1]]);
    }
    places.sort_unstable();
    places.dedup();
    assert_eq!(places.len(), 360);
}

/// At an angle, water comes in through two faces: 0.3 × 0.2 m at 1 m/s, and 0.4 × 0.2 m at 0.5 m/s.
#[test]
fn an_oblique_flow_brings_what_its_faces_take() {
    let velocity = DVec3::new(1.0, 0.5, 0.0);
    let sources = with(vec![nozzle(velocity)], Vec::new());
    let (particles, ..) = run(&sources, 250);
    let expected = 10.0 * (0.3 * 0.2 + 0.5 * 0.4 * 0.2) / D.powi(3);
    let found = particles.len() as f64;
    // One layer of each face.
    assert!((found - expected).abs() < 20.0, "{found} of {expected}");
    let size = DVec3::new(0.4, 0.3, 0.2);
    assert!((10.0 * flow(size, velocity, D) / D.powi(3) - expected).abs() < 1e-9);
}

#[test]
fn what_passes_a_room_within_a_frame_is_too_fast_for_it() {
    let size = DVec3::new(0.4, 0.3, 0.2);
    assert!(is_long_enough(size, DVec3::new(10.0, 0.0, 0.0), 0.04));
    assert!(!is_long_enough(size, DVec3::new(10.1, 0.0, 0.0), 0.04));
    // Confirmed by the exchange: all of the water enters, and some is beyond the volume.
    let beyond = |speed: f64| {
        let sources = with(vec![nozzle(DVec3::new(speed, 0.0, 0.0))], Vec::new());
        let (particles, ..) = run(&sources, 250);
        let part = particles.len() as f64 / (speed * 10.0 / D * 6.0);
        assert!((part - 1.0).abs() < 1e-2, "{speed}: {part}");
        particles.position.iter().filter(|x| x[0] > 0.4).count()
    };
    assert_eq!(beyond(10.0), 0);
    assert!(beyond(12.0) > 100);
}

#[test]
fn a_window_is_the_frames_that_end_in_it() {
    let mut emitter = nozzle(DVec3::new(2.5, 0.0, 0.0));
    emitter.window = Window {
        from: 0.2,
        until: Some(0.4),
    };
    assert!((emitter.window.length(10.0) - 0.2).abs() < 1e-12);
    let (_, _, exchanges) = run(&with(vec![emitter], Vec::new()), 20);
    let counts: Vec<u64> = exchanges.iter().map(|exchange| exchange.entered).collect();
    let expected = [vec![0; 5], vec![6; 5], vec![0; 10]].concat();
    assert_eq!(counts, expected);
}

/// A volume half full of randomly packed water gets what it lacks, block by block, and no more.
#[test]
fn a_level_is_kept_by_what_is_lacking() {
    let emitter = Emitter {
        shape: block([0.0; 3], [0.8, 0.8, 0.8]),
        level: Some(0.4),
        velocity: DVec3::new(0.0, 0.0, 1.0),
        window: Window::default(),
    };
    let sources = with(vec![emitter], Vec::new());
    let mut particles = Particles::default();
    let mut next_id = 0;
    let none = Solids::still(None);
    let first = sources.exchange(1, &none, &mut particles, &mut next_id);
    assert_eq!(first.entered, 8 * 8 * 4);
    assert_eq!(
        sources
            .exchange(2, &none, &mut particles, &mut next_id)
            .entered,
        0
    );
    // Half of the particles leave, and as many come back, with new ids.
    let keep: Vec<bool> = (0..particles.len()).map(|k| k % 2 == 0).collect();
    particles.retain(&keep);
    let again = sources.exchange(3, &none, &mut particles, &mut next_id);
    assert_eq!((again.entered, next_id), (128, 256 + 128));
    // Crowded particles are not too few.
    for x in &mut particles.position {
        *x = x.map(|x| (x / 0.2).floor() * 0.2 + 0.03);
    }
    assert_eq!(
        sources
            .exchange(4, &none, &mut particles, &mut next_id)
            .entered,
        0
    );
    assert!(particles.position.iter().all(|x| x[1] < 0.4));
}

#[test]
fn a_drain_takes_what_it_may() {
    let full = |drain: Drain<Shape>| {
        let (mut particles, _, _) = run(
            &with(
                vec![Emitter {
                    shape: block([0.0; 3], [1.0; 3]),
                    level: Some(1.0),
                    ..nozzle(DVec3::ZERO)
                }],
                Vec::new(),
            ),
            1,
        );
        assert_eq!(particles.len(), 1000);
        let sources = with(Vec::new(), vec![drain]);
        let mut next_id = 1000;
        let left: Vec<u64> = (2..12)
            .map(|frame| {
                sources
                    .exchange(frame, &Solids::still(None), &mut particles, &mut next_id)
                    .left
            })
            .collect();
        assert_eq!(next_id, 1000);
        assert_eq!(particles.len() as u64 + left.iter().sum::<u64>(), 1000);
        (particles, left)
    };
    let drain = Drain {
        shape: block([0.0; 3], [0.5, 1.0, 1.0]),
        level: None,
        rate: None,
        window: Window::default(),
    };
    let (rest, left) = full(drain.clone());
    assert_eq!(left[0], 500);
    assert!(rest.position.iter().all(|x| x[0] > 0.5));
    let (rest, left) = full(Drain {
        level: Some(0.7),
        ..drain.clone()
    });
    assert_eq!(left[0], 150);
    let above = |x: &&[f32; 3]| x[0] < 0.5 && x[1] > 0.7;
    assert_eq!(rest.position.iter().filter(above).count(), 0);
    // 0.2 m³/s are 8 particles per frame, from all over the volume.
    let (rest, left) = full(Drain {
        rate: Some(0.2),
        ..drain
    });
    assert_eq!(left, [8; 10]);
    let low = rest.position.iter().filter(|x| x[0] < 0.5 && x[1] < 0.5);
    let low = low.count();
    assert!((200..=225).contains(&low), "{low} of 210");
}

#[test]
fn water_is_not_born_in_solids_and_its_attributes_begin_at_zero() {
    let solid = SignedDistance {
        origin: DVec3::ZERO,
        spacing: 1.0,
        dims: [2, 2, 2],
        // Open where x > 0.2.
        values: [-0.2f32, 0.8].repeat(4),
    };
    let sources = with(vec![nozzle(DVec3::new(0.0, 0.0, 2.5))], Vec::new());
    let mut particles = Particles::default();
    particles.attributes.insert("affine".to_owned(), Vec::new());
    let mut next_id = 5;
    let found = sources.exchange(
        1,
        &Solids::still(Some(&solid)),
        &mut particles,
        &mut next_id,
    );
    // Of four columns at 0.05 to 0.35, those outside of the solid: 0.25 and 0.35.
    assert_eq!(found.entered, 6);
    assert_eq!(particles.id, [5, 6, 7, 8, 9, 10]);
    assert!(particles.position.iter().all(|x| x[0] > 0.24));
    assert_eq!(particles.attributes["affine"], [0.0; 6]);
}

/// A ball as the volume: the inflow is the ball's cross-section times the distance.
#[test]
fn a_mesh_is_a_room_too() {
    let ball = sphere(DVec3::splat(0.5), 0.4, 24);
    let shape = Shape::of_mesh(&ball, D).unwrap();
    let emitter = Emitter {
        shape,
        ..nozzle(DVec3::new(1.0, 0.0, 0.0))
    };
    let (particles, ..) = run(&with(vec![emitter], Vec::new()), 100);
    let expected = 4.0 * std::f64::consts::PI * 0.16 / D.powi(3);
    let found = particles.len() as f64;
    // Columns of positions in the circle: Gauss's circle problem for a radius of four.
    assert!(
        (found / expected - 1.0).abs() < 0.05,
        "{found} of {expected}"
    );
    let far = |x: &[f32; 3]| (glam::Vec3::from_array(*x).as_dvec3() - 0.5).length();
    assert!(particles.position.iter().all(|x| far(x) < 0.41));
}

/// In an oblique flow some positions pass a corner of the volume between two frames. They enter as
/// well: after a second there are as many as velocity times area gives, to one layer of a face,
/// whatever the frame rate.
#[test]
fn the_frame_rate_does_not_matter() {
    let velocity = DVec3::new(1.0, -1.0, 0.5);
    let size = DVec3::new(0.4, 0.3, 0.2);
    let counts = [12.0, 24.0, 48.0, 96.0].map(|rate| {
        let sources = Sources {
            frames_per_second: rate,
            ..with(vec![nozzle(velocity)], Vec::new())
        };
        let (particles, _, exchanges) = run(&sources, 4 * rate as u32);
        assert!(exchanges.iter().all(|exchange| exchange.blocked == 0));
        particles.len()
    });
    // At all rates the same positions came in, to the last digit of a time.
    assert!(counts.iter().all(|count| *count == counts[0]), "{counts:?}");
    let expected = 4.0 * flow(size, velocity, D) / D.powi(3);
    // The largest face holds 4 × 3 positions.
    let off = (counts[0] as f64 - expected).abs();
    assert!(off <= 12.0, "{counts:?} of {expected}");
    // Each is where the lattice is at the frame's end, even beyond the volume's edges, and no
    // two coincide.
    let sources = Sources {
        frames_per_second: 12.0,
        ..with(vec![nozzle(velocity)], Vec::new())
    };
    let (mut particles, mut next_id) = (Particles::default(), 0);
    for frame in 1..=12 {
        for x in &mut particles.position {
            let way = velocity / 12.0;
            *x = (glam::Vec3::from_array(*x).as_dvec3() + way)
                .as_vec3()
                .to_array();
        }
        sources.exchange(frame, &Solids::still(None), &mut particles, &mut next_id);
    }
    let at = |x: &[f32; 3]| glam::Vec3::from_array(*x);
    for (k, x) in particles.position.iter().enumerate() {
        let near = |y: &&[f32; 3]| (at(x) - at(y)).length() < 0.999 * D as f32;
        assert_eq!(particles.position[..k].iter().filter(near).count(), 0);
    }
}

/// A window that begins and ends within frames brings what enters between the two times.
#[test]
fn a_window_is_as_long_at_any_frame_rate() {
    let mut emitter = nozzle(DVec3::new(2.5, 0.0, 0.0));
    emitter.window = Window {
        from: 0.1,
        until: Some(0.7),
    };
    for rate in [12.0, 25.0, 96.0] {
        let sources = Sources {
            frames_per_second: rate,
            ..with(vec![emitter.clone()], Vec::new())
        };
        // 15 layers of 3 × 2.
        assert_eq!(run(&sources, rate as u32).0.len(), 90, "{rate}");
    }
}

/// Whether all particles are outside of a solid.
fn is_clear(particles: &Particles, solid: &SignedDistance) -> bool {
    let at = |x: &[f32; 3]| glam::Vec3::from_array(*x).as_dvec3();
    let mut all = particles.position.iter();
    all.all(|x| solid.sample(at(x)) > 0.0)
}

/// The volume begins within a wall: water enters where it comes out of it.
#[test]
fn water_that_a_solid_covers_enters_where_it_comes_out() {
    let wall = solid(&[bounds([-0.5; 3], [0.13, 0.8, 0.8])]);
    let solids = Solids::still(Some(&wall));
    for rate in [12.0, 25.0, 96.0] {
        let sources = Sources {
            frames_per_second: rate,
            ..with(vec![nozzle(DVec3::new(2.0, 0.0, 0.0))], Vec::new())
        };
        let frames = 3 * rate as u32;
        let (particles, _, exchanges) = meeting(&sources, &solids, frames);
        // 60 layers of six come in, and the last one or two are still on their way: 0.13 m are 1.3
        // spacings, sampled at an eighth of a spacing.
        let layers = particles.len() / 6;
        assert!((58..=59).contains(&layers), "{layers} layers");
        assert!(is_clear(&particles, &wall));
        assert!(exchanges.iter().all(|exchange| exchange.blocked == 0));
        let [Some(promise)] = sources.predicted_inflows(Some(&wall))[..] else {
            panic!("one flow");
        };
        assert!((promise.rate - 2.0 * 0.06).abs() < 1e-12 && promise.covered == 0.0);
        let [(_, least)] = sources
            .least_counts(7, frames..frames + 1, &solids)
            .collect::<Vec<_>>()[..]
        else {
            panic!("one frame");
        };
        let before: u64 = exchanges[..exchanges.len() - 1]
            .iter()
            .map(|it| it.entered)
            .sum();
        assert_eq!(least, 7 + particles.len() - before as usize);
    }
}

/// A pipe as wide as the volume: all of the water enters, however the distance to the walls rounds.
#[test]
fn a_room_that_fills_a_pipe_brings_all_of_it() {
    let pipe = [
        bounds([-0.5, -0.4, -0.4], [0.9, 0.0, 0.7]),
        bounds([-0.5, 0.3, -0.4], [0.9, 0.7, 0.7]),
        bounds([-0.5, 0.0, -0.4], [0.9, 0.3, 0.0]),
        bounds([-0.5, 0.0, 0.2], [0.9, 0.3, 0.6]),
    ];
    let walls = solid(&pipe);
    let sources = with(vec![nozzle(DVec3::new(2.0, 0.0, 0.0))], Vec::new());
    let (particles, ..) = meeting(&sources, &Solids::still(Some(&walls)), 75);
    assert_eq!(particles.len(), 360);
    let straight = run(&sources, 75).0;
    assert_eq!(particles, straight, "nothing is nearer than water at rest");
    // A volume that reaches into the wall: of three rows the outer one is in it, and the next, a
    // fifth of a spacing away, is moved.
    let mut low = nozzle(DVec3::new(2.0, 0.0, 0.0));
    low.shape = block([0.0, -0.13, 0.0], [0.4, 0.17, 0.2]);
    let sources = with(vec![low], Vec::new());
    let (particles, ..) = meeting(&sources, &Solids::still(Some(&walls)), 75);
    let clearance = |x: &[f32; 3]| walls.sample(glam::Vec3::from_array(*x).as_dvec3());
    let least = particles.position.iter().map(clearance).fold(1.0, f64::min);
    assert_eq!(particles.len(), 240);
    // To f32 rounding at a metre.
    assert!((least / D - 0.3).abs() < 1e-5, "{least}");
}

/// A part that a solid covers all along is excluded from the prediction, and counted where it
/// leaves the volume.
#[test]
fn water_that_never_comes_out_is_counted() {
    // A beam over the lower third of the cross-section; behind the volume it is open again.
    let beam = solid(&[bounds([-0.5, -0.5, -0.5], [0.45, 0.1, 0.8])]);
    let sources = with(vec![nozzle(DVec3::new(2.0, 0.0, 0.0))], Vec::new());
    let (particles, _, exchanges) = meeting(&sources, &Solids::still(Some(&beam)), 75);
    assert_eq!(particles.len(), 240);
    assert!(is_clear(&particles, &beam));
    let [Some(promise)] = sources.predicted_inflows(Some(&beam))[..] else {
        panic!("one flow");
    };
    assert!((promise.covered - 1.0 / 3.0).abs() < 1e-12, "{promise:?}");
    assert!((promise.rate - 2.0 * 0.04).abs() < 1e-12, "{promise:?}");
    // Two columns of 60 layers, less the four layers that are still in the volume.
    let blocked: u64 = exchanges.iter().map(|exchange| exchange.blocked).sum();
    assert_eq!(blocked, 2 * 56);
}

/// A beam that ends in the plane where water enters covers as much as one that begins before it.
#[test]
fn a_solid_flush_with_the_room_covers_it() {
    let entered = |from: f64| {
        let beam = solid(&[bounds([from, -0.5, -0.5], [0.6, 0.1, 0.8])]);
        let sources = with(vec![nozzle(DVec3::new(2.0, 0.0, 0.0))], Vec::new());
        let (particles, _, exchanges) = meeting(&sources, &Solids::still(Some(&beam)), 75);
        let [Some(promise)] = sources.predicted_inflows(Some(&beam))[..] else {
            panic!("one flow");
        };
        let blocked: u64 = exchanges.iter().map(|exchange| exchange.blocked).sum();
        (particles.len(), blocked, promise.covered)
    };
    let flush = entered(0.0);
    assert_eq!(flush, entered(-0.5));
    assert!(flush.1 > 0 && flush.2 > 0.3, "{flush:?}");
}

/// A post within the volume: what entered before it does not enter again behind it.
#[test]
fn water_enters_once() {
    let post = solid(&[bounds([0.15, -0.5, -0.5], [0.25, 0.8, 0.8])]);
    let sources = with(vec![nozzle(DVec3::new(2.0, 0.0, 0.0))], Vec::new());
    let (particles, ..) = meeting(&sources, &Solids::still(Some(&post)), 75);
    assert_eq!(particles.len(), 360);
    assert!(is_clear(&particles, &post));
    assert!(particles.position.iter().all(|x| x[0] < 0.2));
}

/// A frame's water that would be within a solid at its end is spread over the open path before it.
#[test]
fn a_frames_water_before_a_wall_is_spread() {
    let wall = solid(&[bounds([0.1, -0.5, -0.5], [0.6, 0.8, 0.8])]);
    let sources = Sources {
        frames_per_second: 5.0,
        ..with(vec![nozzle(DVec3::new(2.0, 0.0, 0.0))], Vec::new())
    };
    let (particles, _, exchanges) = meeting(&sources, &Solids::still(Some(&wall)), 1);
    // Four layers of six.
    assert_eq!(exchanges[0].entered, 24);
    assert!(is_clear(&particles, &wall));
    let mut along: Vec<f32> = particles.position.iter().map(|x| x[0]).collect();
    along.sort_by(f32::total_cmp);
    along.dedup();
    assert!(along.len() == 4 && along[0] >= 0.0, "{along:?}");
}

/// A flow out of the domain's corner stays in the domain.
#[test]
fn water_enters_within_the_domain() {
    let sources = Sources {
        frames_per_second: 5.0,
        domain: bounds([0.0; 3], [1.0; 3]),
        ..with(vec![nozzle(DVec3::new(1.0, -1.0, 0.0))], Vec::new())
    };
    let (particles, ..) = run(&sources, 20);
    let expected = 4.0 * flow(DVec3::new(0.4, 0.3, 0.2), DVec3::new(1.0, -1.0, 0.0), D) / D.powi(3);
    assert!(
        (particles.len() as f64 - expected).abs() <= 8.0,
        "{}",
        particles.len()
    );
    let domain = sources.domain.grown(1e-6);
    let at = |x: &[f32; 3]| glam::Vec3::from_array(*x).as_dvec3();
    assert!(particles.position.iter().all(|x| domain.contains(at(x))));
    // Without limits some of it would be beyond them.
    let free = with(sources.emitters, Vec::new());
    let free = Sources {
        frames_per_second: 5.0,
        ..free
    };
    let (particles, ..) = run(&free, 20);
    assert!(particles.position.iter().any(|x| !domain.contains(at(x))));
}

/// A lid over the volume goes away after a second: the water that it covered then enters where
/// it is.
#[test]
fn water_waits_for_a_solid_that_moves() {
    let lid = [solid(&[bounds([-0.5; 3], [0.8; 3])])];
    let away = |_: usize, seconds: f64| Pose {
        centre: DVec3::new(0.0, if seconds > 1.0 { 3.0 } else { 0.0 }, 0.0),
        ..Pose::START
    };
    let solids = Solids {
        still: None,
        moving: &[&lid[0]],
        pose: &away,
    };
    let sources = with(vec![nozzle(DVec3::new(2.0, 0.0, 0.0))], Vec::new());
    let (.., exchanges) = meeting(&sources, &solids, 75);
    let entered = |of: &[Exchange]| of.iter().map(|it| it.entered).sum::<u64>();
    assert_eq!(entered(&exchanges[..25]), 0);
    // Four layers are in the volume; as a control, all that came until then are blocked.
    let first = exchanges[25].entered;
    assert!((24..=30).contains(&first), "{first}");
    assert_eq!(entered(&exchanges), 240 + 24);
    let blocked: u64 = exchanges.iter().map(|it| it.blocked).sum();
    assert_eq!(entered(&exchanges) + blocked, 360);
}

/// The prediction for a mesh uses its own cross-section; a line that crosses the mesh twice brings
/// its water once.
#[test]
fn a_mesh_is_promised_by_its_own_cross_section() {
    let ball = sphere(DVec3::splat(0.5), 0.4, 24);
    let emitter = Emitter {
        shape: Shape::of_mesh(&ball, D).unwrap(),
        ..nozzle(DVec3::new(1.0, 0.0, 0.0))
    };
    let sources = with(vec![emitter], Vec::new());
    let [Some(promise)] = sources.predicted_inflows(None)[..] else {
        panic!("one flow");
    };
    assert_eq!(promise.covered, 0.0);
    let (particles, ..) = run(&sources, 100);
    let promised = 4.0 * promise.rate / D.powi(3);
    // The rows' distances to the ball's face are a few spacings.
    let found = particles.len() as f64;
    assert!(
        found <= promised && found > 0.9 * promised,
        "{found} of {promised}"
    );
}

#[test]
fn the_slowest_flow_promises_next_to_nothing() {
    for speed in [1e-12, 1e-200, f64::MIN_POSITIVE, 5e-324] {
        let sources = with(vec![nozzle(DVec3::new(speed, 0.0, 0.0))], Vec::new());
        let [Some(promise)] = sources.predicted_inflows(None)[..] else {
            panic!("one flow");
        };
        assert!(
            promise.rate <= speed && promise.covered == 0.0,
            "{promise:?}"
        );
        assert_eq!(run(&sources, 10).0.len(), 0, "{speed}");
    }
}
