//! The loop that advances a scene frame by frame, on a GPU or on the CPU. Bakes, replays and
//! experiments use it.

use std::{
    sync::{
        atomic::{AtomicBool, Ordering},
        mpsc::{SyncSender, sync_channel},
    },
    time::Instant,
};

use glam::DVec3;

use swell_cache::ProbeValues;
use swell_domain::{
    absorber::AbsorberStates,
    band::Band,
    boundary::Boundary,
    particles::Particles,
    signed_distance::SignedDistance,
    solver::{NoWatch, PassTime, StepReport, Unread},
    sources::{Exchange, Solids, Sources},
};
use swell_scene::Scene;
use swell_solve::plan::{Plan, Share};

use super::{
    device::{AnySolver, Built, Opened, SolverError},
    prepare::Start,
    probes::{Recorder, is_recorded},
    watch::Watch,
};

/// A scene's solver and its current frame.
pub struct Drive<'a> {
    scene: &'a Scene,
    /// Emitters and drains; `None` if no water enters or leaves.
    sources: Option<Exchanged>,
    /// The band that has particles, if they are not everywhere.
    band: Option<Band>,
    /// Least id that an entering particle may have.
    first_id: u32,
    /// Plan of the passes and buffers on the GPU; `None` on the CPU.
    plan: Option<Plan>,
    /// Id of the next particle to enter.
    next_id: u32,
    /// Amount of the water, in particles, with which the next frame begins; only with a band.
    amount: usize,
    ahead: Ahead<'a>,
    behind: Behind<'a>,
}

/// Computes frames.
struct Ahead<'a> {
    scene: &'a Scene,
    solver: Box<AnySolver>,
    frame: u32,
    /// State of the absorbing walls after that frame.
    walls: AbsorberStates,
    /// Positions at which pressures are read after each frame, metres.
    pressure_points: Vec<DVec3>,
    /// Whether probes sample at substeps.
    is_recorded: bool,
}

/// Reads and checks computed frames, possibly while the next one is computed.
struct Behind<'a> {
    watch: Option<Watch<'a>>,
    /// Report of the last frame that the solver completed, even if that frame then exceeded a
    /// budget.
    report: Option<StepReport>,
}

/// What enters and leaves at the end of each frame, and the solids that it meets, without samples.
struct Exchanged {
    sources: Sources,
    boundary: Option<Boundary>,
}

impl Exchanged {
    /// `None` if nothing enters or leaves.
    fn of(start: &Start) -> Option<Self> {
        // Drains ignore solids.
        let meets_solids = !start.sources.emitters.is_empty();
        (!start.sources.is_empty()).then(|| Self {
            sources: start.sources.clone(),
            boundary: meets_solids.then(|| Boundary {
                distance: start.boundary.distance.clone(),
                moving: start.boundary.moving.clone(),
                shapes: start.boundary.shapes.clone(),
                ..Boundary::default()
            }),
        })
    }
}

/// A computed frame.
#[derive(Clone, Debug)]
pub struct ComputedFrame {
    /// Number of the frame.
    pub frame: u32,
    /// State at its end, after emitters and drains acted.
    pub particles: Particles,
    /// Id of the next particle; present only if they change between frames.
    pub next_id: Option<u32>,
    /// Report of its substeps.
    pub report: StepReport,
    /// Pressures at the scene's [`pressure_points`](Scene::pressure_points), Pa; empty if none are
    /// read.
    pub pressures: Vec<Option<f64>>,
    /// Values that probes recorded during the frame, by probe; for a probe with its own rate, each
    /// sample's time followed by its values.
    pub looks: ProbeValues,
    /// Wall-clock time of all that, seconds.
    pub seconds: f64,
}

/// A frame that the solver has computed, still to be read and checked.
struct Computed {
    frame: u32,
    unread: Unread<SolverError>,
    pressures: Vec<Option<f64>>,
    looks: ProbeValues,
    begin: Instant,
}

/// How a run without an error ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The last frame was computed.
    Done,
    /// A signal stopped it before.
    Stopped,
}

impl<'a> Drive<'a> {
    /// Builds the scene's solver and loads the start as frame 0.
    ///
    /// # Errors
    /// A buffer that exceeds the adapter's limits; a device error.
    pub fn new(
        opened: &Opened,
        scene: &'a Scene,
        start: &Start,
        is_timed: bool,
    ) -> Result<Self, SolverError> {
        let mut drive = Self::unloaded(opened, scene, start, is_timed)?;
        drive.load(0, &start.particles)?;
        Ok(drive)
    }

    /// Builds the scene's solver; a state has to be loaded before it can advance.
    pub(super) fn unloaded(
        opened: &Opened,
        scene: &'a Scene,
        start: &Start,
        is_timed: bool,
    ) -> Result<Self, SolverError> {
        let Built { solver, plan } = opened.build(scene, start, is_timed)?;
        Ok(Self {
            scene,
            sources: Exchanged::of(start),
            band: scene.band(),
            first_id: next_after(&start.particles),
            plan,
            next_id: 0,
            amount: 0,
            ahead: Ahead {
                scene,
                solver,
                frame: 0,
                walls: AbsorberStates::default(),
                pressure_points: Vec::new(),
                is_recorded: false,
            },
            behind: Behind {
                watch: None,
                report: None,
            },
        })
    }

    /// Loads `state`, the end of frame `frame`, and stops checking budgets. New ids continue after
    /// those of the state and of the scene's start.
    ///
    /// # Errors
    /// A device error; a state that does not belong to the scene.
    pub fn load(&mut self, frame: u32, state: &Particles) -> Result<(), SolverError> {
        self.ahead.solver.load(frame, state)?;
        (self.ahead.frame, self.behind.watch) = (frame, None);
        self.ahead.walls = state.walls;
        self.next_id = self.first_id.max(next_after(state));
        self.amount = self.band.map_or(0, |_| state.amount());
        Ok(())
    }

    /// Continues ids with `next_id`, if given.
    pub(super) fn go_on_with(&mut self, next_id: Option<u32>) {
        self.next_id = next_id.unwrap_or(self.next_id);
    }

    /// Loads a state and checks the scene's budgets after each further frame; `start` is the start
    /// of the bake.
    pub(super) fn load_watched(
        &mut self,
        start: &Particles,
        frame: u32,
        state: &Particles,
    ) -> Result<(), SolverError> {
        self.load(frame, state)?;
        self.behind.watch = Some(Watch::new(self.scene, start, frame, state));
        Ok(())
    }

    /// Reads pressures after each frame if the scene has pressure probes.
    pub fn with_pressures(mut self) -> Self {
        self.ahead.pressure_points = self.scene.pressure_points();
        self
    }

    /// Additionally lets probes that ask for it sample during a frame.
    pub fn with_probes(mut self) -> Self {
        let mut probes = self.scene.probes.iter();
        self.ahead.is_recorded = probes.any(is_recorded);
        self.with_pressures()
    }

    /// Computes the next frame.
    ///
    /// # Errors
    /// A device error, invalid numbers, or an exceeded budget if budgets are checked.
    pub fn advance(&mut self) -> Result<ComputedFrame, SolverError> {
        let begin = Instant::now();
        let mut step = self.behind.open(self.ahead.compute()?)?;
        self.relay(&mut step)?;
        self.behind.check(&mut step)?;
        step.report.exchange = self.exchange(&mut step.particles)?;
        step.next_id = self.changes_particles().then_some(self.next_id);
        step.seconds = begin.elapsed().as_secs_f64();
        Ok(step)
    }

    /// Whether particles change between two frames.
    fn changes_particles(&self) -> bool {
        self.sources.is_some() || self.band.is_some()
    }

    /// Lays the band anew at the end of the frame, if the scene has one, and reports the energies
    /// of the water that the next frame begins with: until then it may lack particles or have too
    /// many.
    fn relay(&mut self, step: &mut ComputedFrame) -> Result<(), SolverError> {
        let (Some(band), frame) = (&self.band, step.frame) else {
            return Ok(());
        };
        let laid = band.relay(&mut step.particles, (frame, self.amount), &mut self.next_id);
        laid.map_err(|error| SolverError::Band { frame, error })?;
        self.amount = step.particles.amount();
        let laid = self.scene.report(&step.particles, [].into_iter());
        step.report.kinetic_energy = laid.kinetic_energy;
        step.report.potential_energy = laid.potential_energy;
        self.ahead.solver.load(frame, &step.particles)
    }

    /// Runs emitters and drains at the end of the frame, if the scene has any.
    fn exchange(&mut self, particles: &mut Particles) -> Result<Option<Exchange>, SolverError> {
        let Some(it) = &self.sources else {
            return Ok(None);
        };
        let scene = self.scene;
        let bodies = particles.bodies.clone();
        let (frame, next_id) = (self.ahead.frame, &mut self.next_id);
        // Of a solid whose shape changes, the shape at the frame's end is all that is asked for.
        let time = scene.shot.time(frame);
        let boundary = it.boundary.as_ref();
        let moving = boundary.into_iter().flat_map(|it| {
            let all = 0..it.moving.len();
            all.map(move |index| it.moving_at(index, time))
        });
        let moving: Vec<_> = moving.collect();
        let moving: Vec<&SignedDistance> = moving.iter().map(AsRef::as_ref).collect();
        let solids = Solids {
            still: boundary.and_then(|it| it.distance.as_ref()),
            moving: &moving,
            pose: &|index, seconds| scene.moving_solids[index].pose(&bodies, seconds),
        };
        let exchange = it.sources.exchange(frame, &solids, particles, next_id);
        if self.behind.watch.is_some() {
            scene.budget.check_count(frame, particles.len())?;
        }
        if exchange.entered > 0 || exchange.left > 0 {
            self.ahead.solver.load(frame, particles)?;
            if let Some(watch) = &mut self.behind.watch {
                watch.take_over(particles);
            }
        }
        Ok(Some(exchange))
    }

    /// Computes frames up to `last` and passes each to `observe`; setting `stop` ends it between
    /// two frames.
    ///
    /// # Errors
    /// Those of [`Drive::advance`] and of `observe`.
    pub fn run<E: From<SolverError>>(
        &mut self,
        last: u32,
        stop: &AtomicBool,
        mut observe: impl FnMut(ComputedFrame) -> Result<(), E>,
    ) -> Result<End, E> {
        while self.ahead.frame < last {
            if stop.load(Ordering::Relaxed) {
                return Ok(End::Stopped);
            }
            observe(self.advance()?)?;
        }
        Ok(End::Done)
    }

    /// Like [`Self::run`], but each frame is read, checked and observed while the solver computes
    /// the next one, at most. Frame by frame where water enters or leaves or a band is laid, which
    /// changes what the next frame begins with.
    ///
    /// # Errors
    /// Those of [`Drive::run`], at the same frame; the solver ends with the frame that it is
    /// computing.
    pub(super) fn run_ahead<E: From<SolverError>>(
        &mut self,
        last: u32,
        stop: &AtomicBool,
        mut observe: impl FnMut(ComputedFrame) -> Result<(), E>,
    ) -> Result<End, E> {
        if self.changes_particles() {
            return self.run(last, stop, observe);
        }
        let (ahead, behind) = (&mut self.ahead, &mut self.behind);
        // Without a queue: the solver waits where the frame before is not read yet.
        let (sender, computed) = sync_channel(0);
        std::thread::scope(|scope| {
            let solver = std::thread::Builder::new()
                .name("solver".to_owned())
                .spawn_scoped(scope, move || ahead.run(last, stop, &sender))
                .expect("the system has a thread to spare");
            let read =
                (computed.into_iter()).try_for_each(|computed| observe(behind.read(computed?)?));
            // An error of a frame that was read is the first, whatever the solver ended with.
            let ended = solver.join();
            read?;
            Ok(ended.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
        })
    }

    /// Report of the last frame that the solver completed, even if that frame then exceeded a
    /// budget.
    pub(super) fn report(&self) -> Option<&StepReport> {
        self.behind.report.as_ref()
    }

    /// GPU memory in total and for neighbour lists, bytes; `None` on the CPU.
    pub fn bytes(&self) -> Option<(u64, u64)> {
        self.plan.as_ref().map(Plan::bytes)
    }

    /// GPU memory by purpose, with the times of passes if they were measured; empty on the CPU.
    pub fn shares(&self) -> Vec<Share> {
        let plan = self.plan.as_ref();
        plan.map_or(Vec::new(), |plan| plan.shares(&self.timings()))
    }

    /// Times of passes, if measured.
    pub fn timings(&self) -> Vec<PassTime> {
        self.ahead.solver.timings()
    }
}

impl Ahead<'_> {
    /// Computes frames up to `last` for `reader`, until that hangs up; setting `stop` ends it
    /// between two frames.
    fn run(
        &mut self,
        last: u32,
        stop: &AtomicBool,
        reader: &SyncSender<Result<Computed, SolverError>>,
    ) -> End {
        while self.frame < last {
            if stop.load(Ordering::Relaxed) {
                return End::Stopped;
            }
            let computed = self.compute();
            let is_last = computed.is_err();
            if reader.send(computed).is_err() || is_last {
                break;
            }
        }
        End::Done
    }

    fn compute(&mut self) -> Result<Computed, SolverError> {
        let begin = Instant::now();
        let end = self.scene.shot.time(self.frame + 1);
        let mut recorder = Recorder::new(self.scene, self.walls, end);
        let unread = match self.is_recorded {
            true => self.solver.compute(&mut recorder)?,
            false => self.solver.compute(&mut NoWatch)?,
        };
        self.frame += 1;
        self.walls = unread.walls;
        Ok(Computed {
            frame: self.frame,
            unread,
            pressures: match self.pressure_points[..] {
                [] => Vec::new(),
                _ => self.solver.pressures(&self.pressure_points)?,
            },
            looks: recorder.into_values(),
            begin,
        })
    }
}

impl Behind<'_> {
    fn read(&mut self, computed: Computed) -> Result<ComputedFrame, SolverError> {
        let mut step = self.open(computed)?;
        self.check(&mut step)?;
        Ok(step)
    }

    /// Reads a frame and checks that all of its particles are there.
    fn open(&mut self, computed: Computed) -> Result<ComputedFrame, SolverError> {
        let (particles, report) = computed.unread.read()?;
        self.report = Some(report.clone());
        if let Some(watch) = &self.watch {
            watch.inspect(&particles)?;
        }
        Ok(ComputedFrame {
            frame: computed.frame,
            particles,
            next_id: None,
            report,
            pressures: computed.pressures,
            looks: computed.looks,
            seconds: computed.begin.elapsed().as_secs_f64(),
        })
    }

    /// Checks a frame's budgets.
    fn check(&mut self, step: &mut ComputedFrame) -> Result<(), SolverError> {
        let watched = match &mut self.watch {
            Some(watch) => watch.look(&step.particles, &mut step.report),
            None => Ok(()),
        };
        self.report = Some(step.report.clone());
        Ok(watched?)
    }
}

/// The id after the last one of a state.
fn next_after(particles: &Particles) -> u32 {
    particles.id.last().map_or(0, |id| id + 1)
}
