//! `check` passes on what the device computes, and each of its rows fails if its pass is spoiled.
mod arithmetic;
mod coincident;
mod controls;
mod drops;
mod films;
mod forces;
mod frames;
mod gaps;
mod imprecise;
mod periodic;
mod quay;
mod shapes;
mod straight;
mod upward;
mod viscous;
mod whitewater;

use swell::{
    check::check_pbf,
    domain::{
        bounds::Bounds,
        motion::{Motion, Spectrum},
        particles::Particles,
        sampling::BoundarySample,
        signed_distance::SignedDistance,
        sources::{Emitter, Window},
        substep::SubstepChoice,
    },
    gpu::adapter::{Context, InjectedFault, Needs},
    scene::{
        Effects, Iteration, Method, Scene, Stop, Wall, WaveMaker,
        effects::{
            absorbing_zone, drag, generation_zone, surface_tension, viscosity,
            vorticity_confinement,
        },
        flip::{Precision, Preconditioner, Pressure, Surface, Transfer},
        open_waves,
        sources::Region,
    },
    solve::{
        SolveError,
        plan::{DeviceLimits, device_limits},
    },
    stage::{
        check::{CheckTable, check_frame},
        prepare::Start,
    },
};

use crate::support::{self, D, choose, context, flip_of, jitter, lattice, noise, pbf_of};
use controls::{
    Control, control,
    flip::FLIP,
    pbf::{CHUNKED, PBF, PBF_WALLS, SEARCHED},
    tension::TENSION,
    variants::{VARIANTS, Variant},
    walls::FLIP_WALLS,
};
use glam::DVec3;

/// A floor at 0.23 m as a solid, which cuts cells.
fn floor() -> (Vec<BoundarySample>, SignedDistance) {
    let samples = (0..144).map(|k| BoundarySample {
        position: DVec3::new(
            0.1 * f64::from(k % 12) + 0.05,
            0.23,
            0.1 * f64::from(k / 12) + 0.05,
        ),
        normal: DVec3::Y,
        area: 0.01,
    });
    let dims = [16, 10, 16];
    let value = |k: usize| (0.1 * (k / 16 % 10) as f64 - 0.1 - 0.23) as f32;
    let distance = SignedDistance {
        origin: DVec3::new(-0.15, -0.1, -0.15),
        spacing: 0.1,
        dims,
        values: (0..dims.iter().product()).map(value).collect(),
    };
    (samples.collect(), distance)
}

/// So small that corrections take particles past the displacement cap.
const CFL: f64 = 0.1;

/// Moving water of 8 × 6 × 7 particles over a floor, compressed, in a box of more than
/// one block of cells.
fn case(method: Method) -> (Scene, Start) {
    let mut scene = support::scene([1.6, 6.4, 1.6]);
    scene.unchosen = Some(swell::scene::Solver::Flip(swell::scene::flip::Flip {
        cell_size: 2.0 * D,
        particles_per_cell: 8,
        transfer: Transfer::Flip,
        pic_blend: 0.05,
        cfl: CFL,
        max_substeps: 32,
        surface: Surface::GhostFluid,
        density_correction: true,
        band: None,
        pressure: Pressure {
            preconditioner: Preconditioner::Multigrid,
            precision: Precision::F32Refined,
            tolerance: 1e-5,
            max_iterations: 40,
        },
    }));
    choose(&mut scene, method);
    scene.effects.viscosity = Some(viscosity::Settings::xsph(0.1));
    scene.effects.vorticity_confinement = Some(vorticity_confinement::Settings { strength: 1.0 });
    scene.effects.drag = Some(drag::Settings {
        drop_radius: 1e-3,
        wind: [5.0, 1.0, -2.0],
    });
    // Zones lead towards it.
    scene.water.current = DVec3::new(0.3, 0.0, -0.2);
    // From both ends, and longer than the water.
    scene.effects.absorbing_zone = Some(absorbing_zone::Settings {
        walls: vec![Wall::NAMED[0].1, Wall::NAMED[5].1],
        length: 1.3,
        period: 0.3,
    });
    scene.effects.generation_zone = Some(generation_zone::Settings {
        walls: vec![Wall::NAMED[1].1],
        length: 1.4,
        waves: open_waves::Waves::Sea(open_waves::Sea {
            significant_height: 0.2,
            seed: 1,
            spectrum: Spectrum::Jonswap,
            peak_enhancement: None,
            peak_period: 0.8,
            shortest_period: None,
            depth: 1.0,
            simulated_depth: None,
            ramp: Some(0.0),
            direction_degrees: 20.0,
            spreading: Some(10.0),
        }),
    });
    if method == Method::Flip {
        // A part of the water, which is too dense, counts as having just entered.
        scene.emitters.push(Emitter {
            shape: Region::Block(Bounds {
                min: DVec3::ZERO,
                max: DVec3::new(0.4, 6.4, 1.6),
            }),
            velocity: DVec3::X,
            level: None,
            window: Window::default(),
        });
    }
    pbf_of(&mut scene).cfl = CFL;
    let mut particles = lattice([-0.01, 0.2, -0.01], [8, 6, 7], [0.9 * D; 3]);
    jitter(&mut particles, 0.02 * D);
    for (k, v) in particles.velocity.iter_mut().enumerate() {
        *v = std::array::from_fn(|axis| noise(3 * k as u64 + axis as u64 + 7) as f32);
    }
    let (samples, distance) = floor();
    let start = Start {
        particles,
        removed: 0,
        asked: None,
        sources: Default::default(),
        boundary: swell::domain::boundary::Boundary {
            samples: if method == Method::Pbf {
                samples
            } else {
                Vec::new()
            },
            distance: Some(distance),
            ..Default::default()
        },
    };
    (scene, start)
}

fn run(context: &Context, scene: &Scene, start: &Start) -> CheckTable {
    check_frame(context, scene, start, 0, &start.particles).unwrap()
}

fn over(table: &CheckTable) -> Vec<(&'static str, &'static str)> {
    let rows = table.rows.iter().filter(|row| !row.is_within());
    rows.map(|row| (row.field.pass, row.field.name)).collect()
}

fn lines(table: &CheckTable) -> String {
    let line = |row: &swell::check::CheckRow| {
        format!(
            "{} {}: {} values, {} ties, {} over, {:?}\n",
            row.field.pass, row.field.name, row.values, row.ties, row.over, row.worst
        )
    };
    table.rows.iter().map(line).collect()
}

/// Rows that faults of other passes may affect too: they depend on everything.
const FOLLOW: [&str; 3] = ["whole solve", "whole projection", "whole correction"];

/// A check, on a context whose shaders may be spoiled.
type Checked<'a> = dyn Fn(&Context) -> Result<CheckTable, SolveError> + 'a;

/// Returns the clean table, and the controls that are not detected where they should be,
/// or elsewhere too.
fn faults(context: &Context, checked: &Checked<'_>, controls: &[Control]) -> (CheckTable, String) {
    let clean = checked(context).unwrap();
    // Faults in rows that are out of tolerance already would prove nothing.
    assert!(over(&clean).is_empty(), "{}", lines(&clean));
    let mut faults = String::new();
    let unknown = |(_, why): &&(&str, &str)| *why == "no reference pass";
    if let Some(pass) = clean.unchecked.iter().find(unknown) {
        faults += &format!("{pass:?}\n");
    }
    for Control {
        spoil,
        pass,
        fields,
        follow,
    } in controls
    {
        let mut spoiled = context.clone();
        spoiled.spoil = Some(*spoil);
        let table = match checked(&spoiled) {
            Ok(table) => table,
            Err(error) => {
                faults += &format!("{spoil:?}: {error}\n");
                continue;
            }
        };
        let found = over(&table);
        let is_seen = fields.iter().all(|field| found.contains(&(*pass, *field)));
        // Each pass is given the device's own inputs, so no fault spreads.
        let is_alone = found
            .iter()
            .all(|(other, _)| other == pass || FOLLOW.contains(other) || follow.contains(other));
        if !is_seen || !is_alone {
            faults += &format!("{spoil:?}: {found:?}\n");
        }
    }
    (clean, faults)
}

/// Asserts that every row has a control that is detected. Passes of `elsewhere` have their controls
/// in another test.
fn hold(context: &Context, scene: &Scene, start: &Start, controls: &[Control], elsewhere: &[&str]) {
    let checked = |context: &Context| check_frame(context, scene, start, 0, &start.particles);
    let (clean, mut faults) = faults(context, &checked, controls);
    let covered = |row: &swell::check::CheckRow| {
        let field = row.field;
        let is_of =
            |control: &Control| control.pass == field.pass && control.fields.contains(&field.name);
        // No gap closes in these cases: see `gaps`.
        let is_of_gaps = field.pass == "flip/close_gaps";
        controls.iter().any(is_of) || elsewhere.contains(&field.pass) || is_of_gaps
    };
    for row in clean.rows.iter().filter(|row| !covered(row)) {
        faults += &format!("no control: {} {}\n", row.field.pass, row.field.name);
    }
    assert!(faults.is_empty(), "{faults}");
}

#[test]
fn pbf_is_within_tolerance_and_each_row_fails_where_it_should() {
    let (scene, start) = case(Method::Pbf);
    let context = context();
    hold(&context, &scene, &start, PBF, &["upload of solids"]);
    let clean = run(&context, &scene, &start);
    assert!(clean.unchecked.is_empty(), "{:?}", clean.unchecked);

    // A solid at another position than the reference's.
    let mut moved = start.boundary.clone();
    moved.samples[3].position.x += 1e-6;
    moved.samples[4].area *= 1.00001;
    let plan = start.plan(&scene, device_limits(&context));
    let boundaries = [&start.boundary, &moved];
    let state = (0, &start.particles);
    let first = SubstepChoice::default();
    let checked = check_pbf(
        &context,
        &scene.with_pbf().unwrap(),
        plan,
        boundaries,
        state,
        first,
    )
    .unwrap();
    let found = over(&checked.table);
    assert!(
        found.contains(&("upload of solids", "sample positions")),
        "{found:?}"
    );
    assert!(
        found.contains(&("upload of solids", "sample weights")),
        "{found:?}"
    );
}

#[test]
fn pbf_with_a_projection_is_within_tolerance_and_fails_where_it_should() {
    let (mut scene, start) = case(Method::Pbf);
    pbf_of(&mut scene).grid_projection = true;
    scene.effects.surface_tension = Some(surface_tension::Settings { coefficient: 50.0 });
    let controls = [
        control(
            "flip/aim",
            "params.time_step * beside",
            "params.time_step * beside * 1.001",
            "flip/aim",
            &["position"],
        ),
        control(
            "pbf/predict",
            "select(stopped(v, free), v + taken, is_drop[thread] > 0.0)",
            "select(v, v + taken, is_drop[thread] > 0.0)",
            "pbf/predict",
            &["velocity"],
        ),
        control(
            "pbf/update_velocity",
            "v *= own_is_drop;",
            "v *= 1.0 - own_is_drop;",
            "pbf/update_velocity",
            &["velocity"],
        ),
    ];
    let others: Vec<&str> = (PBF.iter().chain(FLIP).chain(TENSION))
        .map(|control| control.pass)
        .chain(["upload of solids"])
        .collect();
    hold(&context(), &scene, &start, &controls, &others);
}

#[test]
fn pbf_until_a_density_error() {
    let (mut scene, start) = case(Method::Pbf);
    let settings = pbf_of(&mut scene);
    settings.iteration = Iteration::Chebyshev;
    settings.relaxation = 0.7;
    settings.artificial_pressure = 0.1;
    settings.stop = Stop::DensityError {
        density_error: 0.04,
        max_iterations: 8,
    };
    let controls = [
        control(
            "pbf/sum_error",
            "max(density[i] - 1.0, 0.0)",
            "abs(density[i] - 1.0)",
            "pbf/sum_error",
            &["sums of density error"],
        ),
        control(
            "pbf/decide",
            "control.iterations += 1u",
            "control.iterations += 2u",
            "pbf/decide",
            &["done, iterations"],
        ),
        control(
            "pbf/compute_lambda",
            "density[i] = relative_density",
            "density[i] = relative_density * 1.0001",
            "pbf/compute_lambda",
            &["relative density"],
        ),
        control(
            "pbf/compute_delta",
            "(phase.acceleration - 1.0) * last",
            "phase.acceleration * last",
            "pbf/compute_delta",
            &["corrected position"],
        ),
        control(
            "pbf/compute_delta",
            "scale -= artificial_pressure",
            "scale += artificial_pressure",
            "pbf/compute_delta",
            &["corrected position"],
        ),
    ];
    let elsewhere: Vec<&str> = PBF.iter().map(|control| control.pass).collect();
    hold(
        &context(),
        &scene,
        &start,
        &controls,
        &[&elsewhere[..], &["upload of solids"]].concat(),
    );
}

#[test]
fn flip_is_within_tolerance_and_each_row_fails_where_it_should() {
    let (scene, start) = case(Method::Flip);
    let context = context();
    let sort = [
        "sort/scan_blocks",
        "sort/add_block_sums",
        "sort/place",
        "sort/stabilize",
    ];
    hold(&context, &scene, &start, FLIP, &sort);
}

/// Settings of FLIP beyond the common case, each with faults in the code that only it runs.
#[test]
fn flip_variants_are_within_tolerance_and_fail_where_they_should() {
    let context = context();
    let mut all = String::new();
    for Variant {
        name,
        change,
        controls,
    } in VARIANTS
    {
        println!("{name}");
        let (mut scene, mut start) = case(Method::Flip);
        scene.effects = Effects::default();
        change(&mut scene, &mut start);
        let checked = |context: &Context| check_frame(context, &scene, &start, 0, &start.particles);
        let (_, faults) = faults(&context, &checked, controls);
        if !faults.is_empty() {
            all += &format!("{name}:\n{faults}");
        }
    }
    assert!(all.is_empty(), "{all}");
}

/// Lists in several bindings, and none where they do not fit.
#[test]
fn pbf_lists_in_chunks_and_none() {
    let context = context();
    let (mut scene, start) = case(Method::Pbf);
    scene.effects = Effects::default();
    let limits = device_limits(&context);
    // A block of 512 lists takes 98 304 bytes.
    let chunked = DeviceLimits {
        binding: 110_000,
        ..limits
    };
    let mut many = start.clone();
    many.particles = lattice([-0.01, 0.2, -0.01], [16, 5, 14], [0.9 * D; 3]);
    jitter(&mut many.particles, 0.02 * D);
    // Without lists, and with positions in two bindings.
    let none = DeviceLimits {
        binding: 3_000,
        list_budget: 0,
        ..limits
    };
    let mut all = String::new();
    for (limits, start, chunks, has_lists, controls) in [
        (chunked, &many, 3, true, CHUNKED),
        (none, &start, 1, false, SEARCHED),
    ] {
        let plan = start.plan(&scene, limits);
        assert_eq!((plan.chunks.len(), plan.has_lists), (chunks, has_lists));
        assert_eq!(plan.page.is_some(), !has_lists);
        let checked = |context: &Context| pbf_table(context, &scene, start, limits);
        all += &faults(&context, &checked, controls).1;
    }
    assert!(all.is_empty(), "{all}");
}

/// Checks PBF on a device with these limits.
fn pbf_table(
    context: &Context,
    scene: &Scene,
    start: &Start,
    limits: DeviceLimits,
) -> Result<CheckTable, SolveError> {
    let boundaries = [&start.boundary; 2];
    let state = (0, &start.particles);
    let plan = start.plan(scene, limits);
    let first = SubstepChoice::default();
    Ok(check_pbf(
        context,
        &scene.with_pbf().unwrap(),
        plan,
        boundaries,
        state,
        first,
    )?
    .table)
}

/// The other precisions of the projection. f64 has the tolerances of its own roundoff: an error of
/// 1e-9 in a product fails, which f32 could not resolve.
#[test]
fn flip_is_within_tolerance_in_each_precision_of_its_projection() {
    let context = Context::open_for(None, Needs { f64: true })
        .expect("this test needs an adapter with f64, as lavapipe is");
    let (mut scene, start) = case(Method::Flip);
    let off = |factor| {
        control(
            "pressure/multiply",
            "pressure_correction[phase.stride + e] = product.lo[c]",
            factor,
            "pressure/multiply",
            &["system times direction"],
        )
        .and(&["pressure/reduce"])
    };
    let elsewhere: Vec<&str> = FLIP.iter().map(|control| control.pass).collect();
    let sort = ["sort/scan_blocks", "sort/add_block_sums", "sort/place"];
    let elsewhere = [&elsewhere[..], &sort, &["sort/stabilize"]].concat();
    let slight = "pressure_correction[phase.stride + e] = product.lo[c] * 1.000000001";
    let controls = [
        off(slight),
        control(
            "pressure/build_system",
            "row.dirichlet += air",
            "row.dirichlet += air * 1.000000001",
            "pressure/build_system",
            &["what air adds to the diagonal"],
        )
        .and(&["pressure/multiply", "pressure/verify"]),
    ];
    let precision = |scene: &mut Scene, precision| {
        flip_of(scene).pressure.precision = precision;
    };
    precision(&mut scene, Precision::F64);
    hold(&context, &scene, &start, &controls, &elsewhere);
    precision(&mut scene, Precision::F32);
    let gross = "pressure_correction[phase.stride + e] = product.lo[c] * 1.0001";
    hold(&context, &scene, &start, &[off(gross)], &elsewhere);
    // In f32 the slight fault vanishes: 1.000000001 rounds to 1.
    let mut spoiled = context.clone();
    spoiled.spoil = Some(off(slight).spoil);
    assert!(over(&run(&spoiled, &scene, &start)).is_empty());
}

/// The same water between walls that close in, and the work of these walls.
#[test]
fn work_of_moving_walls_is_within_tolerance_and_fails_where_it_should() {
    let context = context();
    for (method, still, walls) in [
        (Method::Pbf, PBF, PBF_WALLS),
        (Method::Flip, FLIP, FLIP_WALLS),
    ] {
        let (mut scene, start) = case(method);
        for (index, velocity) in [(0, 2.0), (5, 0.7)] {
            scene.wave_makers.push(WaveMaker {
                absorption: None,
                wall: Wall::NAMED[index].1,
                motion: Motion::ConstantVelocity {
                    velocity,
                    until: None,
                },
            });
        }
        let elsewhere: Vec<&str> = still.iter().map(|control| control.pass).collect();
        let others = [
            "upload of solids",
            "sort/scan_blocks",
            "sort/add_block_sums",
        ];
        let others = [&elsewhere[..], &others, &["sort/place", "sort/stabilize"]].concat();
        hold(&context, &scene, &start, walls, &others);
        let clean = run(&context, &scene, &start);
        let work = clean
            .rows
            .iter()
            .find(|row| row.field.name == "shares of the work");
        assert!(work.is_some_and(|row| row.values > 0), "{}", lines(&clean));
    }
}

/// A fault that no longer matches its shader is an error, not a control that passes.
#[test]
fn injected_fault_that_matches_no_shader_text_is_an_error() {
    let (scene, start) = case(Method::Pbf);
    let mut context = context();
    context.spoil = Some(InjectedFault {
        pass: "pbf/predict",
        from: "no such text",
        to: "",
    });
    let particles: &Particles = &start.particles;
    let error = check_frame(&context, &scene, &start, 0, particles).unwrap_err();
    assert!(error.to_string().contains("no such text"), "{error}");
}
