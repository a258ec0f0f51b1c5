//! State of a run after each frame, as marks observe it.

use std::cell::OnceCell;

use glam::DVec3;

use swell_domain::{
    bounds::Bounds,
    particles::Particles,
    probe::{elevation, enclosed_volume},
    signed_distance::SignedDistanceError,
    solver::StepReport,
};
use swell_scene::{Scene, Solver, probe::ProbeKind};
use swell_stage::{drive::ComputedFrame, prepare::Start};

/// A scene and the current state of its run.
pub(super) struct RunView<'a> {
    pub(super) scene: &'a Scene,
    pub(super) start: Start,
    /// Water of the start.
    pub(super) at_start: Particles,
    /// Number of finished frames.
    frame: u32,
    pub(super) state: Particles,
    /// Report of the last frame; `None` before the first one.
    pub(super) report: Option<StepReport>,
    /// Readings of the pressure probes, Pa.
    pub(super) pressures: Vec<Option<f64>>,
    /// Readings of the elevation probes, metres above the domain's floor.
    pub(super) elevations: Vec<Option<f64>>,
    /// Cached volume enclosed by the water's surface, m³; several marks use it.
    volume: OnceCell<f64>,
}

impl<'a> RunView<'a> {
    pub(super) fn new(scene: &'a Scene) -> Result<Self, SignedDistanceError> {
        let start = Start::of(scene)?;
        Ok(Self {
            state: start.particles.clone().filled(),
            at_start: start.particles.clone().filled(),
            start,
            scene,
            frame: 0,
            report: None,
            pressures: Vec::new(),
            elevations: Vec::new(),
            volume: OnceCell::new(),
        })
    }

    /// Updates the state with a finished frame.
    pub(super) fn take(&mut self, step: ComputedFrame) {
        let water = step.particles.filled();
        let (domain, spacing) = (&self.scene.domain, self.scene.particle_spacing());
        let probes = self.scene.probes.iter();
        let levels = probes.filter_map(|probe| match probe.kind {
            ProbeKind::Elevation { at } => Some(elevation(&water, spacing, domain, at)),
            _ => None,
        });
        self.elevations = levels.map(|level| Some(level? - domain.min.y)).collect();
        self.pressures = step.pressures;
        self.state = water;
        self.volume = OnceCell::new();
        self.report = Some(step.report);
        self.frame = step.frame;
    }

    /// Volume enclosed by the water's surface, m³.
    pub(super) fn volume(&self) -> f64 {
        let (domain, spacing) = (&self.scene.domain, self.scene.particle_spacing());
        *(self.volume).get_or_init(|| enclosed_volume(&self.state, spacing, domain))
    }

    /// Elapsed seconds of the shot.
    pub(super) fn time(&self) -> f64 {
        f64::from(self.frame) * self.scene.shot.frame_seconds()
    }

    /// Unit of lengths: the particle spacing with PBF, the cell size with FLIP, metres.
    pub(super) fn resolution(&self) -> f64 {
        self.scene.solver.resolution()
    }

    /// Cap on a particle's displacement in a substep, metres.
    pub(super) fn cap(&self) -> f64 {
        match &self.scene.solver {
            Solver::Pbf(pbf) => swell_domain::pbf::CAP * pbf.cfl * pbf.particle_spacing,
            Solver::Flip(flip) => swell_domain::flip::CAP * flip.cfl * flip.cell_size,
        }
    }

    /// Current faces of the box including wave makers, in the coordinates of the particles.
    pub(super) fn walls(&self) -> Bounds {
        let walls = self.scene.walls(&self.state.walls, self.time());
        let origin = self.scene.domain.min;
        Bounds {
            min: origin + walls.min,
            max: origin + walls.max,
        }
    }

    /// Depth of a point inside a solid at its current pose, metres; negative outside.
    pub(super) fn depth_in_solid(&self, at: DVec3) -> f64 {
        let boundary = &self.start.boundary;
        let still = boundary.distance.iter().map(|solid| -solid.sample(at));
        let movers = self.scene.moving_solids.iter().enumerate();
        let moving = movers.map(|(index, solid)| {
            let at = solid.pose(&self.state.bodies, self.time()).back(at);
            match boundary.shape(index) {
                Some(shape) => -shape.field.step(self.time(), 0.0).sample(at, 0.0),
                None => -boundary.moving[index].sample(at),
            }
        });
        still.chain(moving).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Kinetic energy of the bodies, and potential energy of their centres above the domain's
    /// floor, J.
    pub(super) fn energy_of_bodies(&self) -> f64 {
        let bodies = self.scene.bodies().zip(&self.state.bodies);
        let energy = bodies.map(|(it, state)| {
            let height = state.centre - self.scene.domain.min;
            let potential = -it.body.mass.mass * self.scene.water.gravity.dot(height);
            it.body.kinetic_energy(state) + potential
        });
        energy.sum()
    }

    /// Largest depth of a vertex of a body within another body, a solid or a wall, metres; 0 if
    /// none is.
    pub(super) fn overlap_of_bodies(&self) -> f64 {
        let (walls, time) = (self.walls(), self.time());
        let boundary = &self.start.boundary;
        let solids = || boundary.moving.iter().zip(&self.scene.moving_solids);
        let mut deepest = 0.0f64;
        for (k, (_, body)) in solids().enumerate() {
            if body.is_prescribed() {
                continue;
            }
            let pose = body.pose(&self.state.bodies, time);
            let poses = solids().enumerate().filter(|(other, _)| *other != k);
            let others: Vec<_> = poses
                .map(|(_, (grid, solid))| (grid, solid.pose(&self.state.bodies, time)))
                .collect();
            for vertex in &body.placed.mesh.vertices {
                let x = pose.place(*vertex);
                let beyond = (walls.min - x).max(x - walls.max).max_element();
                let still = boundary.distance.iter().map(|grid| -grid.sample(x));
                let moving = others.iter().map(|(grid, pose)| -grid.sample(pose.back(x)));
                deepest = still.chain(moving).fold(deepest.max(beyond), f64::max);
            }
        }
        deepest
    }
}
