//! Adapters with small limits, and a device that is lost during a bake.

use std::{path::Path, sync::atomic::AtomicBool, thread::sleep, time::Duration};
use swell::files::load_scene;

use crate::support::job::Job;
use crate::support::pbf_of;
use swell::{
    cache::CacheReader,
    gpu::{
        adapter::{Context, GpuError, InjectedFault, Needs},
        bindings::MOST_STORAGE_BUFFERS,
    },
    solve::SolveError,
    stage::{
        Blame,
        bake::{BakeError, BakeEvent, BakeRequest, bake},
        device::{Device, SolverError},
    },
};

/// The small scene with enough particles that lists and grids fill more than one
/// workgroup of each pass.
fn request(job: &Job, solver: &str, cache: &str, context: &Context) -> BakeRequest {
    let set = [
        format!("solver.method={solver}"),
        "solver.pbf.particle_spacing=0.05".to_owned(),
        "solver.flip.cell_size=0.1".to_owned(),
        "shot.frames=4".to_owned(),
    ];
    BakeRequest {
        scene: load_scene(&job.path("small.toml"), &set).unwrap(),
        directory: job.path(cache),
        frames: None,
        resume: true,
        from: None,
        device: Device::Open(Box::new(context.clone())),
        time_passes: false,
    }
}

fn run(request: &BakeRequest) -> Result<(), BakeError> {
    bake(request, &AtomicBool::new(false), &mut |_| {}).map(|_| ())
}

/// Asserts that a fault in a pass ended the bake or changed its frames. An error about the shader
/// itself, such as text to replace that it does not contain, does not count.
fn assert_seen(job: &Job, spoiled: Result<(), BakeError>, solver: &str) {
    match spoiled {
        Ok(()) => assert_ne!(job.hash("whole"), job.hash("spoiled"), "{solver}: control"),
        Err(error) => assert!(!error.to_string().contains("shader"), "{solver}: {error}"),
    }
}

fn lost(error: &BakeError) -> bool {
    matches!(
        error,
        BakeError::Gpu(GpuError::Lost(_))
            | BakeError::Solve(SolverError::Gpu(SolveError::Gpu(GpuError::Lost(_))))
    )
}

fn too_large(error: BakeError) -> (String, &'static str) {
    let message = error.to_string();
    assert_eq!(Blame::from(&error), Blame::Input, "exit code 2");
    match error {
        BakeError::Gpu(GpuError::TooLarge { limit, .. })
        | BakeError::Solve(SolverError::Gpu(SolveError::Gpu(GpuError::TooLarge {
            limit, ..
        }))) => (message, limit),
        _ => panic!("{message}"),
    }
}

/// Workgroups per dimension; the small scene's dispatches exceed it many times over.
const FEW_GROUPS: u32 = 12;

/// Dispatches in two dimensions give the same bytes as those in one.
#[test]
fn few_workgroups_a_dimension_give_the_same_bytes() {
    let whole = Context::open(None).unwrap();
    let few = Context::open_lowered(None, Needs::default(), |limits| {
        limits.max_compute_workgroups_per_dimension = FEW_GROUPS;
    })
    .unwrap();
    let thread = "(workgroup.y * workgroups.x + workgroup.x)";
    for (solver, pass) in [("pbf", "pbf/predict"), ("flip", "flip/advect")] {
        let job = Job::new();
        run(&request(&job, solver, "whole", &whole)).unwrap();
        run(&request(&job, solver, "few", &few)).unwrap();
        let start = CacheReader::open(&job.path("whole"))
            .unwrap()
            .read(0)
            .unwrap();
        assert!(
            start.len() > 64 * FEW_GROUPS as usize,
            "one dimension would do"
        );
        assert_eq!(job.hash("whole"), job.hash("few"), "{solver}");
        // Negative control: a pass that uses only one dimension is detected.
        let mut spoiled = few.clone();
        spoiled.spoil = Some(InjectedFault {
            pass,
            from: thread,
            to: "workgroup.x",
        });
        let result = run(&request(&job, solver, "spoiled", &spoiled));
        assert_seen(&job, result, solver);
    }
}

/// Neighbour lists that exceed one binding are split into several.
#[test]
fn small_bindings_split_the_lists_and_give_the_same_bytes() {
    let whole = Context::open(None).unwrap();
    let job = Job::new();
    // PBF without its projection, whose grid has larger buffers than the lists.
    let alone = |cache: &str, context: &Context| {
        let mut request = request(&job, "pbf", cache, context);
        pbf_of(&mut request.scene).grid_projection = false;
        request
    };
    run(&alone("whole", &whole)).unwrap();
    let particles = CacheReader::open(&job.path("whole"))
        .unwrap()
        .read(0)
        .unwrap()
        .len() as u64;
    // A list has 48 neighbours of four bytes: a binding for a third of all lists exceeds any other
    // buffer of the plan.
    let binding = (48 * 4 * particles / 3).next_multiple_of(256);
    let small = Context::open_lowered(None, Needs::default(), |limits| {
        limits.max_storage_buffer_binding_size = binding;
    })
    .unwrap();
    let request = alone("small", &small);
    let start = swell::stage::prepare::Start::of(&request.scene).unwrap();
    let chunks = |context: &Context| {
        let plan = start.plan(&request.scene, swell::solve::plan::device_limits(context));
        let lists = plan
            .buffers
            .iter()
            .filter(|b| b.spec.name.starts_with("neighbor_list."));
        lists.map(|b| b.spec.bytes).collect::<Vec<_>>()
    };
    assert_eq!(chunks(&whole).len(), 1);
    let split = chunks(&small);
    assert!(
        split.len() >= 3 && split.iter().all(|&bytes| bytes <= binding),
        "{split:?}"
    );
    run(&request).unwrap();
    assert_eq!(job.hash("whole"), job.hash("small"));
}

/// Positions that exceed one binding are split into two; per-particle vectors, three quarters of a
/// position's size, fit into one.
#[test]
fn places_in_two_bindings_give_the_same_bytes() {
    let job = Job::new();
    let alone = |cache: &str, context: &Context| {
        let mut request = request(&job, "pbf", cache, context);
        let set = [
            "solver.method=pbf",
            "solver.pbf.particle_spacing=0.025",
            "shot.frames=2",
        ];
        request.scene = load_scene(&job.path("small.toml"), &set.map(str::to_owned)).unwrap();
        pbf_of(&mut request.scene).grid_projection = false;
        request
    };
    let whole = Context::open(None).unwrap();
    let request = alone("whole", &whole);
    let start = swell::stage::prepare::Start::of(&request.scene).unwrap();
    run(&request).unwrap();
    let binding = (14 * start.particles.len() as u64).next_multiple_of(256);
    let small = Context::open_lowered(None, Needs::default(), |limits| {
        limits.max_storage_buffer_binding_size = binding;
    })
    .unwrap();
    let page = |context: &Context| {
        let plan = start.plan(&request.scene, swell::solve::plan::device_limits(context));
        assert!(plan.has_lists);
        plan.page
    };
    assert_eq!(page(&whole), None);
    assert_eq!(page(&small), Some((binding / 16) as usize));
    run(&alone("small", &small)).unwrap();
    assert_eq!(job.hash("whole"), job.hash("small"));
    // Negative control: an off-by-one in reading positions beyond the first page is detected.
    let mut spoiled = small.clone();
    spoiled.spoil = Some(InjectedFault {
        pass: "pbf/compute_delta",
        from: "predicted_high[j - PAGE]",
        to: "predicted_high[(j - PAGE) ^ 1u]",
    });
    assert_seen(&job, run(&alone("spoiled", &spoiled)), "pbf");
}

/// Buffers that cannot be split are refused with their sizes, and nothing is written.
#[test]
fn what_no_buffer_holds_is_refused_before_the_bake() {
    for solver in ["pbf", "flip"] {
        let job = Job::new();
        for (limit, bytes) in [
            ("max_storage_buffer_binding_size", 20_480),
            ("max_buffer_size", 18_432),
        ] {
            let context = Context::open_lowered(None, Needs::default(), |limits| match limit {
                "max_buffer_size" => {
                    limits.max_buffer_size = bytes;
                    limits.max_storage_buffer_binding_size = bytes;
                }
                _ => limits.max_storage_buffer_binding_size = bytes,
            })
            .unwrap();
            let (message, found) =
                too_large(run(&request(&job, solver, "refused", &context)).unwrap_err());
            assert_eq!(found, limit);
            assert!(
                message.contains(&format!("allows {bytes} ({limit})")),
                "{message}"
            );
            assert!(
                message.contains(" bytes, and ") && message.contains("buffer `"),
                "{message}"
            );
            assert!(!job.path("refused").exists());
        }
        // Negative control: with the adapter's own limits it bakes.
        run(&request(
            &job,
            solver,
            "refused",
            &Context::open(None).unwrap(),
        ))
        .unwrap();
    }
}

#[test]
fn limits_above_the_adapters_own_do_not_open() {
    let raised = Context::open_lowered(None, Needs::default(), |limits| {
        limits.max_bind_groups = u32::MAX
    });
    assert!(matches!(raised, Err(GpuError::Open { .. })));
}

/// Like llvmpipe of Mesa 20.3: the limit is reported before the first frame, not as a validation
/// error of a shader.
#[test]
fn an_adapter_that_binds_few_buffers_is_refused_by_figures() {
    let job = Job::new();
    let opened = |most: u32| {
        Context::open_lowered(None, Needs::default(), |limits| {
            limits.max_storage_buffers_per_shader_stage = most;
        })
        .unwrap()
    };
    let error = run(&request(&job, "pbf", "few", &opened(3))).unwrap_err();
    let said = error.to_string();
    assert!(
        said.contains("storage buffers") && said.contains("allows 3 (max_storage_buffers"),
        "{said}"
    );
    assert!(!said.contains('\n'), "{said}");
    assert_eq!(Blame::from(&error), Blame::Device, "exit code 3");
    // Negative control: as many as any of our passes binds are enough.
    let enough = opened(MOST_STORAGE_BUFFERS);
    run(&request(&job, "pbf", "enough", &enough)).unwrap();
}

/// What `inspect` plans is refused where the bake refuses it, with the same pass and figures. As
/// many storage buffers as the plan needs suffice for the bake; with one less both are refused.
#[test]
fn a_pass_that_binds_too_many_buffers_is_refused_in_the_plan() {
    let job = Job::new();
    let opened = |most: u32| {
        Context::open_lowered(None, Needs::default(), |limits| {
            limits.max_storage_buffers_per_shader_stage = most;
        })
        .unwrap()
    };
    for solver in ["pbf", "flip"] {
        let planned = |context: &Context| {
            let scene = request(&job, solver, "planned", context).scene;
            let start = swell::stage::prepare::Start::of(&scene).unwrap();
            let limits = swell::solve::plan::device_limits(context);
            start.shown_plan(&scene, limits).check(context).err()
        };
        let mut most = 3;
        while let Some(error) = planned(&opened(most)) {
            let GpuError::TooManyBuffers {
                needed, allowed, ..
            } = error
            else {
                panic!("{error}")
            };
            assert!(needed > most && allowed == most, "{needed} {allowed}");
            most = needed;
        }
        assert!((5..=MOST_STORAGE_BUFFERS).contains(&most), "{most}");
        let few = opened(most - 1);
        let refused = planned(&few).expect("a pass needs one more").to_string();
        let said = run(&request(&job, solver, solver, &few)).unwrap_err();
        assert_eq!(said.to_string(), refused);
        assert!(refused.contains(&format!("binds {most} storage buffers")));
        assert!(!job.path(solver).exists());
        // Negative control.
        run(&request(&job, solver, solver, &opened(most))).unwrap();
    }
}

/// Destroys the device after the second frame is computed.
fn lose(request: &BakeRequest, context: &Context) -> BakeError {
    let stop = AtomicBool::new(false);
    bake(request, &stop, &mut |event| {
        if matches!(event, BakeEvent::Frame { frame: 2, .. }) {
            context.device.destroy();
            // The next frame may be computed already: once the loss is known it is not read.
            let is_known = (0..10_000).any(|_| {
                sleep(Duration::from_millis(1));
                context.wait().is_err()
            });
            assert!(is_known);
        }
    })
    .unwrap_err()
}

fn frames(cache: &Path) -> u32 {
    let reader = CacheReader::open(cache).unwrap();
    reader.verify().unwrap();
    reader.last_frame()
}

#[test]
fn a_lost_device_ends_the_bake_and_a_resume_ends_with_the_same_bytes() {
    for solver in ["pbf", "flip"] {
        let job = Job::new();
        run(&request(
            &job,
            solver,
            "whole",
            &Context::open(None).unwrap(),
        ))
        .unwrap();
        let context = Context::open(None).unwrap();
        let broken = request(&job, solver, "lost", &context);
        let error = lose(&broken, &context);
        assert!(lost(&error), "{error:?}");
        assert_eq!(Blame::from(&error), Blame::Device, "exit code 3");
        assert!(error.to_string().starts_with("device lost: "), "{error}");
        // All computed frames are in the ledger.
        assert_eq!(frames(&job.path("lost")), 2);
        assert_ne!(job.hash("lost"), job.hash("whole"));
        // Negative control: the lost device stays lost, and no more frames are lost.
        let before = job.hash("lost");
        assert!(lost(&run(&broken).unwrap_err()));
        assert_eq!(job.hash("lost"), before);
        run(&request(
            &job,
            solver,
            "lost",
            &Context::open(None).unwrap(),
        ))
        .unwrap();
        assert_eq!(job.hash("lost"), job.hash("whole"));
        // A device lost before the first frame leaves the start at most, from which a
        // bake can resume.
        let context = Context::open(None).unwrap();
        context.device.destroy();
        let error = run(&request(&job, solver, "never", &context)).unwrap_err();
        assert!(lost(&error), "{error:?}");
        if job.path("never").exists() {
            assert_eq!(frames(&job.path("never")), 0);
        }
        run(&request(
            &job,
            solver,
            "never",
            &Context::open(None).unwrap(),
        ))
        .unwrap();
        assert_eq!(job.hash("never"), job.hash("whole"));
    }
}
