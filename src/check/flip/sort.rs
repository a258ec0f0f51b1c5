//! Which bricks have water, and particles in the order of their cells.

use glam::{DMat3, DVec3};

use crate::{
    check::{
        engine::Io,
        sort::{check_cells, check_slots},
        table::{Table, pair},
    },
    domain::bricks::CELLS,
    reference::flip::{Cloud, Sorted, assign_cells as twin_cells, survey as twin_survey},
    scene::flip::Transfer,
    solve::{SolveError, params::FlipParams, trace::Begun},
};

use super::{Elements, FlipState, rows::*};

/// Buffers of the particles as they come, and as they are sorted.
const UNSORTED: [&str; 4] = ["position", "velocity", "id", "affine"];
const SORTED: [&str; 4] = [
    "sorted_position",
    "sorted_velocity",
    "sorted_id",
    "sorted_affine",
];

impl FlipState {
    fn cloud(&self, io: &Io<'_>, names: [&str; 4]) -> Result<Cloud, SolveError> {
        let [position, velocity, id, affine] = names;
        let rows = match self.model.settings().transfer {
            Transfer::Flip => Vec::new(),
            Transfer::Apic => io.after::<[f32; 9]>(affine, self.n)?,
        };
        let matrix = |row: &[f32; 9]| DMat3::from_cols_array(&row.map(f64::from)).transpose();
        Ok(Cloud {
            position: io.vectors(position, self.n)?,
            velocity: io.vectors(velocity, self.n)?,
            affine: rows.iter().map(matrix).collect(),
            id: io.after(id, self.n)?,
        })
    }

    /// Particles as the pass left them.
    pub(super) fn unsorted(&self, io: &Io<'_>) -> Result<Cloud, SolveError> {
        self.cloud(io, UNSORTED)
    }
}

pub(super) fn survey(
    state: &mut FlipState,
    io: &Io<'_>,
    table: &mut Table,
) -> Result<(), SolveError> {
    let twin = twin_survey(&state.model, &state.unsorted(io)?);
    let words = io.after::<u32>("survey", 4 + twin.is_wet.len())?;
    let fastest = f64::from(f32::from_bits(words[0]));
    let exact = twin.speed * twin.speed;
    table.add(&SPEED, [pair(0, fastest, exact, [exact])]);
    let is_wet: Vec<u32> = twin.is_wet.iter().map(|&wet| u32::from(wet)).collect();
    table.add_exact(&WET, &words[4..], &is_wet);
    // What the device found is what its substep follows.
    let Begun { number, elapsed } = state.begun;
    let length = state.scene.shot.frame_seconds();
    let start = f64::from(state.frame) * length + elapsed;
    let (frame, remaining, speed) = (state.frame + 1, length - elapsed, fastest.sqrt());
    let chosen = (state.scene).flip_substep(frame, start, remaining, speed, number - 1)?;
    let substep = chosen.1;
    let flags: Vec<bool> = words[4..].iter().map(|&flag| flag != 0).collect();
    let layers = state.model.step(&substep).layers;
    let bricks = state.model.bricks(&flags, layers);
    state.elements = Some(Elements {
        cells: (CELLS * (bricks.active + 1)) as usize,
        stride: 0,
        substep,
        bricks,
    });
    Ok(())
}

pub(super) fn assign_cells(
    state: &mut FlipState,
    io: &Io<'_>,
    table: &mut Table,
) -> Result<(), SolveError> {
    let params = io.uniform::<FlipParams>("params")?;
    if let Some(elements) = &mut state.elements {
        elements.stride = params.stride as usize;
    }
    let (n, elements) = (state.n, state.elements());
    let positions = io.vectors_before("position", n)?;
    let cell_of = io.after::<u32>("cell_of", n)?;
    let twin = twin_cells(&state.model, &elements.bricks, &positions);
    let size = state.model.cell_size();
    check_cells(&CELL, &positions, size, &cell_of, &twin, table);
    let slot = io.after::<u32>("slot_in_cell", n)?;
    let counts = io.after::<u32>("cell_start", elements.wet().end)?;
    check_slots([&COUNTS, &SLOTS], &cell_of, &slot, &counts, table);
    Ok(())
}

pub(super) fn reorder(
    state: &mut FlipState,
    io: &Io<'_>,
    table: &mut Table,
) -> Result<(), SolveError> {
    let n = state.n;
    let (before, after) = (state.cloud(io, UNSORTED)?, state.cloud(io, SORTED)?);
    let order = io.before::<u32>("order", n)?;
    let at = |i: usize| order[i] as usize;
    let copy = |found: &[DVec3], source: &[DVec3], i: usize| pair(i, found[i], source[at(i)], []);
    table.each(&POSITION, 0..n, |i| {
        copy(&after.position, &before.position, i)
    });
    table.each(&VELOCITY, 0..n, |i| {
        copy(&after.velocity, &before.velocity, i)
    });
    let ids: Vec<u32> = (0..n).map(|i| before.id[at(i)]).collect();
    table.add_exact(&ID, &after.id, &ids);
    if !after.affine.is_empty() {
        for row in 0..3 {
            let of = |cloud: &Cloud, i: usize| cloud.affine[i].row(row);
            table.each(&AFFINE, 0..n, |i| {
                pair(i, of(&after, i), of(&before, at(i)), [])
            });
        }
    }
    let cell_of = io.before::<u32>("cell_of", n)?;
    state.sorted = Some(Sorted {
        cell: (0..n).map(|i| cell_of[at(i)]).collect(),
        cloud: after,
        start: io.before("cell_start", state.elements().wet().end + 1)?,
    });
    Ok(())
}
