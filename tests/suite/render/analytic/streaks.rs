//! Motion blur by rays: each ray has a time of its own, at which it meets water and solids.

use glam::DVec3;
use swell::domain::mesh::TriangleMesh;
use swell::domain::particles::Particles;
use swell::domain::pose::Pose;
use swell::gpu::adapter::Context;
use swell::render::{Image, Mover, PosePath, RenderScene, SetMotion};

use super::support::{Eye, Setup, ball, context, draw, scene, spoiled, uniform_sky};

/// Radius of the balls, metres and pixels, and the length of their streaks, pixels.
const RADIUS: f64 = 0.4;
const RADIUS_PX: f64 = 14.0;
const STREAK: f64 = 40.0;
const SHUTTER: f64 = 0.5;
/// Seconds for which the shutter is open, at 24 frames a second.
const OPEN: f64 = SHUTTER / 24.0;
const CENTRE: DVec3 = DVec3::splat(5.0);
const SIDE: u32 = 72;
/// Speed of the camera from frame 1 to 2 over that of the balls: it moves from the frame on, and as
/// slowly at first as Hermite's curve, by 10 of 64 parts in a quarter of the way, over 20 pixels.
const FASTER: f64 = 1.6;

/// The camera before the box, which sees a metre as 35 pixels times `scale`, and the sky behind the
/// balls.
fn eye(scale: u32) -> Eye {
    let position = DVec3::new(5.0, 2.5, -15.0);
    let focal = f64::from(scale) * position.distance(CENTRE) * RADIUS_PX / RADIUS;
    Eye {
        size: SIDE * scale,
        ..Eye::new(position.to_array(), CENTRE.to_array(), focal)
    }
}

/// Velocity along the picture's rows, m/s.
fn velocity() -> DVec3 {
    DVec3::X * (STREAK * RADIUS / RADIUS_PX / OPEN)
}

/// A ball of meridians and parallels; its faces lie within 0.2 % of the radius of the sphere.
fn sphere() -> TriangleMesh {
    const ACROSS: usize = 64;
    const DOWN: usize = 32;
    let vertex = |k: usize| {
        let (polar, turn) = (k / ACROSS, k % ACROSS);
        let (up, along) = (std::f64::consts::PI * polar as f64 / DOWN as f64).sin_cos();
        let (sin, cos) = (std::f64::consts::TAU * turn as f64 / ACROSS as f64).sin_cos();
        CENTRE + RADIUS * DVec3::new(up * cos, along, up * sin)
    };
    let at = |polar: usize, turn: usize| (polar * ACROSS + turn % ACROSS) as u32;
    let quads = (0..DOWN).flat_map(|p| (0..ACROSS).map(move |t| (p, t)));
    TriangleMesh {
        vertices: (0..(DOWN + 1) * ACROSS).map(vertex).collect(),
        triangles: quads
            .flat_map(|(p, t)| {
                let [a, b, c, d] = [at(p, t), at(p, t + 1), at(p + 1, t + 1), at(p + 1, t)];
                [[a, b, c], [a, c, d]]
            })
            .collect(),
    }
}

/// What moves across the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Moves {
    Water,
    Solid,
    /// The camera, before a ball of water at rest.
    Camera,
}

fn shot(context: &Context, moves: Moves, samples: u32, shutter: f64) -> Image {
    scaled(1, context, moves, (samples, shutter))
}

fn scaled(scale: u32, context: &Context, moves: Moves, (samples, shutter): (u32, f64)) -> Image {
    let eye = eye(scale);
    let next = Eye {
        position: eye.position - FASTER * velocity() / 24.0,
        target: eye.target - FASTER * velocity() / 24.0,
        ..eye
    };
    let setup = Setup {
        samples,
        shutter,
        method: "ray",
        next: (moves == Moves::Camera).then_some(next),
        // The voxels of a ball of one particle are as fine as its surface needs: 3 pixels, where
        // the sphere lies 0.07 pixels off its chords.
        surface: "voxels_per_spacing = 8.0\n".to_owned(),
        background: false,
        ..Setup::new(eye)
    };
    let water = match moves {
        Moves::Water => ball(CENTRE, velocity()),
        Moves::Camera => ball(CENTRE, DVec3::ZERO),
        Moves::Solid => Particles::default(),
    };
    let mut set = scene(RADIUS, 1.0);
    if moves == Moves::Solid {
        set = RenderScene {
            solids: vec![sphere()],
            moving: vec![SetMotion {
                mover: Mover::Solid(0),
                path: PosePath::new(|t| Pose {
                    centre: velocity() * t,
                    ..Pose::START
                }),
            }],
            ..set
        };
    }
    draw(context, &setup, &uniform_sky, &set, &water, 1)
}

/// Fraction of the open time for which a disc that crosses the picture covers a pixel, whose edge
/// counts as a pixel wide.
fn expected([x, y]: [f64; 2], (radius, streak): (f64, f64)) -> f64 {
    const INSTANTS: usize = 1000;
    let covered = |k: usize| {
        let shift = ((k as f64 + 0.5) / INSTANTS as f64 - 0.5) * streak;
        (radius - (x + shift).hypot(y) + 0.5).clamp(0.0, 1.0)
    };
    (0..INSTANTS).map(covered).sum::<f64>() / INSTANTS as f64
}

/// Largest difference between what a picture and a streak cover, in the rows where a hundredth of
/// the disc's radius is less than a pixel of its chord.
fn worst(image: &Image, disc: (f64, f64)) -> f64 {
    let side = SIDE as usize;
    let pixels = image.beauty.iter().enumerate();
    let off = pixels.filter_map(|(k, value)| {
        let at = [k % side, k / side].map(|c| c as f64 + 0.5 - 0.5 * f64::from(SIDE));
        let is_in = at[1].abs() < 0.8 * RADIUS_PX;
        is_in.then(|| (f64::from(value[3]) - expected(at, disc)).abs())
    });
    off.fold(0.0, f64::max)
}

/// Radius of a ball at rest, pixels, by the area of its disc. A particle's surface is that of its
/// kernel between voxels.
fn radius(moves: Moves) -> f64 {
    let image = shot(&context(), moves, 64, 0.0);
    let area: f64 = image.beauty.iter().map(|value| f64::from(value[3])).sum();
    let radius = (area / std::f64::consts::PI).sqrt();
    assert!(
        (radius / RADIUS_PX - 1.0).abs() < 0.03,
        "{moves:?}: {radius}"
    );
    radius
}

/// Samples of the pictures that are compared with a streak: each of the two edges that cross a
/// pixel is known to a sample's share of the time, and its crossing to another one's; and the disc
/// is known to a tenth of a pixel at either edge.
const MANY: u32 = 400;
const WITHIN: f64 = 4.0 / MANY as f64 + 0.2 / STREAK;

/// Takes half a minute: a per cent wants hundreds of samples.
#[test]
fn a_ball_leaves_the_streak_of_its_disc() {
    let of_water = radius(Moves::Water);
    for (moves, radius) in [
        (Moves::Water, of_water),
        (Moves::Solid, radius(Moves::Solid)),
    ] {
        let image = shot(&context(), moves, MANY, SHUTTER);
        let found = worst(&image, (radius, STREAK));
        assert!(found < WITHIN, "{moves:?}: {found}");
        // Controls: a streak that is longer by a tenth, and none.
        for (streak, least) in [(1.1 * STREAK, 0.02), (0.0, 0.2)] {
            let found = worst(&image, (radius, streak));
            assert!(found > least, "{moves:?} {streak}: {found}");
        }
    }
    // The time range off by a tenth, of water and of a solid.
    let import = "own_since = moments[index].since";
    let longer = spoiled(
        "rays/cast",
        import,
        "own_since = 1.1 * moments[index].since",
    );
    let image = shot(&longer, Moves::Water, MANY, SHUTTER);
    let found = worst(&image, (of_water, STREAK));
    assert!(found > 2.0 * WITHIN, "{found}");
}

/// Area of what a picture shows, pixels, and its variance along the rows, pixels².
fn moments(image: &Image, side: usize) -> [f64; 2] {
    let pixels = image.beauty.iter().enumerate();
    let sums = pixels.fold([0.0; 3], |[area, first, second], (k, value)| {
        let (x, alpha) = ((k % side) as f64, f64::from(value[3]));
        [area + alpha, first + alpha * x, second + alpha * x * x]
    });
    let [area, first, second] = sums;
    [area, second / area - (first / area).powi(2)]
}

/// With one sample each pixel sees the ball at its own time of the whole shutter: as many see it
/// as its disc has pixels, N, and their places vary by r²/4 of the disc and s²/12 of the streak s.
/// A sum of N of them is off by √N at most, and their variance by √(2/N) of it, since neither a
/// disc nor a streak has as heavy tails as a normal distribution; three times as much is allowed.
#[test]
fn the_rays_of_one_sample_have_all_times() {
    const SCALE: u32 = 3;
    let off = |context: &Context, moves: Moves| {
        let pixels = f64::from(SCALE);
        let image = scaled(SCALE, context, moves, (1, SHUTTER));
        let [area, variance] = moments(&image, (SIDE * SCALE) as usize);
        let radius = pixels * radius(moves);
        let disc = std::f64::consts::PI * radius * radius;
        let expected = 0.25 * radius * radius + (pixels * STREAK).powi(2) / 12.0;
        let allowed = [3.0 * disc.sqrt(), 3.0 * expected * (2.0 / disc).sqrt()];
        println!("{moves:?}: {area:.0} of {disc:.0} px, {variance:.0} of {expected:.0} px²");
        [
            (area - disc).abs() / allowed[0],
            (variance - expected).abs() / allowed[1],
        ]
    };
    for moves in [Moves::Water, Moves::Solid] {
        let off = off(&context(), moves);
        assert!(off.iter().all(|off| *off < 1.0), "{moves:?}: {off:?}");
    }
    // Control: triangles that go a tenth too far along their way.
    let farther = spoiled(
        "rays/cast",
        "own_part = moments[index].part;",
        "own_part = 1.1 * moments[index].part;",
    );
    let off = off(&farther, Moves::Solid);
    assert!(off[1] > 1.0, "{off:?}");
}

/// Largest correlation of the difference between two pictures, at up to six pixels, in standard
/// deviations of independent values; over the middle rows of the streak, where it is not its own
/// edge.
fn rings(image: &Image, truth: &Image) -> f64 {
    const FAR: i32 = 6;
    let side = SIDE as i32;
    let rows = (side / 2 - 9)..(side / 2 + 9);
    let at = |x: i32, y: i32| {
        let is_in = (0..side).contains(&x) && rows.contains(&y);
        let k = (y * side + x) as usize;
        let [found, truth] = [image, truth].map(|it| it.beauty.get(k).map(|v| f64::from(v[3])));
        let truth = truth.filter(|truth| is_in && (0.02..0.98).contains(truth))?;
        Some(found? - truth)
    };
    let lags = (0..=FAR).flat_map(|dy| (-FAR..=FAR).map(move |dx| (dx, dy)));
    let lags = lags.filter(|&(dx, dy)| dy > 0 || dx > 0);
    let correlation = |(dx, dy): (i32, i32)| {
        let (mut count, mut ab, mut aa, mut bb) = (0.0f64, 0.0, 0.0, 0.0);
        for (x, y) in (0..side).flat_map(|x| rows.clone().map(move |y| (x, y))) {
            if let (Some(a), Some(b)) = (at(x, y), at(x + dx, y + dy)) {
                count += 1.0;
                ab += a * b;
                aa += a * a;
                bb += b * b;
            }
        }
        assert!(count > 100.0, "{count}");
        ab / (aa * bb).sqrt() * count.sqrt()
    };
    lags.map(correlation).fold(0.0, f64::max)
}

/// The largest of 84 independent normal values exceeds this in one of ten thousand.
const NOISE: f64 = 4.9;

/// Takes half a minute: the truth has 256 samples, of three things that move.
#[test]
fn eight_samples_leave_noise_and_no_rings() {
    for moves in [Moves::Water, Moves::Solid, Moves::Camera] {
        let truth = shot(&context(), moves, 256, SHUTTER);
        let found = rings(&shot(&context(), moves, 8, SHUTTER), &truth);
        assert!(found < NOISE, "{moves:?}: {found}");
        // Control: all rays of a sample at the same time, as rigid copies of the scene.
        let copies = spoiled(
            "rays/cast",
            "moments[0].seed))) >> 26u",
            "moments[0].seed))) >> 31u",
        );
        let found = rings(&shot(&copies, moves, 8, SHUTTER), &truth);
        assert!(found > 2.0 * NOISE, "{moves:?}: {found}");
    }
}

/// Depths at the frame's instant are those of a closed shutter; a millimetre is far more than the
/// order of operations, which is the compiler's, can change.
#[test]
fn channels_are_at_the_frame_s_instant_with_an_open_shutter() {
    let depths =
        |context: &Context, shutter: f64| shot(context, Moves::Water, 2, shutter).aovs.z.unwrap();
    let closed = depths(&context(), 0.0);
    let others = |found: Vec<f32>| {
        let pairs = found.into_iter().zip(&closed);
        pairs.filter(|(a, b)| (a - **b).abs() > 1e-3).count()
    };
    // A ray that only just touches the ball may miss it.
    assert!(others(depths(&context(), SHUTTER)) <= 4);
    // Control: rays a thousandth of a second late.
    let late = "own_since = moments[index].since + 1e-3";
    let late = spoiled("rays/aovs", "own_since = moments[index].since", late);
    assert!(others(depths(&late, SHUTTER)) > 100);
}

/// With a closed shutter no pass has moments.
#[test]
fn a_closed_shutter_costs_nothing() {
    let [open, closed] = [SHUTTER, 0.0].map(|shutter| {
        let setup = Setup {
            shutter,
            method: "ray",
            ..Setup::new(eye(1))
        };
        let scene = scene(RADIUS, 1.0);
        let renderer = super::support::renderer(&context(), &setup, &uniform_sky, &scene, 64);
        let buffers = renderer.plan().buffers.iter();
        let names: Vec<String> = buffers.map(|buffer| buffer.name.clone()).collect();
        names.contains(&"moments".to_owned())
    });
    assert!(open && !closed);
}
