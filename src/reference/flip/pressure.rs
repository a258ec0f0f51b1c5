//! Reference passes around the pressure solve; `domain::poisson` builds the system and its
//! right-hand side.

use glam::DVec3;

use super::{
    BodyCells, Centers, Model, OpenSpace,
    bodies::{add_bodies, carry_flux},
    grid::{along, per_cell, planes},
};
use swell_domain::{
    body::Six,
    bricks::Bricks,
    poisson::{AIR, Cells, FLUID, System},
};

/// Inputs of the linear system, and of the update of the faces from its solution.
#[derive(Clone, Debug)]
pub struct Waters<'a> {
    bricks: &'a Bricks,
    space: &'a OpenSpace,
    /// Open fractions of the lower faces, as planes.
    open: Vec<f64>,
    distance: Option<&'a [f64]>,
    /// Σ ± (1 − f) u_solid of each cell, m/s.
    flux: Vec<f64>,
    /// Flux that makes up for the contraction of each cell, m/s; empty if none does.
    contraction: &'a [f64],
    bodies: &'a [BodyCells],
}

impl<'a> Waters<'a> {
    /// Collects the inputs of a substep; the ghost-fluid surface is included if the scene uses it.
    pub fn new(
        model: &Model,
        bricks: &'a Bricks,
        space: &'a OpenSpace,
        centers: &'a Centers,
    ) -> Self {
        Self {
            bricks,
            space,
            open: planes(&space.open),
            distance: model.has_ghost_fluid().then_some(&centers.distance),
            flux: space.solid_flux.clone(),
            contraction: &[],
            bodies: &[],
        }
    }

    /// Lets the pressure move bodies.
    #[must_use]
    pub fn with_bodies(self, bodies: &'a [BodyCells]) -> Self {
        Self { bodies, ..self }
    }

    /// Makes up for the contraction of the water on straight paths ([`super::find_contraction`]).
    #[must_use]
    pub fn with_contraction(self, contraction: &'a [f64]) -> Self {
        Self {
            contraction,
            ..self
        }
    }

    /// Adds to the solids' flux that of changes of the bodies' velocities.
    pub(super) fn carry_flux(&mut self, changes: &[Six]) {
        carry_flux(self.bodies, changes, &mut self.flux);
    }

    /// Adds to the solids' flux that of changes of the velocities of a system's bodies.
    pub(super) fn carry_changes(&mut self, system: &System, changes: &[Six]) {
        let mut flux = vec![0.0; system.cell.len()];
        for (body, change) in system.bodies.iter().zip(changes) {
            body.add_flux(change, &mut flux);
        }
        self.add_flux(system, &flux);
    }

    /// Adds to the solids' flux, by row.
    pub(super) fn add_flux(&mut self, system: &System, flux: &[f64]) {
        for (&element, added) in system.cell.iter().zip(flux) {
            self.flux[element as usize] += added;
        }
    }

    /// Returns the solids' flux out of each cell, m/s.
    pub(super) fn flux(&self) -> &[f64] {
        &self.flux
    }

    /// Returns the inputs in the form that [`System::new`] takes.
    pub fn cells(&self) -> Cells<'_, f64> {
        Cells {
            bricks: self.bricks,
            kind: &self.space.kind,
            open: &self.open,
            distance: self.distance,
        }
    }

    /// Reference pass of `pressure/build_system`, with the bodies that the pressure moves.
    pub fn system(&self) -> System {
        let mut system = System::new(self.cells());
        add_bodies(self.bodies, self.space.kind.len(), &mut system);
        system
    }

    /// Reference pass of `pressure/divergence`: −(Σ ± f u + solid flux − contraction's) for each
    /// row, m/s.
    pub fn divergence(&self, system: &System, velocity: &[DVec3]) -> Vec<f64> {
        let mut flux = self.flux.clone();
        for (flux, made_up) in flux.iter_mut().zip(self.contraction) {
            *flux -= made_up;
        }
        system.rhs(self.cells(), &planes(velocity), &flux)
    }

    /// Converts values per row to values per element; 0 where there is no row.
    pub fn by_element(&self, system: &System, rows: &[f64]) -> Vec<f64> {
        let mut values = vec![0.0; self.space.kind.len()];
        for (&element, &value) in system.cell.iter().zip(rows) {
            values[element as usize] = value;
        }
        values
    }

    /// Returns q − q' across the lower faces, divided by θ at the surface; 0 where no water may
    /// flow.
    fn differences(&self, q: &[f64]) -> Vec<DVec3> {
        let cells = self.cells();
        let kind = |e: u32| self.space.kind[e as usize];
        per_cell(self.bricks, |own| {
            DVec3::from_array([0, 1, 2].map(|axis| {
                let before = self.bricks.near(own, along(axis, -1));
                if self.space.open[own as usize][axis] <= 0.0 {
                    return 0.0;
                }
                let part = match (kind(before), kind(own)) {
                    (FLUID, FLUID) => 1.0,
                    (AIR, FLUID) => cells.theta(own, before),
                    (FLUID, AIR) => cells.theta(before, own),
                    _ => return 0.0,
                };
                (q[own as usize] - q[before as usize]) / part
            }))
        })
    }

    /// Reference pass of `pressure/project`: subtracts the gradient of q, given by element, from
    /// the velocities.
    pub fn project(&self, q: &[f64], velocity: &mut [DVec3]) {
        for (velocity, difference) in velocity.iter_mut().zip(self.differences(q)) {
            *velocity -= difference;
        }
    }

    /// Reference pass of `pressure/displace`: returns displacements at the lower faces from the
    /// density correction's q, given by element, metres.
    pub fn displace(&self, q: &[f64]) -> Vec<DVec3> {
        self.differences(q)
            .into_iter()
            .map(|difference| -difference)
            .collect()
    }
}

/// Reference pass of `pressure/density_source`: the right-hand side of the density correction,
/// metres.
pub fn density_source(model: &Model, system: &System, centers: &Centers) -> Vec<f64> {
    let excess = |&element: &u32| centers.excess[element as usize];
    (system.cell.iter())
        .map(|element| model.cell_size() * excess(element))
        .collect()
}
