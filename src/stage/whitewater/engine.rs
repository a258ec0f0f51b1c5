//! Runs the whitewater passes on an adapter, or on the CPU with the f64 reference.

use crate::device::{Opened, SolverError};
use swell_domain::{
    boundary::Boundary,
    particles::Particles,
    solver::PassTime,
    whitewater::{CompleteSettings, Potentials},
};
use swell_scene::PbfScene;

pub(super) enum Engine {
    Gpu(Box<swell_solve::whitewater::Whitewater>),
    Cpu(Box<swell_reference::whitewater::Whitewater>),
}

impl Engine {
    /// Prepares for `water` particles of `scene`, which is
    /// [`of_whitewater`](swell_scene::Scene::of_whitewater) of the baked
    /// scene.
    pub(super) fn new(
        opened: &Opened,
        scene: &PbfScene,
        boundary: &Boundary,
        water: usize,
        is_timed: bool,
    ) -> Result<Self, SolverError> {
        Ok(match opened {
            Opened::Gpu(context) => Self::Gpu(Box::new(swell_solve::whitewater::Whitewater::new(
                context, scene, boundary, water, is_timed,
            )?)),
            Opened::Cpu => Self::Cpu(Box::new(swell_reference::whitewater::Whitewater::new(
                scene, boundary,
            ))),
        })
    }

    /// Sets the settings; required before `advance`.
    pub(super) fn set(&mut self, settings: &CompleteSettings) -> Result<(), SolverError> {
        match self {
            Self::Gpu(engine) => engine.set(settings)?,
            Self::Cpu(engine) => engine.set(settings),
        }
        Ok(())
    }

    /// Evaluates the water of a frame and returns the potentials of each particle to make
    /// whitewater.
    pub(super) fn survey(
        &mut self,
        water: &Particles,
        time: f64,
        seconds: f64,
    ) -> Result<Vec<Potentials>, SolverError> {
        Ok(match self {
            Self::Gpu(engine) => engine.survey(water, time, seconds)?,
            Self::Cpu(engine) => engine.survey(water, time, seconds),
        })
    }

    /// Moves whitewater to that frame.
    pub(super) fn advance(&mut self, white: &mut Particles, frame: u32) -> Result<(), SolverError> {
        match self {
            Self::Gpu(engine) => engine.advance(white, frame)?,
            Self::Cpu(engine) => engine.advance(white, frame)?,
        }
        Ok(())
    }

    /// Times of passes; empty on the CPU, or unless timed.
    pub(super) fn times(&self) -> Vec<PassTime> {
        match self {
            Self::Gpu(engine) => engine.times(),
            Self::Cpu(_) => Vec::new(),
        }
    }
}
