//! Solids that extend past the eye: the part in front of it is complete.

use glam::DVec3;
use swell::domain::{bounds::Bounds, particles::Particles};
use swell::gpu::adapter::Context;
use swell::render::RenderScene;

use super::geometry::{box_mesh, enter};
use super::support::{Eye, Setup, context, renderer, scene, spoiled, uniform_sky};

const EYE: DVec3 = DVec3::new(5.0, 2.0, 5.0);

/// Two walls and a roof along z, 0.3 m from the eye and 80 m long.
fn walls() -> [Bounds; 3] {
    let wall = |low: [f64; 2], high: [f64; 2]| Bounds {
        min: DVec3::new(low[0], low[1], -35.0),
        max: DVec3::new(high[0], high[1], 45.0),
    };
    [
        wall([4.5, -1.0], [4.7, 2.2]),
        wall([5.3, -1.0], [5.5, 2.2]),
        wall([4.4, 2.3], [5.6, 2.4]),
    ]
}

/// What a ray meets first, if anything: its index, the normal of the face, and the distance.
fn first(along: DVec3) -> Option<(usize, DVec3, f64)> {
    let walls = walls().into_iter().enumerate();
    let met = walls.filter_map(|(index, wall)| {
        let (far, face) = enter(EYE, along, wall)?;
        Some((index, face, far))
    });
    let ground = (along.y < 0.0).then(|| (3, DVec3::Y, -EYE.y / along.y));
    met.chain(ground).min_by(|a, b| a.2.total_cmp(&b.2))
}

/// Number of pixels with a wrong depth, and number of pixels, among those whose neighbours see the
/// same face. Things nearer than `near` metres are rendered at that depth.
fn lost(context: &Context, near: f64, tile: u32) -> [usize; 2] {
    let scene = RenderScene {
        solids: walls().into_iter().map(box_mesh).collect(),
        // The near distance is 0.12 of the spacing.
        particle_spacing: near / 0.12,
        ..scene(0.1, 1.0)
    };
    let mut counts = [0; 2];
    for (right, up) in [-0.9, -0.3, 0.0, 0.4, 1.0]
        .into_iter()
        .flat_map(|right| [-0.7, 0.0, 0.5].map(|up| (right, up)))
    {
        let target = EYE + DVec3::new(right, up, 1.0);
        let eye = Eye {
            up: DVec3::new(0.2, 1.0, 0.1),
            ..Eye::new(EYE.to_array(), target.to_array(), 40.0)
        };
        let setup = Setup::new(eye);
        let mut renderer = renderer(context, &setup, &uniform_sky, &scene, tile);
        let image = renderer.render(1, &Particles::default()).unwrap();
        let depths = image.aovs.z.as_ref().unwrap();
        let side = eye.size as usize;
        let inner = (0..side * side)
            .filter(|i| (1..side - 1).contains(&(i % side)) && (1..side - 1).contains(&(i / side)));
        for i in inner {
            let seen = |i: usize| first(eye.direction(i));
            let face = |i: usize| seen(i).map(|(index, face, _)| (index, face));
            if [i - 1, i + 1, i - side, i + side]
                .iter()
                .any(|&j| face(j) != face(i))
            {
                continue;
            }
            let expected = match seen(i) {
                Some((.., far)) => near.max(far * eye.direction(i).dot(eye.forward())),
                None => 1e30,
            };
            // A face is 0.3 m away, and its corners 40 m away are in f32: 40 ε over 0.3 m, in some
            // 16 roundings.
            let rounding = 16.0 * 40.0 / 0.3 * f64::from(f32::EPSILON);
            let off = (f64::from(depths[i]) / expected - 1.0).abs();
            counts[0] += usize::from(off > rounding || off.is_nan());
            counts[1] += 1;
        }
    }
    counts
}

#[test]
fn what_is_before_the_eye_of_a_solid_that_passes_it_is_drawn() {
    // With the larger `near` the walls are nearer than the least depth.
    for (near, tile) in [(0.02, 4096), (0.6, 4096), (0.02, 32), (0.6, 32)] {
        let [off, all] = lost(&context(), near, tile);
        // Of 15 views of 62 × 62 pixels; the others are beside an edge.
        assert!(all > 40_000, "{all}");
        assert_eq!(off, 0, "of {all}, {near} m in tiles of {tile}");
    }
    // Controls: an edge is clipped at its end behind the eye, or only at the near distance.
    for (from, to, near) in [
        (
            "depths.x / (depths.x - depths.y)",
            "select(0.0, 1.0, depths.x > 0.0)",
            0.02,
        ),
        ("const CUT: f32 = 0.001", "const CUT: f32 = 1.0", 0.6),
    ] {
        let [off, _] = lost(&spoiled("ssfr/solid", from, to), near, 4096);
        assert!(off > 1000, "{to}: {off}");
    }
}
