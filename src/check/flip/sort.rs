//! Bricks with water, and particles in the order of their cells.

use glam::{DMat3, DVec3};

use crate::{
    comparison::{Io, PassResult, TracedBuffers},
    sort::{check_cells, check_slots},
    table::pair,
};
use swell_domain::bricks::CELLS;
use swell_gpu::buffer::Buf;
use swell_reference::flip::{
    Cloud, Sorted, assign_cells as reference_cells, survey as reference_survey,
};
use swell_scene::flip::Transfer;
use swell_solve::{SolveError, flip::buffers, trace::Begun};

use super::{Elements, FlipState, rows::*};

impl FlipState {
    /// Reads particles from four arrays: position, velocity, id, velocity gradients.
    fn cloud(
        &self,
        view: &TracedBuffers<'_>,
        [position, velocity]: [Buf<[f32; 3]>; 2],
        id: Buf<u32>,
        affine: Buf<f32>,
    ) -> Result<Cloud, SolveError> {
        Ok(Cloud {
            position: view.vectors(position, self.n)?,
            velocity: view.vectors(velocity, self.n)?,
            affine: self.slopes(view, affine)?,
            id: view.get(id, self.n)?,
        })
    }

    /// Reads velocity gradients; none without APIC.
    pub(super) fn slopes(
        &self,
        view: &TracedBuffers<'_>,
        affine: Buf<f32>,
    ) -> Result<Vec<DMat3>, SolveError> {
        let rows = match self.model.settings().transfer {
            Transfer::Flip => Vec::new(),
            Transfer::Apic => view.get(affine.retyped::<[f32; 9]>(), self.n)?,
        };
        let matrix = |row: &[f32; 9]| DMat3::from_cols_array(&row.map(f64::from)).transpose();
        Ok(rows.iter().map(matrix).collect())
    }

    /// Reads the particles after the pass.
    fn unsorted(&self, view: &TracedBuffers<'_>) -> Result<Cloud, SolveError> {
        let vectors = [buffers::POSITION, buffers::VELOCITY];
        self.cloud(view, vectors, buffers::ID, buffers::AFFINE)
    }

    fn sorted_now(&self, view: &TracedBuffers<'_>) -> Result<Cloud, SolveError> {
        let vectors = [buffers::SORTED_POSITION, buffers::SORTED_VELOCITY];
        self.cloud(
            view,
            vectors,
            buffers::sorted_id(self.n),
            buffers::SORTED_AFFINE,
        )
    }
}

pub(super) fn survey(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let reference = reference_survey(&state.model, &state.unsorted(&io.after)?);
    let found = io
        .after
        .get(buffers::SURVEY_IS_WET, reference.is_wet.len())?;
    let fastest = f64::from(io.after.one(buffers::SURVEY)?.speed_square);
    let exact = reference.speed * reference.speed;
    io.table.add(&SPEED, [pair(0, fastest, exact, [exact])]);
    let is_wet: Vec<u32> = reference.is_wet.iter().map(|&wet| u32::from(wet)).collect();
    io.table.add_exact(&WET, &found, &is_wet);
    // The device's substep follows from its own findings.
    let Begun {
        number,
        elapsed,
        before,
        ..
    } = state.begun;
    let deep = &state.begun.deep;
    let length = state.scene.shot.frame_seconds();
    let start = f64::from(state.frame) * length + elapsed;
    let (frame, remaining, speed) = (
        state.frame + 1,
        length - elapsed,
        fastest.sqrt().max(deep.speed),
    );
    let substep = match state.given_substep {
        Some(substep) => substep,
        None => {
            (state.scene.flip_substep(
                (&state.absorbers, &state.bodies),
                frame,
                start,
                remaining,
                speed,
                (number - 1, before),
            )?)
            .1
        }
    };
    let mut flags: Vec<bool> = found.iter().map(|&flag| flag != 0).collect();
    let laden = state.scene.band().map(|_| flags.clone());
    (flags.iter_mut().zip(&deep.was_wet)).for_each(|(flag, was)| *flag |= was);
    let step = (state.model).step(&substep, &state.absorbers, &state.bodies);
    let bricks = state.model.laden_bricks(&flags, laden.as_deref(), &step);
    state.elements = Some(Elements {
        cells: (CELLS * (bricks.active + 1)) as usize,
        stride: 0,
        substep,
        bricks,
    });
    Ok(())
}

pub(super) fn assign_cells(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let params = io.after.one(buffers::PARAMS)?;
    if let Some(elements) = &mut state.elements {
        elements.stride = params.stride as usize;
    }
    let (n, elements) = (state.n, state.elements());
    let positions = io.before.vectors(buffers::POSITION, n)?;
    let cell_of = io.after.get(buffers::CELL_OF, n)?;
    let reference = reference_cells(&state.model, &elements.bricks, &positions);
    let size = state.model.cell_size();
    check_cells(&CELL, &positions, size, &cell_of, &reference, io.table);
    let slot = io.after.get(buffers::SLOT_IN_CELL, n)?;
    let counts = io.after.get(buffers::CELL_START, elements.wet().end)?;
    check_slots([&COUNTS, &SLOTS], &cell_of, &slot, &counts, io.table);
    Ok(())
}

pub(super) fn reorder(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let n = state.n;
    let (before, after) = (state.unsorted(&io.after)?, state.sorted_now(&io.after)?);
    let order = io.before.get(buffers::ORDER, n)?;
    let at = |i: usize| order[i] as usize;
    let copy = |found: &[DVec3], source: &[DVec3], i: usize| pair(i, found[i], source[at(i)], []);
    io.table.each(&POSITION, 0..n, |i| {
        copy(&after.position, &before.position, i)
    });
    io.table.each(&VELOCITY, 0..n, |i| {
        copy(&after.velocity, &before.velocity, i)
    });
    let ids: Vec<u32> = (0..n).map(|i| before.id[at(i)]).collect();
    io.table.add_exact(&ID, &after.id, &ids);
    if !after.affine.is_empty() {
        for row in 0..3 {
            let of = |cloud: &Cloud, i: usize| cloud.affine[i].row(row);
            io.table.each(&AFFINE, 0..n, |i| {
                pair(i, of(&after, i), of(&before, at(i)), [])
            });
        }
    }
    let cell_of = io.before.get(buffers::CELL_OF, n)?;
    state.given = None;
    state.sorted = Some(Sorted {
        cell: (0..n).map(|i| cell_of[at(i)]).collect(),
        cloud: after,
        start: io
            .before
            .get(buffers::CELL_START, state.elements().wet().end + 1)?,
    });
    Ok(())
}
