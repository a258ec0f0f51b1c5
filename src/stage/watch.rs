//! Checks a bake's budgets at the end of each frame, the same for every solver.

use swell_domain::{
    budget::{Breach, Watched},
    particles::Particles,
    probe::volume,
    solver::StepReport,
};
use swell_scene::{Scene, budget::Before};

/// Tolerance for particles beyond a face of the domain, in rounding errors of a coordinate.
const ROUNDINGS: f64 = 4.0;

/// The state that the next frame is checked against.
pub(super) struct Watch<'a> {
    scene: &'a Scene,
    /// Number of the next frame.
    frame: u32,
    /// Energy, speed and volume of the state before it.
    before: Before,
    /// Ids of the particles, ascending.
    id: Vec<u32>,
}

impl<'a> Watch<'a> {
    /// Prepares for the frame after `last`, which ended with `state`; `start` is the start of the
    /// bake.
    pub(super) fn new(scene: &'a Scene, start: &Particles, last: u32, state: &Particles) -> Self {
        let mut watch = Self {
            scene,
            frame: last + 1,
            before: Before {
                start_volume: scene.budget.volume.map(|_| volume_of(scene, start)),
                ..Before::default()
            },
            id: start.id.clone(),
        };
        watch.take_over(state);
        watch
    }

    /// Prepares for the next frame, which begins with `state`: particles that entered or left
    /// change its energy, volume and ids.
    pub(super) fn take_over(&mut self, state: &Particles) {
        let scene = self.scene;
        let report = scene.report(state, [].into_iter());
        self.before.energy = scene.total_energy(state.amount(), &report);
        self.before.speed = state.max_speed().max(scene.fastest_body(&state.bodies));
        let more = state.len() as f64 - self.id.len() as f64;
        // A band's particles come and go, and the water stays.
        let exchanged = self
            .before
            .start_volume
            .as_mut()
            .filter(|_| scene.band().is_none());
        if let Some(volume) = exchanged {
            *volume += more * scene.particle_spacing().powi(3);
        }
        self.id.clone_from(&state.id);
    }

    /// Energy of the state before the next frame, J.
    pub(super) fn energy(&self) -> f64 {
        self.before.energy
    }

    /// Volume at the start, m³, if a budget watches it.
    pub(super) fn start_volume(&self) -> Option<f64> {
        self.before.start_volume
    }

    /// Checks that all particles of the next frame are there, within the domain and finite.
    ///
    /// # Errors
    /// If they are not.
    pub(super) fn inspect(&self, particles: &Particles) -> Result<(), Breach> {
        match particles.first_not_finite(None) {
            Some((count, first)) => Err(Breach::not_finite(self.frame, count, Some(first))),
            None => self.count(particles),
        }
    }

    /// Checks the next frame, and adds to its report what was measured for this. What a band took
    /// out and put in is in the state and in the report's energies.
    ///
    /// # Errors
    /// The first budget that it exceeds.
    pub(super) fn look(
        &mut self,
        particles: &Particles,
        report: &mut StepReport,
    ) -> Result<(), Breach> {
        let (scene, n) = (self.scene, particles.amount());
        self.id.clone_from(&particles.id);
        report.volume = scene.budget.volume.map(|_| volume_of(scene, particles));
        let budget = &scene.budget;
        budget.check_frame(scene, self.frame, n, report, &self.before)?;
        self.before.energy = scene.total_energy(n, report);
        let fastest = scene.fastest_body(&particles.bodies);
        self.before.speed = report.max_speed.max(fastest);
        self.frame += 1;
        Ok(())
    }

    /// Neither solver removes particles, and both clamp them to the domain. The particle count must
    /// therefore balance at every frame, and no budget can relax that.
    fn count(&self, particles: &Particles) -> Result<(), Breach> {
        let domain = &self.scene.domain;
        let farthest = domain.min.abs().max(domain.max.abs()).max_element();
        let room = domain.grown(ROUNDINGS * f64::from(f32::EPSILON) * farthest);
        let outside = particles.count_outside(&room);
        let lost = match particles.id == self.id {
            true => 0,
            false => {
                let pairs = particles.id.iter().zip(&self.id);
                let fewer = self.id.len().abs_diff(particles.len());
                fewer + pairs.filter(|(a, b)| a != b).count()
            }
        };
        if outside + lost == 0 {
            return Ok(());
        }
        let detail = format!(
            "{lost} of {} by their ids, {outside} outside",
            self.id.len()
        );
        let breach = Breach::new(self.frame, Watched::Particles, (outside + lost) as f64, 0.0);
        Err(Breach {
            detail: Some(detail),
            ..breach
        })
    }
}

/// Volume of the water as a probe measures it, m³.
pub(super) fn volume_of(scene: &Scene, particles: &Particles) -> f64 {
    volume(&particles.water(), scene.particle_spacing(), &scene.domain)
}
