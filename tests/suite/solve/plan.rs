//! Compares plans with recorded commands and with shaders, without a GPU.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use swell::{
    domain::{
        bounds::Bounds,
        motion::{Motion, Spectrum},
        probe::Rate,
    },
    gpu::{
        buffer::Scalar,
        recording::{Command, Groups},
        reflect::{Access, Reflection, reflect},
        shader,
    },
    scene::{
        Iteration, Method, Scene, Stop, Wall, WaveMaker,
        effects::{
            Effects, absorbing_zone, drag, generation_zone, surface_tension, viscosity,
            vorticity_confinement,
        },
        flip::{Precision, Preconditioner, Surface, Transfer},
        open_waves,
        probe::{Probe, ProbeKind},
    },
    solve::plan::*,
};

use crate::support::{self, flip, mover, pbf_of};

/// A scene, the counts of its contents, and the limits of a device.
struct Case {
    scene: Scene,
    counts: Counts,
    limits: DeviceLimits,
}

impl Case {
    fn new(scene: Scene) -> Self {
        Self {
            scene,
            counts: Counts {
                particles: 5000,
                bricks: Capacity {
                    laden: 9,
                    wet: 9,
                    slots: 15,
                },
                ..Counts::default()
            },
            limits: DeviceLimits {
                binding: 128 << 20,
                buffer: 256 << 20,
                list_budget: LIST_BUDGET,
            },
        }
    }

    fn with_solids(mut self) -> Self {
        self.counts.solid_grid = [12; 3];
        if self.scene.solver.method() == Method::Pbf {
            self.counts.boundary_samples = 700;
        }
        self
    }

    fn plan(&self) -> Plan {
        Plan::new(&self.scene, self.counts, self.limits)
    }
}

fn with_effects(mut scene: Scene) -> Scene {
    scene.effects.viscosity = Some(viscosity::Settings::xsph(0.01));
    scene.effects.vorticity_confinement = Some(vorticity_confinement::Settings { strength: 0.1 });
    scene.effects.surface_tension = Some(surface_tension::Settings { coefficient: 0.1 });
    scene.effects.drag = Some(drag::Settings {
        drop_radius: 1e-3,
        wind: [5.0, 0.0, 0.0],
    });
    scene.effects.absorbing_zone = Some(absorbing_zone::Settings {
        walls: vec![Wall::NAMED[1].1],
        length: 0.5,
        period: 1.0,
    });
    scene.effects.generation_zone = Some(generation_zone::Settings {
        walls: vec![Wall::NAMED[0].1],
        length: 0.5,
        waves: open_waves::Waves::Sea(open_waves::Sea {
            significant_height: 0.05,
            seed: 1,
            spectrum: Spectrum::Jonswap,
            peak_enhancement: None,
            peak_period: 1.0,
            shortest_period: None,
            depth: 1.0,
            simulated_depth: None,
            ramp: None,
            direction_degrees: 20.0,
            spreading: Some(10.0),
        }),
    });
    scene
}

fn with_wave_maker(mut scene: Scene) -> Scene {
    scene.wave_makers.push(WaveMaker {
        absorption: None,
        wall: Wall::NAMED[0].1,
        motion: Motion::ConstantVelocity {
            velocity: 0.1,
            until: None,
        },
    });
    scene
}

fn pbf(change: impl FnOnce(&mut swell::scene::Pbf)) -> Scene {
    let mut scene = support::scene([2.0; 3]);
    change(pbf_of(&mut scene));
    scene
}

fn grid(change: impl FnOnce(&mut swell::scene::flip::Flip)) -> Scene {
    let mut scene = flip::scene([16.0; 3]);
    change(flip::flip(&mut scene));
    scene
}

/// Cases that use every value of every setting on which a plan depends.
fn cases() -> Vec<Case> {
    let adaptive = Stop::DensityError {
        density_error: 0.01,
        max_iterations: 12,
    };
    let mut probed = pbf(|pbf| pbf.artificial_pressure = 0.1);
    probed.probes.push(Probe {
        name: "p".to_owned(),
        kind: ProbeKind::Pressure { at: DVec3::ONE },
        rate: Rate::Frame,
        window: None,
    });
    let mut all = vec![
        Case::new(pbf(|_| {})),
        Case::new(pbf(|pbf| pbf.iteration = Iteration::Jacobi)).with_solids(),
        Case::new(pbf(|pbf| {
            pbf.iteration = Iteration::Chebyshev;
            pbf.stop = Stop::Iterations(9);
        })),
        Case::new(pbf(|pbf| pbf.stop = adaptive)),
        Case::new(with_effects(pbf(|pbf| pbf.stop = Stop::Iterations(5)))),
        Case::new(with_effects(with_wave_maker(pbf(|_| {})))).with_solids(),
        Case::new(probed),
    ];
    // Without lists, and with lists in several bindings.
    for (list_budget, binding) in [(0, 128 << 20), (LIST_BUDGET, 1 << 18)] {
        let mut case = Case::new(with_effects(pbf(|_| {}))).with_solids();
        (case.limits.list_budget, case.limits.binding) = (list_budget, binding);
        all.push(case);
    }
    for preconditioner in [
        Preconditioner::None,
        Preconditioner::Jacobi,
        Preconditioner::Ipp,
        Preconditioner::Multigrid,
    ] {
        for precision in [Precision::F32, Precision::F32Refined, Precision::F64] {
            all.push(Case::new(grid(|flip| {
                flip.pressure.preconditioner = preconditioner;
                flip.pressure.precision = precision;
            })));
        }
    }
    let plain = |flip: &mut swell::scene::flip::Flip| {
        flip.surface = Surface::Voxel;
        flip.density_correction = false;
    };
    let mut no_slip = grid(|_| {});
    no_slip.no_slip.push(Wall::NAMED[2].1);
    let mut moving = grid(|_| {});
    let bounds = Bounds {
        min: DVec3::splat(0.2),
        max: DVec3::splat(0.5),
    };
    let motion = Motion::ConstantVelocity {
        velocity: 0.1,
        until: None,
    };
    moving.moving_solids.push(mover(bounds, DVec3::X, motion));
    let mut moving = Case::new(with_effects(moving)).with_solids();
    moving.counts.moving_nodes = 900;
    all.extend([
        Case::new(grid(plain)),
        Case::new(grid(|flip| flip.transfer = Transfer::Apic)).with_solids(),
        Case::new(with_effects(with_wave_maker(grid(|_| {})))),
        Case::new(no_slip),
        moving,
    ]);
    all
}

fn reflections(plan: &Plan) -> BTreeMap<&'static str, Reflection> {
    let specs = plan.passes.iter().map(|pass| &pass.spec);
    specs
        .map(|spec| {
            let text = shader::compose(spec.name, &spec.defines).unwrap();
            (spec.name, reflect(spec.name, &text).unwrap())
        })
        .collect()
}

/// `update_velocity` writes positions back exactly when an effect reads neighbours there.
#[test]
fn positions_are_written_back_only_for_effects_that_read_them() {
    let all = with_effects(pbf(|_| {})).effects;
    let mut seen = [0; 2];
    for keep in std::iter::once("none").chain(Effects::NAMES.iter().copied()) {
        let mut scene = pbf(|_| {});
        let of = |name: &str| name == keep;
        scene.effects = Effects {
            viscosity: all.viscosity.clone().filter(|_| of("viscosity")),
            vorticity_confinement: (all.vorticity_confinement.clone())
                .filter(|_| of("vorticity_confinement")),
            drag: all.drag.clone().filter(|_| of("drag")),
            absorbing_zone: all.absorbing_zone.clone().filter(|_| of("absorbing_zone")),
            generation_zone: all
                .generation_zone
                .clone()
                .filter(|_| of("generation_zone")),
            surface_tension: all
                .surface_tension
                .clone()
                .filter(|_| of("surface_tension")),
        };
        let shaders = reflections(&Case::new(scene).plan());
        let binding = |pass: &str| {
            let bindings = &shaders[pass].bindings;
            bindings.iter().find(|binding| binding.name == "predicted")
        };
        let effects = shaders.keys().filter(|pass| pass.starts_with("effects/"));
        let is_read = effects.clone().any(|pass| binding(pass).is_some());
        let is_written = binding("pbf/update_velocity").unwrap().is_written;
        assert_eq!(is_read, is_written, "{keep}");
        seen[usize::from(is_read)] += 1;
    }
    assert!(seen[0] >= 3 && seen[1] == 3, "{seen:?}");
}

/// Inconsistencies between plan, commands and shaders: passes and buffers must be exactly those
/// that commands name and bind, with the right contents and sizes.
fn faults(plan: &Plan, commands: &[Command]) -> BTreeSet<String> {
    let shaders = reflections(plan);
    let mut faults = BTreeSet::new();
    let (mut ran, mut bound) = (BTreeSet::new(), BTreeSet::new());
    for command in commands {
        let Command::Dispatch {
            pass,
            binds,
            groups,
        } = command
        else {
            continue;
        };
        ran.insert(*pass);
        let Some(shader) = shaders.get(pass) else {
            faults.insert(format!("{pass} is not planned"));
            continue;
        };
        for binding in &shader.bindings {
            let special = binds.iter().find(|bind| bind.variable == binding.name);
            let name = special.map_or(binding.name.as_str(), |bind| bind.buffer.as_str());
            bound.insert(name.to_owned());
            let Some(row) = plan.buffers.iter().find(|row| row.spec.name == name) else {
                faults.insert(format!("{pass} binds {name}, which is not declared"));
                continue;
            };
            let (held, found) = (row.spec.element, &binding.element);
            // A shader may read a vector one scalar at a time.
            let is_part = held.scalar != Scalar::Mixed && held.bytes.is_multiple_of(found.stride);
            let is_same = (held.scalar, held.head) == (found.scalar, found.head)
                && (held.bytes == found.stride || is_part);
            // This pass reads the bits of any buffer, sixteen bytes at a time.
            if !is_same && *pass != "flip/find_not_finite" {
                faults.insert(format!("{pass}: {name} holds {held:?}, not {found:?}"));
            }
            if row.spec.is_uniform != (binding.access == Access::Uniform) {
                faults.insert(format!("{pass}: {name} is a uniform, or is none"));
            }
            if let Some((offset, bytes)) = special.and_then(|bind| bind.window)
                && offset + bytes > row.spec.bytes
            {
                faults.insert(format!("{pass}: a window beyond {name}"));
            }
        }
        if let Groups::Indirect { buffer, offset } = groups {
            bound.insert(buffer.clone());
            let row = plan.buffers.iter().find(|row| row.spec.name == *buffer);
            if row.is_none_or(|row| offset + 12 > row.spec.bytes) {
                faults.insert(format!("{pass}: its size is not in {buffer}"));
            }
        }
    }
    let idle = plan
        .passes
        .iter()
        .filter(|row| !ran.contains(row.spec.name));
    faults.extend(idle.map(|row| format!("{} is planned and never runs", row.spec.name)));
    let idle = plan
        .buffers
        .iter()
        .filter(|row| !bound.contains(&row.spec.name));
    faults.extend(idle.map(|row| format!("{} is declared and never bound", row.spec.name)));
    let names: BTreeSet<_> = plan.buffers.iter().map(|row| &row.spec.name).collect();
    if names.len() != plan.buffers.len() {
        faults.insert("a buffer is declared twice".to_owned());
    }
    faults
}

#[test]
fn what_is_planned_is_what_is_recorded() {
    for (k, case) in cases().iter().enumerate() {
        let plan = case.plan();
        let faults = faults(&plan, &plan.commands(&case.scene));
        assert!(faults.is_empty(), "case {k}: {faults:#?}");
    }
}

/// Each kind of fault is detected in a plan, or in commands, that have it.
#[test]
fn a_plan_that_parts_from_its_commands_is_seen() {
    let case = Case::new(with_wave_maker(grid(|_| {})));
    let (good, commands) = (case.plan(), case.plan().commands(&case.scene));
    let said = |change: &dyn Fn(&mut Plan), expected: &str| {
        let mut plan = good.clone();
        change(&mut plan);
        let found = faults(&plan, &commands);
        assert!(
            found.iter().any(|f| f.contains(expected)),
            "{expected}: {found:?}"
        );
    };
    let at = |plan: &Plan, name: &str| plan.buffers.iter().position(|b| b.spec.name == name);
    let of = |name: &'static str, change: fn(&mut PlannedBuffer)| {
        move |plan: &mut Plan| {
            let index = at(plan, name).unwrap();
            change(&mut plan.buffers[index]);
        }
    };
    said(
        &|plan| drop(plan.buffers.remove(at(plan, "cell_kind").unwrap())),
        "binds cell_kind, which is not declared",
    );
    said(
        &of("cell_kind", |row| row.spec.name = "left_over".to_owned()),
        "left_over is declared and never bound",
    );
    said(
        &of("cell_kind", |row| row.spec.element.scalar = Scalar::F32),
        "cell_kind holds",
    );
    said(
        &of("position", |row| row.spec.element.bytes = 16),
        "position holds",
    );
    said(
        &of("survey", |row| row.spec.element.head = 0),
        "survey holds",
    );
    said(
        &of("counters", |row| row.spec.is_uniform = true),
        "counters is a uniform",
    );
    said(
        &of("pressure_phases", |row| row.spec.bytes -= 256),
        "a window beyond",
    );
    said(
        &of("groups", |row| row.spec.bytes -= 32),
        "its size is not in groups",
    );
    said(
        &|plan| plan.buffers.push(plan.buffers[0].clone()),
        "declared twice",
    );
    said(
        &|plan| plan.passes.retain(|pass| pass.spec.name != "flip/advect"),
        "flip/advect is not planned",
    );
    let shorter = &commands[..commands.len() - 1];
    assert!(faults(&good, shorter).contains("flip/boundary_work is planned and never runs"));
}

/// Watched buffers are f32 arrays that some pass writes and that the survey of particles does not
/// cover.
#[test]
fn watched_buffers_are_written_by_a_pass() {
    let is_watchable = |plan: &Plan, row: &PlannedBuffer| {
        let mut bindings = reflections(plan).into_values().flat_map(|r| r.bindings);
        let is_written = bindings.any(|b| b.name == row.spec.name && b.access == Access::ReadWrite);
        // Scalars, or vectors of three.
        let element = &row.spec.element;
        is_written && element.scalar == Scalar::F32 && [4, 12].contains(&element.bytes)
    };
    let mut watched = BTreeSet::new();
    for case in cases() {
        let plan = case.plan();
        for row in plan.buffers.iter().filter(|row| row.is_watched) {
            assert!(is_watchable(&plan, row), "{row:?}");
            watched.insert(row.spec.name.clone());
        }
    }
    assert_eq!(watched.len(), 13, "{watched:?}");
    // Negative controls: a buffer of integers, and one that no pass writes.
    let case = Case::new(grid(|_| {})).with_solids();
    let plan = case.plan();
    let row = |name: &str| plan.buffers.iter().find(|b| b.spec.name == name).unwrap();
    assert!(!is_watchable(&plan, row("cell_kind")));
    assert!(!is_watchable(&plan, row("solid_distance")));
}
