//! Periodic domains: each pass that reads across a joint, with a fault in it.

use glam::DVec3;
use swell::{
    domain::boundary::Boundary,
    scene::{Effects, Method, Scene},
    solve::plan::{DeviceLimits, device_limits},
    stage::{
        check::{CheckTable, check_frame},
        prepare::Start,
    },
};

use super::{Control, case, control, faults, over, pbf_table};
use crate::support::{D, context, lattice, noise};

/// The common case around an edge of the box where two joints meet, with water on all sides of it.
fn across(method: Method) -> (Scene, Start) {
    let (mut scene, mut start) = case(method);
    scene.periodic = [true, false, true];
    scene.effects = Effects::default();
    let (period, way) = (scene.period(), DVec3::new(-0.3, 0.0, -0.3));
    for x in &mut start.particles.position {
        let there = DVec3::from_array(x.map(f64::from)) + way;
        *x = period.wrap(there).as_vec3().to_array();
    }
    (scene, start)
}

const FLIP: &[Control] = &[
    control(
        "flip/advect",
        "select(x, x - size * floor(x / size), is_periodic())",
        "select(x, x - size * floor(x / size), is_periodic() & (x < vec3f(-1e6)))",
        "flip/advect",
        &["position"],
    ),
    control(
        "flip/grid_to_particle",
        "select(to_before, vec3i(1), is_periodic())",
        "to_before",
        "flip/grid_to_particle",
        &["velocity"],
    ),
    control(
        "pressure/coarsen",
        "select(shared_by_both, 0.0, is_end)",
        "shared_by_both",
        "pressure/coarsen",
        &["coefficients"],
    ),
];

/// Faults in deep water, where some of the coarser levels' blocks are full.
const DEEP: &[Control] = &[control(
    "pressure/coarsen",
    "is_full && pressure_bricks[slot].faces[side] != 0u",
    "is_full",
    "pressure/coarsen",
    &["kind of block"],
)
.and(&[
    "pressure/restrict",
    "pressure/solve_coarse",
    "pressure/prolong",
])];

/// Water from end to end, two bricks deep. (With one brick, every coarser block touches the floor
/// or the surface.)
fn deep() -> (Scene, Start) {
    let (scene, mut start) = across(Method::Flip);
    start.boundary = Boundary::default();
    start.particles = lattice([0.0; 3], [16, 32, 16], [D; 3]);
    for (k, v) in start.particles.velocity.iter_mut().enumerate() {
        *v = std::array::from_fn(|axis| noise(3 * k as u64 + axis as u64 + 7) as f32);
    }
    (scene, start)
}

#[test]
fn flip_is_within_tolerance_across_joints_and_fails_where_it_should() {
    let mut all = String::new();
    for ((scene, start), controls) in [(across(Method::Flip), FLIP), (deep(), DEEP)] {
        let checked = |context: &_| check_frame(context, &scene, &start, 0, &start.particles);
        all += &faults(&context(), &checked, controls).1;
    }
    assert!(all.is_empty(), "{all}");
}

const PBF: &[Control] = &[
    control(
        "pbf/predict",
        "packed(wrapped_place(x))",
        "packed(x)",
        "pbf/predict",
        &["predicted position"],
    ),
    control(
        "pbf/assign_cells",
        "select(cell, (cell + dims) % dims",
        "select(cell, (cell + 1 + dims) % dims",
        "pbf/assign_cells",
        &["cell"],
    )
    .and(&["pbf/build_neighbors", "pbf/measure_density"]),
    control(
        "pbf/build_neighbors",
        "wrapped_cell(centre +",
        "(centre +",
        "pbf/build_neighbors",
        &["wrong members of a list"],
    ),
    control(
        "pbf/compute_lambda",
        "b - a > 0.5 * p",
        "b - a > 5.0 * p",
        "pbf/compute_lambda",
        &["lambda"],
    ),
    control(
        "pbf/compute_delta",
        "a - b > 0.5 * p",
        "a - b > 5.0 * p",
        "pbf/compute_delta",
        &["corrected position"],
    ),
    control(
        "pbf/update_velocity",
        "x = wrapped_place(x);",
        "",
        "pbf/update_velocity",
        &["position"],
    ),
    control(
        "pbf/measure_density",
        "wrapped_cell(centre +",
        "(centre +",
        "pbf/measure_density",
        &["relative density"],
    ),
];

/// With lists, and with a search in each pass.
#[test]
fn pbf_is_within_tolerance_across_joints_and_fails_where_it_should() {
    let (scene, start) = across(Method::Pbf);
    let context = context();
    let limits = device_limits(&context);
    let none = DeviceLimits {
        list_budget: 0,
        ..limits
    };
    let searched: Vec<Control> = (PBF.iter())
        .filter(|control| control.pass != "pbf/build_neighbors")
        .map(
            |&Control {
                 spoil,
                 pass,
                 fields,
                 follow,
             }| Control {
                spoil,
                pass,
                fields,
                follow,
            },
        )
        .collect();
    let mut all = String::new();
    for (limits, controls) in [(limits, PBF), (none, &searched[..])] {
        let checked =
            |context: &_| -> Result<CheckTable, _> { pbf_table(context, &scene, &start, limits) };
        all += &faults(&context, &checked, controls).1;
    }
    assert!(all.is_empty(), "{all}");
}

/// The effects' passes as well.
#[test]
fn effects_are_within_tolerance_across_joints_and_fail_where_they_should() {
    let context = context();
    let (pbf, flip) = (across(Method::Pbf), across(Method::Flip));
    let controls = [
        control(
            "effects/viscosity_gather",
            "a - b > 0.5 * p",
            "a - b > 5.0 * p",
            "effects/viscosity_gather",
            &[],
        ),
        control(
            "effects/vorticity_curl",
            "a - b > 0.5 * p",
            "a - b > 5.0 * p",
            "effects/vorticity_curl",
            &[],
        ),
        control(
            "effects/vorticity_force",
            "a - b > 0.5 * p",
            "a - b > 5.0 * p",
            "effects/vorticity_force",
            &[],
        ),
    ];
    for ((mut scene, start), controls) in [(pbf, &controls[..]), (flip, &[])] {
        scene.effects = case(scene.solver.method()).0.effects;
        let checked = |context: &_| check_frame(context, &scene, &start, 0, &start.particles);
        let (clean, mut all) = faults(&context, &checked, controls);
        for Control { spoil, pass, .. } in controls {
            let mut spoiled = context.clone();
            spoiled.spoil = Some(*spoil);
            let table = checked(&spoiled).unwrap();
            if !over(&table).iter().any(|(other, _)| other == pass) {
                all += &format!("{spoil:?} is not seen\n");
            }
        }
        assert!(all.is_empty(), "{all}");
        assert!(over(&clean).is_empty());
    }
}
