//! The loop that takes a scene from frame to frame, on a GPU or on the CPU: bakes, replays and experiments stand on it.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::Instant,
};

use glam::DVec3;

use crate::{
    cache::ProbeValues,
    domain::{
        particles::Particles,
        solver::{Solver, StepReport},
    },
    scene::Scene,
};

use super::{
    device::{Built, Opened, SolverError},
    prepare::Start,
    probes::{Recorder, is_recorded},
    watch::Watch,
};

/// A scene's solver, and the frame at which it stands.
pub struct Drive<'a> {
    scene: &'a Scene,
    solver: Box<dyn Solver<Error = SolverError>>,
    /// GPU memory in all and for neighbour lists, bytes; `None` on the CPU.
    pub bytes: Option<(u64, u64)>,
    frame: u32,
    watch: Option<Watch<'a>>,
    /// Where pressures are read after each frame.
    pressure_points: Vec<DVec3>,
    /// Whether probes look at substeps.
    is_recorded: bool,
    /// Of the last frame that the solver finished, also where that frame then broke a budget.
    report: Option<StepReport>,
}

/// A frame as it was computed.
#[derive(Clone, Debug)]
pub struct Step {
    /// Its number.
    pub frame: u32,
    /// State at its end.
    pub particles: Particles,
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
        let Built { solver, bytes } = opened.build(scene, start, is_timed)?;
        Ok(Self {
            scene,
            solver,
            bytes,
            frame: 0,
            watch: None,
            pressure_points: Vec::new(),
            is_recorded: false,
            report: None,
        })
    }

    /// Takes over `state`, the end of frame `frame`. Nothing is held against budgets from there on.
    ///
    /// # Errors
    /// The device; a state that is not the scene's.
    pub fn load(&mut self, frame: u32, state: &Particles) -> Result<(), SolverError> {
        self.solver.load(frame, state)?;
        (self.frame, self.watch) = (frame, None);
        Ok(())
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
    pub(super) fn with_probes(mut self) -> Self {
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
        let mut recorder = Recorder::new(self.scene, self.scene.shot.time(self.frame + 1));
        let (particles, mut report) = match self.is_recorded {
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
        Ok(Step {
            frame: self.frame,
            particles,
            report,
            pressures,
            looks: recorder.into_values(),
            seconds: begin.elapsed().as_secs_f64(),
        })
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

    /// Seconds and runs by pass, where measured.
    pub fn timings(&self) -> Vec<(&'static str, f64, u64)> {
        self.solver.timings()
    }
}
