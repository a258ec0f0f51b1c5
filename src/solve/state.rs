//! Transfer of a particle state to and from the device, and checks on it.

use std::sync::{
    Arc,
    atomic::{AtomicU32, Ordering},
};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use swell_domain::{
    absorber::AbsorberStates,
    body::BodyState,
    budget::{Breach, Watched},
    parallel,
    particles::{AT_ONCE, Particles},
};
use swell_gpu::program::Program;
use swell_scene::Scene;

use super::{
    SolveError,
    buffers::{ID, POSITION, VELOCITY},
};

/// Returns whether the particle count of `state` differs from the planned one.
///
/// # Errors Returns [`SolveError::Count`] if it differs although no water enters or leaves the
/// scene.
pub(super) fn is_other_count(
    scene: &Scene,
    planned: usize,
    state: &Particles,
) -> Result<bool, SolveError> {
    let given = state.len();
    match given == planned {
        false if !scene.has_sources() && scene.band().is_none() => {
            Err(SolveError::Count { planned, given })
        }
        is_same => Ok(!is_same),
    }
}

/// Uploads positions relative to the domain's minimum corner, velocities and ids.
pub(super) fn upload(program: &Program, scene: &Scene, state: &Particles) {
    let origin = scene.domain.min;
    let local = |p: &[f32; 3]| {
        let x = (Vec3::from_array(*p).as_dvec3() - origin).as_vec3();
        x.to_array()
    };
    let position = parallel::map_slice(&state.position, local);
    program.upload(POSITION, 0, &position);
    program.upload(VELOCITY, 0, &state.velocity);
    program.upload(ID, 0, &state.id);
}

/// Ids of a loaded state, ascending, and the index of each in it.
pub(super) struct Ids {
    all: Vec<u32>,
    /// Index of each id up to the last; `None` where the ids count from 0.
    index: Option<Vec<u32>>,
}

/// No index.
const NONE: u32 = u32::MAX;

impl Ids {
    pub(super) fn new(all: &[u32]) -> Self {
        let top = all.last().map_or(0, |&id| id as usize + 1);
        let index = (top > all.len()).then(|| {
            let mut index = vec![NONE; top];
            for (k, &id) in (0..).zip(all) {
                index[id as usize] = k;
            }
            index
        });
        let all = all.to_vec();
        Self { all, index }
    }

    pub(super) fn len(&self) -> usize {
        self.all.len()
    }

    pub(super) fn all(&self) -> &[u32] {
        &self.all
    }

    fn index(&self, id: u32) -> u32 {
        match &self.index {
            Some(index) => index.get(id as usize).copied().unwrap_or(NONE),
            None => id,
        }
    }

    /// Returns for each id of the state where it is among the downloaded ones.
    ///
    /// # Errors
    /// Returns the breach of `frame` if the downloaded ids are not a permutation of the state's.
    pub(super) fn places(&self, frame: u32, found: &[u32]) -> Result<Places, Breach> {
        let places: Vec<AtomicU32> = self.all.iter().map(|_| AtomicU32::new(NONE)).collect();
        let found = found.par_iter().with_min_len(AT_ONCE).enumerate();
        found.for_each(|(k, id)| {
            if let Some(place) = places.get(self.index(*id) as usize) {
                place.store(k as u32, Ordering::Relaxed);
            }
        });
        // As many ids as places: each id that is unknown or repeated leaves a place empty.
        let all = places.par_iter().with_min_len(AT_ONCE);
        let is_empty = |place: &&AtomicU32| place.load(Ordering::Relaxed) == NONE;
        match all.filter(is_empty).count() {
            0 => Ok(Places(places)),
            wrong => Err(Breach::new(frame, Watched::Particles, wrong as f64, 0.0)),
        }
    }
}

/// Indices into what was downloaded, in the order of the state.
pub(super) struct Places(Vec<AtomicU32>);

impl Places {
    /// Computes a value from each index.
    pub(super) fn collect<T: Send>(&self, value: impl Fn(usize) -> T + Sync) -> Vec<T> {
        parallel::map_slice(&self.0, |place| {
            value(place.load(Ordering::Relaxed) as usize)
        })
    }
}

/// What a solver keeps on the host of its state, besides what it computes of it.
#[derive(Clone)]
pub(super) struct Carried {
    pub(super) ids: Arc<Ids>,
    /// State of the absorbing walls.
    pub(super) walls: AbsorberStates,
    /// States of the bodies.
    pub(super) bodies: Vec<BodyState>,
    /// Length of the last substep, seconds; 0 before the first.
    pub(super) substep: f64,
}

impl Carried {
    pub(super) fn new(state: &Particles) -> Self {
        Self {
            ids: Arc::new(Ids::new(&state.id)),
            walls: state.walls,
            bodies: state.bodies.clone(),
            substep: state.substep,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.ids.len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the state with downloaded positions, relative to the domain's minimum corner, and
    /// velocities; without attributes.
    pub(super) fn state(
        &self,
        scene: &Scene,
        places: &Places,
        position: &[[f32; 3]],
        velocity: &[[f32; 3]],
    ) -> Particles {
        let origin = scene.domain.min;
        let world = |k: usize| {
            let x = origin + Vec3::from_array(position[k]).as_dvec3();
            x.as_vec3().to_array()
        };
        Particles {
            position: places.collect(world),
            velocity: places.collect(|k| velocity[k]),
            id: self.ids.all().to_vec(),
            walls: self.walls,
            bodies: self.bodies.clone(),
            substep: self.substep,
            ..Particles::default()
        }
    }

    /// Downloads current positions and velocities, in the order of the state and in world
    /// coordinates; without attributes.
    pub(super) fn look(
        &self,
        program: &Program,
        scene: &Scene,
        frame: u32,
    ) -> Result<Particles, SolveError> {
        let n = self.len();
        let found = program.map((POSITION.first(n), VELOCITY.first(n), ID.first(n)))?;
        let (position, velocity, id) = found.views()?;
        let places = self.ids.places(frame, id)?;
        Ok(self.state(scene, &places, position, velocity))
    }
}

/// Returns whether the next frame depends on the frame's state as it is written: world positions
/// are rounded, and absorbing walls follow the water.
pub(super) fn is_awaited(scene: &Scene) -> bool {
    scene.domain.min != DVec3::ZERO || scene.has_absorbers()
}

/// Checks that a state is finite. `density` holds one relative density per particle, in the state's
/// order, if the solver has it.
pub(super) fn check_finite(
    frame: u32,
    state: &Particles,
    density: Option<&[f64]>,
) -> Result<(), Breach> {
    match state.first_not_finite(density) {
        None => Ok(()),
        Some((count, first)) => Err(Breach::not_finite(frame, count, Some(first))),
    }
}
