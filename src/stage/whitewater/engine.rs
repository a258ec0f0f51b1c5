//! Whitewater's passes on what was asked for: an adapter, or the CPU with the f64 reference.

use crate::device::{Opened, SolverError};
use swell_domain::{
    boundary::Boundary,
    particles::Particles,
    solver::PassTime,
    whitewater::{Potentials, Settings},
};
use swell_scene::Scene;

pub(super) enum Engine {
    Gpu(Box<swell_solve::whitewater::Whitewater>),
    Cpu(Box<swell_reference::whitewater::Whitewater>),
}

impl Engine {
    /// For so many particles of `scene`, which is [`Scene::of_whitewater`] of what was baked.
    pub(super) fn new(
        opened: &Opened,
        scene: &Scene,
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

    /// Makes ready to move.
    pub(super) fn set(&mut self, settings: &Settings) -> Result<(), SolverError> {
        match self {
            Self::Gpu(engine) => engine.set(settings)?,
            Self::Cpu(engine) => engine.set(settings),
        }
        Ok(())
    }

    /// Takes the water of a frame; what of each particle makes whitewater.
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

    /// What passes took; nothing on the CPU, or unless timed.
    pub(super) fn times(&self) -> Vec<PassTime> {
        match self {
            Self::Gpu(engine) => engine.times(),
            Self::Cpu(_) => Vec::new(),
        }
    }
}
