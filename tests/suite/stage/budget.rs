//! `[budget]`: limits that hold, limits that are exceeded, what is kept of a failed frame, and
//! which pass was at fault.
mod not_a_number;
mod replay;

use std::{
    path::{Path, PathBuf},
    sync::atomic::AtomicBool,
};
use swell::files::load_scene;

use crate::support::job::Job;
use swell::{
    cache::CacheReader,
    domain::{budget::Watched, solver::StepReport},
    gpu::adapter::{Context, InjectedFault},
    scene::Scene,
    stage::{
        bake::{self, BakeError, BakeEvent, BakeRequest},
        device::Device,
        replay::Failure,
    },
};
use tempfile::TempDir;

fn case(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hard_cases");
    folder.join(name).with_extension("toml")
}

fn load(name: &str, set: &[&str]) -> Scene {
    let set: Vec<String> = set.iter().map(|&set| set.to_owned()).collect();
    load_scene(&case(name), &set).unwrap()
}

fn opened(context: &Context) -> Device {
    Device::Open(Box::new(context.clone()))
}

const fn spoil(pass: &'static str, from: &'static str, to: &'static str) -> InjectedFault {
    InjectedFault { pass, from, to }
}

fn spoiled(context: &Context, spoil: InjectedFault) -> Device {
    let mut context = context.clone();
    context.spoil = Some(spoil);
    opened(&context)
}

/// A bake into a folder of its own, its reports and its error.
struct Baked {
    folder: TempDir,
    reports: Vec<StepReport>,
    removed: usize,
    particles: usize,
    error: Option<BakeError>,
}

impl Baked {
    fn cache(&self) -> PathBuf {
        self.folder.path().join("cache")
    }

    fn go_on(&mut self, device: &Device, scene: &Scene, frames: &str) {
        let request = BakeRequest {
            scene: scene.clone(),
            directory: self.cache(),
            frames: Some(frames.parse().unwrap()),
            resume: true,
            device: device.clone(),
            time_passes: false,
            from: None,
        };
        let never = AtomicBool::new(false);
        let ended = bake::bake(&request, &never, &mut |event| match event {
            BakeEvent::Ready {
                removed, particles, ..
            } => (self.removed, self.particles) = (removed, particles),
            BakeEvent::Frame { report, .. } => self.reports.push(report),
            BakeEvent::Written { .. } => {}
        });
        self.error = ended.err();
    }

    fn failure(&self) -> &Failure {
        match &self.error {
            Some(BakeError::Budget { failure, .. }) => failure,
            other => panic!("{other:?}"),
        }
    }
}

fn bake(opened: &Device, scene: &Scene, frames: &str) -> Baked {
    let mut baked = Baked {
        folder: TempDir::new().unwrap(),
        reports: Vec::new(),
        removed: 0,
        particles: 0,
        error: None,
    };
    baked.go_on(opened, scene, frames);
    baked
}

fn whole(opened: &Device, scene: &Scene) -> Baked {
    bake(opened, scene, &format!("1-{}", scene.shot.frames))
}

const SOLVERS: [&str; 2] = ["solver.method=pbf", "solver.method=flip"];

/// The default limits hold, and each limit that is set too low is exceeded, on the
/// GPU and on the CPU.
#[test]
fn each_budget_holds_by_default_and_breaks_where_it_is_too_low() {
    let gpu = opened(&crate::support::context());
    let both = [
        ("speed=0.01", Watched::Speed),
        ("speed_jump=1e-3", Watched::SpeedJump),
        ("density_error_mean=1e-6", Watched::DensityErrorMean),
        ("density_error_p99=1e-6", Watched::DensityErrorP99),
        ("density_error_max=1e-6", Watched::DensityErrorMax),
        ("volume=1e-5", Watched::Volume),
    ];
    let of_flip = [
        ("residual=1e-5", Watched::Residual),
        ("divergence=1e-9", Watched::Divergence),
    ];
    for method in SOLVERS {
        let scene = load("34-not-a-number", &[method]);
        let (fine, on_cpu) = (whole(&gpu, &scene), whole(&Device::Cpu, &scene));
        assert!(fine.error.is_none(), "{:?}", fine.error);
        assert!(on_cpu.error.is_none(), "{:?}", on_cpu.error);
        assert_eq!((fine.reports.len(), on_cpu.reports.len()), (4, 4));
        assert!(!fine.cache().join("failed").exists());

        let of_flip = of_flip.iter().filter(|_| method.ends_with("flip"));
        for &(set, watched) in both.iter().chain(of_flip) {
            let set = format!("budget.{set}");
            let mut sets = vec![method, &set];
            if watched == Watched::Residual {
                // One iteration, which is never enough.
                sets.extend([
                    "solver.flip.pressure.max_iterations=1",
                    "solver.flip.pressure.preconditioner=none",
                ]);
            }
            let scene = load("34-not-a-number", &sets);
            let broken = bake(&gpu, &scene, "1-4");
            let Failure { breach, place } = broken.failure();
            assert_eq!(breach.watched, watched, "{breach}");
            assert!(breach.measured > breach.limit, "{breach}");
            assert_eq!(breach.frame as usize, 1 + broken.reports.len());
            let place = place.as_ref().unwrap_or_else(|| panic!("{breach}"));
            assert!(place.substep >= 1 && place.pass.contains('/'), "{place:?}");
            let is_of_flip = matches!(watched, Watched::Residual | Watched::Divergence);
            assert_eq!(breach.substep.is_some(), is_of_flip, "{breach}");
            let on_cpu = bake(&Device::Cpu, &scene, "1-4");
            if is_of_flip {
                // The reference's solves converge to the rounding of f64.
                assert!(on_cpu.error.is_none(), "{:?}", on_cpu.error);
                continue;
            }
            let Failure { breach, place } = on_cpu.failure();
            assert_eq!((breach.watched, place), (watched, &None), "{breach}");
        }
    }
}

/// Particles slowed down to the cap are counted; here a fault in the test for them counts all.
#[test]
fn too_many_slowed_particles_end_a_bake() {
    let context = crate::support::context();
    for (method, pass) in [
        (SOLVERS[0], "pbf/update_velocity"),
        (SOLVERS[1], "flip/advect"),
    ] {
        let scene = load("34-not-a-number", &[method]);
        let count = spoil(
            pass,
            "if distance > params.max_displacement {",
            "atomicAdd(&counters.capped, 1u); if distance > params.max_displacement {",
        );
        let slowed = bake(&spoiled(&context, count), &scene, "1-2");
        let Failure { breach, place } = slowed.failure();
        assert_eq!((breach.watched, breach.measured), (Watched::Capped, 1.0));
        assert_eq!(place.as_ref().unwrap().pass, pass, "{breach}");
        let off = load("34-not-a-number", &[method, "budget.capped=false"]);
        let slowed = bake(&spoiled(&context, count), &off, "1-2");
        assert!(slowed.error.is_none(), "{:?}", slowed.error);
    }
}

/// The water gains the energy of the walls' work, and no more: without the work, or with slightly
/// larger velocities, the budget is exceeded.
#[test]
fn energy_rises_by_the_work_of_the_walls_alone() {
    let context = crate::support::context();
    let gpu = opened(&context);
    for (method, projection, lost, grown) in [
        (
            SOLVERS[0],
            "solver.pbf.grid_projection=false",
            InjectedFault {
                pass: "pbf/boundary_work",
                from: "+= sum;",
                to: "+= 0.0 * sum;",
            },
            InjectedFault {
                pass: "pbf/update_velocity",
                from: "velocity[thread] = packed(v);",
                to: "velocity[thread] = packed(1.3 * v);",
            },
        ),
        (
            SOLVERS[1],
            "solver.pbf.grid_projection=true",
            InjectedFault {
                pass: "flip/boundary_work",
                from: "boundary_work[thread / 64u] = sum;",
                to: "boundary_work[thread / 64u] = 0.0 * sum;",
            },
            InjectedFault {
                pass: "flip/grid_to_particle",
                from: "advanced + params.pic_blend",
                to: "1.3 * advanced + params.pic_blend",
            },
        ),
    ] {
        // A piston: its work is most of the energy.
        let scene = load("24-leaving", &[method, projection]);
        let fine = bake(&gpu, &scene, "1-9");
        assert!(fine.error.is_none(), "{:?}", fine.error);
        let total = |report: &StepReport| report.kinetic_energy + report.potential_energy;
        let pairs = || fine.reports.iter().zip(&fine.reports[1..]);
        let most =
            |f: &dyn Fn((&StepReport, &StepReport)) -> f64| pairs().map(f).fold(f64::MIN, f64::max);
        let raw = most(&|(a, b)| (total(b) - total(a)) / total(a));
        let beyond = most(&|(a, b)| (total(b) - total(a) - b.boundary_work) / total(a));
        println!(
            "{method}: energy rises by up to {raw:.3} a frame, beyond the work by {beyond:.4}"
        );
        assert!(raw > 0.1, "{raw}");

        let without = bake(&spoiled(&context, lost), &scene, "1-9");
        assert_eq!(without.failure().breach.watched, Watched::Energy);
        let larger = bake(&spoiled(&context, grown), &scene, "1-9");
        let failure = larger.failure();
        assert_eq!(failure.breach.watched, Watched::Energy, "{failure}");
        assert_eq!(
            failure.place.as_ref().unwrap().pass,
            grown.pass,
            "{failure}"
        );
    }
}

/// Both solvers report the same work as the f64 reference.
#[test]
fn the_work_of_walls_is_that_of_the_reference() {
    let gpu = opened(&crate::support::context());
    for method in SOLVERS {
        let scene = load("24-leaving", &[method]);
        let work = |opened: &Device| -> f64 {
            let reports = bake(opened, &scene, "1-4").reports;
            reports.iter().map(|report| report.boundary_work).sum()
        };
        let (single, double) = (work(&gpu), work(&Device::Cpu));
        println!("{method}: {single} J, {double} J in f64");
        // Four frames of a splash diverge by more than rounding.
        assert!(
            double > 10.0 && (single - double).abs() < 0.01 * double,
            "{single} {double}"
        );
    }
}

/// Hard case 14: the lid meets the water in frame 20; from frame 15 on it leaves less than half a
/// cell of air, which FLIP cannot distinguish from water.
#[test]
fn a_lid_on_sealed_water_is_reported_as_incompatible() {
    let gpu = opened(&crate::support::context());
    for device in [&gpu, &Device::Cpu] {
        let scene = load("14-sealed", &["budget.volume=false"]);
        let pressed = whole(device, &scene);
        assert!(pressed.error.is_none(), "{:?}", pressed.error);
        let squeezed = |report: &StepReport| report.projection.unwrap().incompatible;
        let (before, after) = pressed.reports.split_at(14);
        assert!(before.iter().all(|report| squeezed(report) == 0.0));
        // 0.5 m/s on 0.6 m.
        let most = after.iter().map(squeezed).fold(0.0, f64::max);
        assert!((0.4..1.6).contains(&most), "{most}");
    }
    // Until then the water keeps its volume within 1 %.
    let open = load("14-sealed", &["budget.volume=0.01"]);
    let open = bake(&gpu, &open, "1-14");
    assert!(open.error.is_none(), "{:?}", open.error);
    assert_eq!(open.reports.len(), 14);
    // PBF has no incompatible pressure: compressed water is reported as too dense.
    let scene = load("14-sealed", &[SOLVERS[0], "budget.density_error_mean=0.1"]);
    let pressed = whole(&gpu, &scene);
    let breach = &pressed.failure().breach;
    assert_eq!(breach.watched, Watched::DensityErrorMean, "{breach}");
    assert!(breach.frame > 19, "{breach}");
}

/// Hard case 15.
#[test]
fn water_in_a_solid_is_left_out_and_counted() {
    let gpu = opened(&crate::support::context());
    for method in SOLVERS {
        let scene = load("15-solid-over-all", &[method]);
        let none = whole(&gpu, &scene);
        assert!(none.error.is_none(), "{:?}", none.error);
        assert_eq!((none.particles, none.removed), (0, 64), "{method}");
        // Negative control: with the solid elsewhere the water is kept.
        let scene = load(
            "15-solid-over-all",
            &[method, "solid[0].translate=[0.9,0.3,0.9]"],
        );
        let all = bake(&gpu, &scene, "1");
        assert_eq!((all.particles, all.removed), (64, 0), "{method}");
    }
}

/// Hard case 23.
#[test]
fn one_particle_at_extreme_speed_asks_for_substeps_and_is_told() {
    let gpu = opened(&crate::support::context());
    for method in SOLVERS {
        let scene = load("23-extreme-particle", &[method]);
        let fallen = whole(&gpu, &scene);
        assert!(fallen.error.is_none(), "{:?}", fallen.error);
        let reports = &fallen.reports;
        let fastest = reports
            .iter()
            .map(|report| report.max_speed)
            .fold(0.0, f64::max);
        assert!(fastest > 25.0, "{fastest}");
        let capped: u64 = reports.iter().map(|report| report.capped).sum();
        let steps: u64 = reports
            .iter()
            .map(|report| u64::from(report.substeps))
            .sum();
        assert!(
            capped as f64 <= 1e-4 * steps as f64 * fallen.particles as f64,
            "{capped}"
        );
        // The pool stays calm: its speed stays below the drop's.
        let last = reports.last().unwrap();
        assert!(last.max_speed < fastest, "{} {fastest}", last.max_speed);
        // A budget below its speed names it.
        let scene = load("23-extreme-particle", &[method, "budget.speed=10"]);
        let told = whole(&gpu, &scene);
        let failure = told.failure();
        assert_eq!(failure.breach.watched, Watched::Speed, "{failure}");
        assert!((10.0..10.5).contains(&failure.breach.measured), "{failure}");
    }
}

/// Hard case 24, and the ledger of particles.
#[test]
fn nothing_leaves_the_domain_and_a_ledger_that_does_not_close_ends_the_bake() {
    let context = crate::support::context();
    let gpu = opened(&context);
    for (method, out, twice) in [
        (
            SOLVERS[0],
            spoil(
                "pbf/update_velocity",
                "position[thread] = packed(x);",
                "position[thread] = packed(x + 10.0);",
            ),
            spoil(
                "pbf/update_velocity",
                "id[thread] = id[params.particle_count + thread];",
                "id[thread] = id[params.particle_count + (thread & 0xfffffffeu)];",
            ),
        ),
        (
            SOLVERS[1],
            spoil(
                "flip/advect",
                "position[i] = packed(x);",
                "position[i] = packed(x + 10.0);",
            ),
            spoil(
                "flip/advect",
                "id[i] = id[params.particle_count + i];",
                "id[i] = id[params.particle_count + i] + 7u;",
            ),
        ),
    ] {
        let scene = load("24-leaving", &[method]);
        let thrown = whole(&gpu, &scene);
        assert!(thrown.error.is_none(), "{:?}", thrown.error);
        let cache = CacheReader::open(&thrown.cache()).unwrap();
        let (first, last) = (cache.read(0).unwrap(), cache.read(20).unwrap());
        assert_eq!(first.id, last.id);
        for spoil in [out, twice] {
            let broken = bake(&spoiled(&context, spoil), &scene, "1-2");
            let failure = broken.failure();
            assert_eq!(failure.breach.watched, Watched::Particles, "{failure}");
        }
    }
}

/// The whole program: exit code, message, the files that are kept, the command that computes the
/// frame again, and a resume.
#[test]
fn a_broken_budget_is_exit_5_a_folder_and_a_line_that_can_be_had_again() {
    let job = Job::new();
    for (name, flags) in [("gpu", "--solver flip"), ("cpu", "--device cpu")] {
        let bake = format!("bake small.toml -o {name} {flags} --frames 1-3");
        job.expect(
            0,
            &format!("bake small.toml -o {name} {flags} --frames 1-2"),
        );
        let sound = job.hash(name);
        let said = job.expect(5, &format!("{bake} --resume --set budget.speed=0.2"));
        let line = said.lines().last().unwrap();
        let head = "swell: frame 3: the largest speed, m/s, is ";
        assert!(
            line.starts_with(head) && line.contains("and budget.speed is 0.2000; "),
            "{line}"
        );
        assert_eq!(line.contains("first in flip/"), name == "gpu", "{line}");
        for file in [
            "failed/scene.toml",
            "failed/start.ply",
            "failed/report.json",
        ] {
            assert!(job.path(name).join(file).is_file(), "{file}");
        }
        let command = line
            .split('`')
            .nth(1)
            .unwrap()
            .strip_prefix("swell ")
            .unwrap();
        assert_eq!(command, format!("check {name}/failed"));
        let again = job.expect(5, command);
        let again = again.lines().last().unwrap();
        assert!(line.starts_with(again), "{line}\n{again}");
        job.expect(2, &format!("{command} --frames 1"));
        // The cache is unchanged, and can be resumed with another budget: budgets are no physics.
        job.expect(0, &format!("verify {name}"));
        assert_ne!(job.hash(name), sound);
        job.expect(0, &format!("{bake} --resume --set budget.speed=false"));
        assert!(!job.path(name).join("failed").exists());
        job.expect(
            0,
            &format!("bake small.toml -o {name}-whole {flags} --frames 1-3"),
        );
        assert_eq!(job.hash(name), job.hash(&format!("{name}-whole")));
    }
}
