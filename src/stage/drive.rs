//! The loop that takes a scene from frame to frame, on a GPU or on the CPU: bakes, replays and experiments stand on it.

use std::{
    borrow::Cow,
    sync::atomic::{AtomicBool, Ordering},
    time::Instant,
};

use glam::DVec3;

use swell_cache::ProbeValues;
use swell_domain::{
    answer::Answers,
    particles::Particles,
    signed_distance::SignedDistance,
    solver::{PassTime, Solver, StepReport},
    sources::{Exchange, Solids, Sources},
};
use swell_scene::Scene;
use swell_solve::plan::{Plan, Share};

use super::{
    device::{Built, Opened, SolverError},
    prepare::Start,
    probes::{Recorder, is_recorded},
    watch::Watch,
};

/// A scene's solver, and the frame at which it stands.
pub struct Drive<'a> {
    scene: &'a Scene,
    /// What enters and leaves; nothing where neither happens.
    sources: Option<Exchanged>,
    /// The least that a particle may have which enters.
    first_id: u32,
    solver: Box<dyn Solver<Error = SolverError>>,
    /// What the GPU was planned to hold and run; `None` on the CPU.
    plan: Option<Plan>,
    frame: u32,
    /// What walls that absorb do from there on.
    walls: Answers,
    /// Of the particle that enters next.
    next_id: u32,
    watch: Option<Watch<'a>>,
    /// Where pressures are read after each frame.
    pressure_points: Vec<DVec3>,
    /// Whether probes look at substeps.
    is_recorded: bool,
    /// Of the last frame that the solver finished, also where that frame then broke a budget.
    report: Option<StepReport>,
}

/// What enters and leaves at the frames' ends, and the solids that it meets: at rest, and where each that moves stood at the start.
struct Exchanged {
    sources: Sources,
    still: Option<SignedDistance>,
    moving: Vec<SignedDistance>,
}

impl Exchanged {
    /// `None` where nothing enters or leaves.
    fn of(start: &Start) -> Option<Self> {
        // Drains look at no solids.
        let meets_solids = !start.sources.emitters.is_empty();
        let boundary = meets_solids.then_some(&start.boundary);
        (!start.sources.is_empty()).then(|| Self {
            sources: start.sources.clone(),
            still: boundary.and_then(|it| it.distance.clone()),
            moving: boundary.map_or_else(Vec::new, |it| it.moving.clone()),
        })
    }
}

/// A frame as it was computed.
#[derive(Clone, Debug)]
pub struct Step {
    /// Its number.
    pub frame: u32,
    /// State at its end, with what entered and without what left.
    pub particles: Particles,
    /// Of the particle that enters next; only where water enters or leaves.
    pub next_id: Option<u32>,
    /// What its substeps did.
    pub report: StepReport,
    /// Pressures at the scene's [`pressure_points`](Scene::pressure_points), Pa; empty where none are read.
    pub pressures: Vec<Option<f64>>,
    /// What probes saw while the frame was computed, by probe: values, of one with a rate of its own each look's time and
    /// its values.
    pub looks: ProbeValues,
    /// Wall clock of all that, seconds.
    pub seconds: f64,
}

/// How a run ended that met no fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The last frame is done.
    Done,
    /// A signal came before.
    Stopped,
}

impl<'a> Drive<'a> {
    /// Builds the scene's solver and loads the start, as frame 0.
    ///
    /// # Errors
    /// A buffer over the adapter's limits; the device.
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

    /// Builds the scene's solver; it needs a state before it goes anywhere.
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
            first_id: next_after(&start.particles),
            solver,
            plan,
            frame: 0,
            walls: Answers::default(),
            next_id: 0,
            watch: None,
            pressure_points: Vec::new(),
            is_recorded: false,
            report: None,
        })
    }

    /// Takes over `state`, the end of frame `frame`. Nothing is held against budgets from there on. Where water enters, ids
    /// go on after those of the state and of the scene's start.
    ///
    /// # Errors
    /// The device; a state that is not the scene's.
    pub fn load(&mut self, frame: u32, state: &Particles) -> Result<(), SolverError> {
        self.solver.load(frame, state)?;
        (self.frame, self.watch) = (frame, None);
        self.walls = state.walls;
        self.next_id = self.first_id.max(next_after(state));
        Ok(())
    }

    /// Ids go on with that one, where there is one.
    pub(super) fn go_on_with(&mut self, next_id: Option<u32>) {
        self.next_id = next_id.unwrap_or(self.next_id);
    }

    /// Loads a state and holds each frame after it against the scene's budgets; `start` is that of the bake.
    pub(super) fn load_watched(
        &mut self,
        start: &Particles,
        frame: u32,
        state: &Particles,
    ) -> Result<(), SolverError> {
        self.load(frame, state)?;
        self.watch = Some(Watch::new(self.scene, start, frame, state));
        Ok(())
    }

    /// The same with pressures read after each frame, where the scene has probes of pressure.
    pub fn with_pressures(mut self) -> Self {
        self.pressure_points = self.scene.pressure_points();
        self
    }

    /// The same, and with looks while a frame is computed for the probes that ask for them.
    pub fn with_probes(mut self) -> Self {
        let mut probes = self.scene.probes.iter();
        self.is_recorded = probes.any(is_recorded);
        self.with_pressures()
    }

    /// Computes the next frame.
    ///
    /// # Errors
    /// The device, the numbers, or a budget where frames are held against those.
    pub fn advance(&mut self) -> Result<Step, SolverError> {
        let begin = Instant::now();
        let scene = self.standing();
        let mut recorder = Recorder::new(&scene, self.scene.shot.time(self.frame + 1));
        let (mut particles, mut report) = match self.is_recorded {
            true => self.solver.advance_watched(&mut recorder)?,
            false => self.solver.advance()?,
        };
        let watched = match &mut self.watch {
            Some(watch) => watch.look(&particles, &mut report),
            None => Ok(()),
        };
        self.report = Some(report.clone());
        watched?;
        let pressures = match self.pressure_points[..] {
            [] => Vec::new(),
            _ => self.solver.pressures(&self.pressure_points)?,
        };
        self.frame += 1;
        self.walls = particles.walls;
        report.exchange = self.exchange(&mut particles)?;
        Ok(Step {
            frame: self.frame,
            particles,
            next_id: self.sources.as_ref().map(|_| self.next_id),
            report,
            pressures,
            looks: recorder.into_values(),
            seconds: begin.elapsed().as_secs_f64(),
        })
    }

    /// The scene with its walls where they stand: probes look at them while a frame is computed.
    fn standing(&self) -> Cow<'a, Scene> {
        if self.walls == Answers::default() || !self.is_recorded {
            return Cow::Borrowed(self.scene);
        }
        let walls = self.walls;
        Cow::Owned(self.scene.after(&Particles {
            walls,
            ..Particles::default()
        }))
    }

    /// Lets water in and out at the frame's end, where the scene does that.
    fn exchange(&mut self, particles: &mut Particles) -> Result<Option<Exchange>, SolverError> {
        let Some(it) = &self.sources else {
            return Ok(None);
        };
        let scene = self.scene;
        let solids = Solids {
            still: it.still.as_ref(),
            moving: &it.moving,
            pose: &|index, seconds| scene.moving_solids[index].pose(seconds),
        };
        let next_id = &mut self.next_id;
        let exchange = it.sources.exchange(self.frame, &solids, particles, next_id);
        if self.watch.is_some() {
            let budget = &self.scene.budget;
            budget.check_count(self.frame, particles.len())?;
        }
        if exchange.entered > 0 || exchange.left > 0 {
            self.solver.load(self.frame, particles)?;
            if let Some(watch) = &mut self.watch {
                watch.take_over(particles);
            }
        }
        Ok(Some(exchange))
    }

    /// Computes frames up to `last` and hands each to `observe`; `stop` ends it between two frames.
    ///
    /// # Errors
    /// Those of [`Drive::advance`] and of `observe`.
    pub fn run<E: From<SolverError>>(
        &mut self,
        last: u32,
        stop: &AtomicBool,
        mut observe: impl FnMut(Step) -> Result<(), E>,
    ) -> Result<End, E> {
        while self.frame < last {
            if stop.load(Ordering::Relaxed) {
                return Ok(End::Stopped);
            }
            observe(self.advance()?)?;
        }
        Ok(End::Done)
    }

    /// What the last frame did that the solver finished, also where it then broke a budget.
    pub(super) fn report(&self) -> Option<&StepReport> {
        self.report.as_ref()
    }

    /// GPU memory in all and for neighbour lists, bytes; `None` on the CPU.
    pub fn bytes(&self) -> Option<(u64, u64)> {
        self.plan.as_ref().map(Plan::bytes)
    }

    /// What the GPU takes, by what it is there for, with the times of passes where they were measured; empty on the CPU.
    pub fn shares(&self) -> Vec<Share> {
        let plan = self.plan.as_ref();
        plan.map_or(Vec::new(), |plan| plan.shares(&self.timings()))
    }

    /// What passes took, where measured.
    pub fn timings(&self) -> Vec<PassTime> {
        self.solver.timings()
    }
}

/// The id behind those of a state.
fn next_after(particles: &Particles) -> u32 {
    particles.id.last().map_or(0, |id| id + 1)
}
