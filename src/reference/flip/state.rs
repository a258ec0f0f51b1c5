//! The state of FLIP on the CPU, and the passes' form of it.

use glam::{DMat3, DVec3, Vec3};

use super::{Cloud, DeepCells, Flip, sort::by_id};
use crate::ReferenceError;
use swell_domain::{
    band::Band,
    bricks::Bricks,
    deep::Deep,
    particles::Particles,
    solver::{Observed, Solver, Span, Watch},
};
use swell_scene::flip::{AFFINE, Transfer};

impl Flip {
    /// Returns the current state in the form that the passes take.
    pub fn cloud(&self) -> Cloud {
        let state = &self.state;
        let origin = self.model.scene.domain.min;
        let affine = |k: usize| {
            let at = |name: &str| f64::from(state.attributes.get(name).map_or(0.0, |v| v[k]));
            let row = |first: usize| {
                DVec3::new(
                    at(AFFINE[first]),
                    at(AFFINE[first + 1]),
                    at(AFFINE[first + 2]),
                )
            };
            DMat3::from_cols(row(0), row(3), row(6)).transpose()
        };
        let is_apic = self.model.settings().transfer == Transfer::Apic;
        let with_affine = if is_apic { state.len() } else { 0 };
        Cloud {
            position: (state.position.iter()).map(|x| widen(x) - origin).collect(),
            velocity: state.velocity.iter().map(widen).collect(),
            affine: (0..with_affine).map(affine).collect(),
            id: state.id.clone(),
        }
    }

    /// Rounds positions and velocities into a state, in its order.
    pub(super) fn round(&self, cloud: &Cloud, order: &[usize], state: &mut Particles) {
        let origin = self.model.scene.domain.min;
        for (slot, &k) in order.iter().enumerate() {
            state.position[slot] = (origin + cloud.position[k]).as_vec3().to_array();
            state.velocity[slot] = cloud.velocity[k].as_vec3().to_array();
        }
    }

    pub(super) fn write(&mut self, cloud: &Cloud) {
        let order = by_id(cloud);
        let mut state = std::mem::take(&mut self.state);
        self.round(cloud, &order, &mut state);
        self.state = state;
        if !cloud.affine.is_empty() {
            for (place, name) in AFFINE.into_iter().enumerate() {
                let value = |&k: &usize| cloud.affine[k].row(place / 3)[place % 3] as f32;
                let values = order.iter().map(value).collect();
                self.state.attributes.insert(name.to_owned(), values);
            }
        }
    }

    /// Returns the present deep cells, rounded.
    pub(super) fn rounded_deep(&self) -> Deep {
        let deep = self.deep.as_ref();
        deep.map_or_else(Deep::default, |deep| deep.rounded(&self.model))
    }

    /// Returns the deep cells of the state on the bricks around it, and flags of these bricks;
    /// `None` without a band.
    pub(super) fn deep_cells(&self) -> Option<(DeepCells, Vec<bool>)> {
        let band: Band = self.model.scene.band()?;
        let is_wet = band.wet_bricks(&self.state);
        let bricks = Bricks::periodic(band.stored_cells(), band.periodic, &is_wet, 1, 1);
        Some((DeepCells::of(&bricks, &self.state.deep), is_wet))
    }
}

fn widen(v: &[f32; 3]) -> DVec3 {
    Vec3::from_array(*v).as_dvec3()
}

impl Flip {
    /// Shows the state within a frame to what watches it.
    pub(super) fn show(
        &self,
        span: Span,
        cloud: &Cloud,
        watch: &mut dyn Watch,
    ) -> Result<(), ReferenceError> {
        let wanted = watch.wants(span);
        if !wanted.is_any() {
            return Ok(());
        }
        let mut seen = Observed::default();
        if wanted.particles {
            seen.particles.id.clone_from(&self.state.id);
            seen.particles.position.clone_from(&self.state.position);
            seen.particles.velocity.clone_from(&self.state.velocity);
            seen.particles.substep = self.state.substep;
            self.round(cloud, &by_id(cloud), &mut seen.particles);
            seen.particles.deep = self.rounded_deep();
        }
        if wanted.pressures {
            seen.pressures = self.pressures(&self.model.scene.pressure_points())?;
        }
        if let Some(gauge) = self.gauge() {
            let origin = self.model.scene.domain.min;
            let patches = wanted.patches.iter();
            seen.patches = patches
                .map(|patch| gauge.on_face(patch.at - origin, patch.normal()))
                .collect();
        }
        watch.look(span, seen);
        Ok(())
    }
}
