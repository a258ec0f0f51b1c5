//! Isolated drops in the air, where users put them: at round coordinates, at rest, in still
//! air and in wind.

use swell::{
    domain::{boundary::Boundary, particles::Particles},
    gpu::adapter::InjectedFault,
    scene::{Method, effects::drag},
    stage::{check::check_frame, prepare::Start},
};

use super::{lines, over};
use crate::support::{choose, context, flip as of_flip, pbf_of};

/// The positions are on faces and corners of cells of 0.1 m, the last one beside a wall.
#[test]
fn drops_at_round_places_are_within_tolerance_and_a_fault_in_drag_is_seen() {
    let context = context();
    for method in [Method::Flip, Method::Pbf] {
        let (pass, row, [from, to]) = match method {
            Method::Flip => (
                "effects/drag_by_cells",
                ("effects/drag_by_cells", "velocity"),
                ["share, params.kick)", "share, 0.99 * params.kick)"],
            ),
            Method::Pbf => (
                "effects/drag_by_density",
                ("effects/drag_by_density", "velocity"),
                [
                    "share, params.time_step)",
                    "share, 0.99 * params.time_step)",
                ],
            ),
        };
        for (drop_radius, wind) in [
            (1e-5, [0.0; 3]),
            (5e-4, [0.0; 3]),
            (1e-3, [12.0, 0.0, -3.0]),
        ] {
            let mut scene = of_flip::scene([16.0, 40.0, 8.0]);
            let pbf = pbf_of(&mut scene);
            pbf.particle_spacing = of_flip::DX / 2.0;
            pbf.grid_projection = true;
            choose(&mut scene, method);
            scene.effects.drag = Some(drag::Settings { drop_radius, wind });
            let start = Start {
                particles: Particles {
                    id: (0..4).collect(),
                    position: vec![
                        [0.3, 3.3, 0.4],
                        [0.7, 3.1, 0.35],
                        [1.1, 2.05, 0.4],
                        [0.04, 3.7, 0.1],
                    ],
                    velocity: vec![[0.0; 3], [0.0; 3], [1.0, -0.5, 0.0], [0.0; 3]],
                    // A quarter of this substep's length: FLIP's drag acts for half of both.
                    substep: 0.25 * scene.shot.frame_seconds(),
                    ..Particles::default()
                },
                removed: 0,
                asked: None,
                sources: Default::default(),
                boundary: Boundary::default(),
            };
            let checked =
                |context: &_| check_frame(context, &scene, &start, 0, &start.particles).unwrap();
            let clean = checked(&context);
            assert!(
                over(&clean).is_empty(),
                "{method:?} {drop_radius}: {}",
                lines(&clean)
            );
            // Negative controls: 1 % less of the time that drag acts, and with FLIP only
            // this substep's time.
            let mut spoils = vec![[from, to]];
            if method == Method::Flip {
                spoils.push([from, "share, params.time_step)"]);
            }
            for [from, to] in spoils {
                let mut spoiled = context.clone();
                spoiled.spoil = Some(InjectedFault { pass, from, to });
                let found = checked(&spoiled);
                assert!(
                    over(&found).contains(&row),
                    "{method:?} {drop_radius} {to}: {}",
                    lines(&found)
                );
            }
        }
    }
}
