//! A frame in mapped memory.

use std::sync::Arc;

use super::super::{
    SolveError,
    params::Counters,
    state::{Carried, check_finite},
};
use swell_domain::{bricks::Bricks, particles::Particles, poisson::FLUID};
use swell_gpu::readback::{First, Mapped};
use swell_scene::FlipScene;

/// The relative densities in cells of water, and the position of the densest cell.
pub(super) type Densities = (Vec<f64>, Option<[f64; 3]>);

/// Reads a state and its densities.
pub(super) type ReadFrame = dyn FnOnce() -> Result<(Particles, Densities), SolveError> + Send;

type OfState = (First<[f32; 3]>, First<[f32; 3]>, First<u32>);
type OfCells = (First<f32>, First<u32>);
type Found = (OfState, OfCells, First<Counters>, First<f32>, First<f32>);

/// A frame in mapped memory.
pub(super) struct Ended {
    pub(super) scene: Arc<FlipScene<'static>>,
    pub(super) frame: u32,
    pub(super) substeps: u32,
    /// With the walls before the frame.
    pub(super) state: Carried,
    /// Bricks of the last substep.
    pub(super) bricks: Bricks,
    /// The last but one are rows of attributes, one for each particle, if the scene has any; the
    /// last is the deep water, if it has a band.
    pub(super) found: Mapped<Found>,
}

impl Ended {
    /// Returns the state and its densities.
    pub(super) fn read(self) -> Result<(Particles, Densities), SolveError> {
        let ((position, velocity, id), (density, kind), _, rows, deep) = self.found.views()?;
        let places = self.state.ids.places(self.frame, id)?;
        let mut state = (self.state).state(&self.scene, &places, position, velocity);
        let names = self.scene.settings().attributes();
        for (k, name) in names.iter().enumerate() {
            let values = places.collect(|place| rows[names.len() * place + k]);
            state.attributes.insert((*name).to_owned(), values);
        }
        if !deep.is_empty() {
            state.deep = super::deep::read(&self.scene, &self.bricks, deep);
        }
        check_finite(self.frame, &state, None).map_err(|breach| match self.substeps {
            0 => breach,
            last => breach.in_substep(last),
        })?;
        Ok((state, self.densities(density, kind)))
    }

    fn densities(&self, density: &[f32], kind: &[u32]) -> Densities {
        let of_cells = (0u32..).zip(density).zip(kind);
        let in_water = of_cells.filter(|&(_, kind)| *kind == FLUID);
        let water: Vec<(u32, f64)> = in_water
            .map(|((element, density), _)| (element, f64::from(*density)))
            .collect();
        let cells = water.iter();
        let densest = (self.scene)
            .densest_cell(cells.map(|&(element, density)| (self.bricks.cell(element), density)));
        let water = water.into_iter().map(|(_, density)| density);
        (water.collect(), densest)
    }
}
