//! What enters and leaves, counted by hand.

use super::{super::mesh::tests::sphere, *};

const D: f64 = 0.1;

fn block(min: [f64; 3], max: [f64; 3]) -> Shape {
    let [min, max] = [min, max].map(DVec3::from_array);
    Shape::from(Bounds { min, max })
}

/// A nozzle 0.4 m long, 0.3 × 0.2 m wide.
fn nozzle(velocity: DVec3) -> Emitter<Shape> {
    Emitter {
        shape: block([0.0; 3], [0.4, 0.3, 0.2]),
        velocity,
        level: None,
        window: Window::default(),
    }
}

fn with(emitters: Vec<Emitter<Shape>>, drains: Vec<Drain<Shape>>) -> Sources {
    Sources {
        emitters,
        drains,
        spacing: D,
        frames_per_second: 25.0,
    }
}

/// All that enters until the end of a frame, where nothing moves it.
fn run(sources: &Sources, frames: u32) -> (Particles, u32, Vec<Exchange>) {
    let (mut particles, mut next_id) = (Particles::default(), 0);
    let exchanges = (1..=frames)
        .map(|frame| sources.exchange(frame, None, &mut particles, &mut next_id))
        .collect();
    (particles, next_id, exchanges)
}

/// 2 m/s through 3 × 2 places: after 3 s 6 m of water, 60 layers of 6, whatever a frame holds; and each on its place of one
/// lattice that moves, so that none is nearer to another than the spacing.
#[test]
fn a_flow_brings_velocity_times_cross_section() {
    let sources = with(vec![nozzle(DVec3::new(2.0, 0.0, 0.0))], Vec::new());
    let (particles, next_id, exchanges) = run(&sources, 75);
    assert_eq!((particles.len(), next_id), (360, 360));
    assert_eq!(particles.id, (0..360).collect::<Vec<_>>());
    let counts: Vec<u64> = exchanges.iter().map(|exchange| exchange.entered).collect();
    // 0.8 layers a frame: four frames of one, and one of none.
    assert!(counts.iter().all(|&n| n == 0 || n == 6), "{counts:?}");
    assert_eq!(counts[..5].iter().sum::<u64>(), 24, "{counts:?}");
    // Where the water flows as it came in, all of it is one lattice.
    let mut places: Vec<[i64; 3]> = Vec::new();
    let (mut particles, mut next_id) = (Particles::default(), 0);
    for frame in 1..=75 {
        for x in &mut particles.position {
            x[0] += 2.0 / 25.0;
        }
        sources.exchange(frame, None, &mut particles, &mut next_id);
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

/// Through a corner, water comes in by two faces: 0.3 × 0.2 m at 1 m/s, and 0.4 × 0.2 m at 0.5 m/s.
#[test]
fn an_oblique_flow_brings_what_its_faces_take() {
    let velocity = DVec3::new(1.0, 0.5, 0.0);
    let sources = with(vec![nozzle(velocity)], Vec::new());
    let (particles, ..) = run(&sources, 250);
    let expected = 10.0 * (0.3 * 0.2 + 0.5 * 0.4 * 0.2) / D.powi(3);
    let found = particles.len() as f64;
    // A layer of each face.
    assert!((found - expected).abs() < 20.0, "{found} of {expected}");
    let size = DVec3::new(0.4, 0.3, 0.2);
    assert!((10.0 * flow(size, velocity, D) / D.powi(3) - expected).abs() < 1e-9);
}

#[test]
fn what_passes_a_room_within_a_frame_is_too_fast_for_it() {
    let size = DVec3::new(0.4, 0.3, 0.2);
    assert!(is_long_enough(size, DVec3::new(10.0, 0.0, 0.0), 0.04));
    assert!(!is_long_enough(size, DVec3::new(10.1, 0.0, 0.0), 0.04));
    // And it is so: a tenth of a place more than the room is long goes missing.
    let count = |speed: f64| {
        let sources = with(vec![nozzle(DVec3::new(speed, 0.0, 0.0))], Vec::new());
        run(&sources, 250).0.len() as f64 / (speed * 10.0 / D * 6.0)
    };
    assert!((count(10.0) - 1.0).abs() < 1e-2, "{}", count(10.0));
    assert!(count(12.0) < 0.9, "{}", count(12.0));
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

/// A room half full of water that is packed at random gets what it lacks, block by block, and no more.
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
    let first = sources.exchange(1, None, &mut particles, &mut next_id);
    assert_eq!(first.entered, 8 * 8 * 4);
    assert_eq!(
        sources
            .exchange(2, None, &mut particles, &mut next_id)
            .entered,
        0
    );
    // Half a block leaves, and as much comes back, with ids of its own.
    let keep: Vec<bool> = (0..particles.len()).map(|k| k % 2 == 0).collect();
    particles.retain(&keep);
    let again = sources.exchange(3, None, &mut particles, &mut next_id);
    assert_eq!((again.entered, next_id), (128, 256 + 128));
    // Crowded particles are none too few.
    for x in &mut particles.position {
        *x = x.map(|x| (x / 0.2).floor() * 0.2 + 0.03);
    }
    assert_eq!(
        sources
            .exchange(4, None, &mut particles, &mut next_id)
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
                    .exchange(frame, None, &mut particles, &mut next_id)
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
    // 0.2 m³/s are 8 particles a frame, from all over the room.
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
    let found = sources.exchange(1, Some(&solid), &mut particles, &mut next_id);
    // Of four columns at 0.05 to 0.35, those half a spacing off the solid: 0.25 and 0.35.
    assert_eq!(found.entered, 6);
    assert_eq!(particles.id, [5, 6, 7, 8, 9, 10]);
    assert!(particles.position.iter().all(|x| x[0] > 0.24));
    assert_eq!(particles.attributes["affine"], [0.0; 6]);
}

/// A ball as a room: what enters is the ball's cross-section times the way.
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
    // Columns of places about the circle: Gauss's circle problem for a radius of four.
    assert!(
        (found / expected - 1.0).abs() < 0.05,
        "{found} of {expected}"
    );
    let far = |x: &[f32; 3]| (glam::Vec3::from_array(*x).as_dvec3() - 0.5).length();
    assert!(particles.position.iter().all(|x| far(x) < 0.41));
}
