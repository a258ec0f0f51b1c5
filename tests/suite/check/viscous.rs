//! A viscous solve among no-slip walls, a floor of samples and air.

use swell::scene::{Method, Wall, effects::viscosity};

use super::{FLIP, case, control, hold};
use crate::support::context;

#[test]
fn a_viscous_solve_is_within_tolerance_and_each_row_fails_where_it_should() {
    let (mut scene, start) = case(Method::Flip);
    scene.effects.viscosity = Some(viscosity::Settings::newtonian(50.0));
    // Some walls are no-slip, others free-slip.
    scene.no_slip = [0, 2, 5].map(|k| Wall::NAMED[k].1).to_vec();
    let (weigh, relax) = ("effects/viscosity_weigh", "effects/viscosity_relax");
    let edges: &[&str] = &["faces and edges"];
    let controls = [
        control(
            weigh,
            "weight_a == 3u || weight_b == 3u",
            "weight_a == 3u",
            weigh,
            edges,
        ),
        control(
            weigh,
            "closed.x + closed.y == 2u",
            "closed.x + closed.y == 3u",
            weigh,
            edges,
        ),
        control(weigh, "moves && is_whole", "moves", weigh, edges),
        control(
            weigh,
            "viscous_start[face] = face_velocity[face]",
            "viscous_start[face] = face_velocity[face] * 1.001",
            weigh,
            &["velocity at the start"],
        ),
        control(
            weigh,
            "viscous_pressure[element] = pressure[element]",
            "viscous_pressure[element] = 0.5 * pressure[element]",
            weigh,
            &["pressure before"],
        ),
        control(
            relax,
            "lower.x - upper.x",
            "lower.x - 0.999 * upper.x",
            relax,
            &["velocity at faces", "change of it"],
        ),
        control(
            relax,
            "viscous_gain.z * viscous_change[face], 0.0",
            "0.9 * viscous_gain.z * viscous_change[face], 0.0",
            relax,
            &["velocity at faces", "change of it"],
        ),
        control(
            "effects/viscosity_pressure",
            "+= viscous_pressure[element]",
            "+= 0.999 * viscous_pressure[element]",
            "effects/viscosity_pressure",
            &["pressure"],
        ),
    ];
    // Sorting has its controls elsewhere.
    let others: Vec<&str> = (FLIP.iter().map(|control| control.pass))
        .chain([
            "sort/scan_blocks",
            "sort/add_block_sums",
            "sort/place",
            "sort/stabilize",
        ])
        .collect();
    hold(&context(), &scene, &start, &controls, &others);
}
