//! Water without particles: from the grid of the substep before, and on with the water.

use glam::DVec3;

use crate::{
    comparison::{Io, PassResult, TracedBuffers, names},
    table::pair,
};
use swell_domain::bricks::CELLS;
use swell_reference::flip::{
    DeepCells, Motion, carry_deep as reference_carry_deep, fill_deep,
    place_deep as reference_place_deep,
};
use swell_solve::{
    SolveError,
    flip::buffers::{self, DEEP_VALUES},
};

use super::{FlipState, elements::faces_kept, rows::*};

/// Samples of a cubic about a position that rounding may put beside the next one, along each axis.
const ABOUT: i64 = 3;

/// Buffers that [`place_deep`] reads before the pass.
pub(super) fn placed() -> Vec<String> {
    let mut names = faces_kept();
    names.extend(names![buffers::DEEP_DEPTH]);
    names
}

impl FlipState {
    /// Reads the deep cells in the layout that `slot_of` gives for each slot of this substep.
    fn deep_cells(
        &self,
        view: &TracedBuffers<'_>,
        slot_of: impl Fn(usize) -> usize,
    ) -> Result<DeepCells, SolveError> {
        let elements = self.elements();
        let slots = 1
            + (0..=elements.bricks.active as usize)
                .map(&slot_of)
                .max()
                .unwrap_or(0);
        let cells = CELLS as usize;
        let values = view.scalars(buffers::DEEP, slots * DEEP_VALUES * cells)?;
        let value = |e: usize, plane: usize| match slot_of(e / cells) {
            0 => 0.0,
            slot => values[(DEEP_VALUES * slot + plane) * cells + e % cells],
        };
        let velocity = |e: usize| DVec3::from_array([0, 1, 2].map(|plane| value(e, plane)));
        Ok(DeepCells {
            bricks: elements.bricks.clone(),
            depth: (0..elements.cells).map(|e| value(e, 3)).collect(),
            velocity: (0..elements.cells).map(velocity).collect(),
        })
    }

    /// Makes the cells below the band full, as on the device.
    pub(super) fn fill(&self, view: &TracedBuffers<'_>, density: &mut [f64]) -> PassResult {
        if self.scene.band().is_some() {
            let depth = self.elements().scalars(view, buffers::DEEP_DEPTH)?;
            fill_deep(&self.model, &depth, density);
        }
        Ok(())
    }
}

pub(super) fn place_deep(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (elements, step) = (state.elements(), state.step());
    let slots = io
        .before
        .get(buffers::DEEP_SLOT, elements.bricks.active as usize + 1)?;
    let before = state.deep_cells(&io.before, |slot| slots[slot] as usize)?;
    let mut reference = elements.faces(&io.before)?;
    let (model, bricks, space) = (&state.model, &elements.bricks, state.space());
    let depth = reference_place_deep(model, &step, bricks, &before, space, &mut reference);
    let (found, active) = (elements.faces(&io.after)?, elements.active());
    let depths = elements.scalars(&io.after, buffers::DEEP_DEPTH)?;
    io.table.each(&DEEP_DEPTH, active.clone(), |e| {
        pair(e, depths[e], depth[e], [])
    });
    io.table.each(&DEEP_OLD, active.clone(), |e| {
        pair(e, found.change[e], reference.change[e], [])
    });
    io.table.each(&DEEP_NEW, active.clone(), |e| {
        let v = reference.velocity[e];
        pair(
            e,
            found.velocity[e],
            v,
            [step.velocity_step.length(), v.length()],
        )
    });
    io.table.add_exact(
        &DEEP_KNOWN,
        &found.layer[active.clone()],
        &reference.layer[active],
    );
    Ok(())
}

/// Returns the velocity nearest to `found` of those that the reference has within `place`, in
/// cells, of where the face's water comes from. The range that bounds the cubic is that of the
/// faces around and jumps where the water comes from the border of two cells.
fn nearest_answer(motion: &Motion<'_>, axis: usize, cell: [u32; 3], place: f64, found: f64) -> f64 {
    let lower = DVec3::from_array(cell.map(f64::from));
    let origin = motion.origin(lower + 0.5 - 0.5 * DVec3::AXES[axis]);
    let answers = (0..27).map(|k| {
        let side = DVec3::from_array([k % 3, k / 3 % 3, k / 9].map(|k| f64::from(k) - 1.0));
        motion.component(axis, origin + place * side)
    });
    let nearer = |a: f64, b: f64| match (b - found).abs() < (a - found).abs() {
        true => b,
        false => a,
    };
    answers.reduce(nearer).unwrap_or(f64::NAN)
}

pub(super) fn carry_deep(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (elements, step) = (state.elements(), state.step());
    let (model, bricks) = (&state.model, &elements.bricks);
    let velocity = elements.planes(&io.before, buffers::FACE_VELOCITY)?;
    let depth = elements.scalars(&io.before, buffers::DEEP_DEPTH)?;
    let displacement = match model.settings().density_correction {
        true => {
            let planes = buffers::face_displacement(elements.stride);
            Some(elements.planes(&io.before, planes)?)
        }
        false => None,
    };
    let motion = Motion {
        model,
        step: &step,
        bricks,
        velocity: &velocity,
        displacement: displacement.as_deref(),
    };
    let reference = reference_carry_deep(&motion, &depth);
    let wet = bricks.wet as usize;
    let found = state.deep_cells(&io.after, |slot| if slot > wet { 0 } else { slot })?;
    let fastest = velocity.iter().map(|v| v.length()).fold(0.0, f64::max);
    let farthest = DVec3::from_array(model.cells.map(f64::from)).length() * model.cell_size();
    let place = START.of([farthest, step.length, fastest, 0.0]) / model.cell_size();
    // The water of a cell may come from as far as the cap lets it.
    let most = (step.length * fastest / model.cell_size()).ceil() as i64;
    let reach = most + ABOUT;
    let range = |of: &dyn Fn(usize) -> f64, e: usize| {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let cell = bricks.cell(e as u32).map(i64::from);
        let side = 2 * reach + 1;
        for k in 0..side.pow(3) {
            let step = [k % side, k / side % side, k / (side * side)].map(|k| k - reach);
            let there: [i64; 3] = std::array::from_fn(|axis| cell[axis] + step[axis]);
            let value = of(bricks.element(there) as usize);
            (low, high) = (low.min(value), high.max(value));
        }
        [high - low, low.abs().max(high.abs())]
    };
    let mut of_axis = |axis: usize| {
        io.table.each(&CARRIED_VELOCITY, elements.wet(), |e| {
            let [range, most] = range(&|other| velocity[other][axis], e);
            let (found, exact) = (found.velocity[e][axis], reference.velocity[e][axis]);
            let magnitudes = [place, range, most];
            let exact = match (found - exact).abs() <= CARRIED_VELOCITY.tolerance.of(magnitudes) {
                true => exact,
                false => nearest_answer(&motion, axis, bricks.cell(e as u32), place, found),
            };
            pair(e, found, exact, magnitudes)
        });
    };
    (0..3).for_each(&mut of_axis);
    io.table.each(&CARRIED_DEPTH, elements.wet(), |e| {
        let [range, most] = range(&|other| depth[other], e);
        pair(e, found.depth[e], reference.depth[e], [place, range, most])
    });
    Ok(())
}
