//! Compares the scan and the counting sort with simple loops: integers, which must be equal.

use glam::DVec3;

use swell_compare::{rounding::U, tolerance::bounds};
use swell_gpu::buffer::{Buf, Windows};
use swell_solve::buffers;

use super::{
    comparison::{Comparison, Io, NONE, PassResult, State, comparison, names},
    table::{CheckEntry, CheckTable, entries, pair},
};

/// Variables of the scan.
const VALUES: Buf<u32> = Buf::new("values");
const BLOCK_SUMS: Buf<u32> = Buf::new("block_sums");
const LENGTH: Windows<[u32; 4]> = Windows::new("length", "");

/// Values that one workgroup scans.
const BLOCK: usize = 1024;

bounds! {
    /// Distance from a cell's face within which either cell is correct, in cells.
    pub(super) NEAR_FACE = [place: "a particle's coordinate in cells"]
        4.0 * U * place, "a cell's face";
}

entries! {
    "sort/scan_blocks" {
        SCAN = "sums within a block", "": [] 0.0, "whole numbers";
    }
    "sort/add_block_sums" {
        ADD = "sums", "": [] 0.0, "whole numbers";
    }
    "sort/place" {
        PLACE = "elements by cell", "": [] 0.0, "whole numbers";
    }
    "sort/stabilize" {
        STABILIZE = "elements by cell and id", "": [] 0.0, "whole numbers";
    }
}

/// Comparisons of the sort, for any solver.
pub(super) type Comparisons<S> = [Comparison<S>; 4];

pub(super) fn comparisons<S: State>() -> Comparisons<S> {
    [
        comparison("sort/scan_blocks", || names![VALUES], |_, io| scan(io)),
        comparison("sort/add_block_sums", || names![VALUES], |_, io| add(io)),
        comparison("sort/place", NONE, |state, io| place(state.particles(), io)),
        comparison("sort/stabilize", NONE, |state, io| {
            stabilize(state.particles(), io)
        }),
    ]
}

fn scan(io: &mut Io<'_>) -> PassResult {
    let length = io.before.window(&LENGTH)?[0] as usize;
    let (mut scanned, mut totals) = (Vec::with_capacity(length), Vec::new());
    for block in io.before.get(VALUES, length)?.chunks(BLOCK) {
        let mut sum = 0u32;
        for value in block {
            scanned.push(sum);
            sum = sum.wrapping_add(*value);
        }
        totals.push(sum);
    }
    io.table
        .add_exact(&SCAN, &io.after.get(VALUES, length)?, &scanned);
    io.table
        .add_exact(&SCAN, &io.after.get(BLOCK_SUMS, totals.len())?, &totals);
    Ok(())
}

fn add(io: &mut Io<'_>) -> PassResult {
    let length = io.before.window(&LENGTH)?[0] as usize;
    let sums = io.before.get(BLOCK_SUMS, length.div_ceil(BLOCK))?;
    let mut values = io.before.get(VALUES, length)?;
    for (k, value) in values.iter_mut().enumerate() {
        *value = value.wrapping_add(sums[k / BLOCK]);
    }
    io.table
        .add_exact(&ADD, &io.after.get(VALUES, length)?, &values);
    Ok(())
}

fn place(n: usize, io: &mut Io<'_>) -> PassResult {
    let cell_of = io.before.get(buffers::CELL_OF, n)?;
    let slot = io.before.get(buffers::SLOT_IN_CELL, n)?;
    // `cell_start` up to the largest key.
    let cells = cell_of.iter().max().map_or(0, |&cell| cell as usize + 1);
    let start = io.before.get(buffers::CELL_START, cells)?;
    let mut placed = vec![u32::MAX; n];
    for i in 0..n {
        let place = start[cell_of[i] as usize] + slot[i];
        if let Some(place) = placed.get_mut(place as usize) {
            *place = i as u32;
        }
    }
    io.table
        .add_exact(&PLACE, &io.after.get(buffers::PLACED, n)?, &placed);
    Ok(())
}

fn stabilize(n: usize, io: &mut Io<'_>) -> PassResult {
    let cell_of = io.before.get(buffers::CELL_OF, n)?;
    let id = io.before.get(buffers::ID, n)?;
    let mut order = io.before.get(buffers::PLACED, n)?;
    order.sort_by_key(|&k| (cell_of[k as usize], id[k as usize]));
    io.table
        .add_exact(&STABILIZE, &io.after.get(buffers::ORDER, n)?, &order);
    Ok(())
}

/// Compares the cells of positions with `exact`; within rounding of a cell's face either cell is
/// correct.
pub(super) fn check_cells(
    entry: &'static CheckEntry<0>,
    places: &[DVec3],
    cell_size: f64,
    found: &[u32],
    exact: &[u32],
    table: &mut CheckTable,
) {
    table.each(entry, 0..found.len(), |i| {
        let place = places[i] / cell_size;
        let off = (place - place.round()).abs();
        let is_near = |axis: usize| off[axis] < NEAR_FACE.of([place[axis].abs()]);
        let is_tie = found[i] != exact[i] && (0..3).any(is_near);
        (!is_tie).then(|| pair(i, found[i], f64::from(exact[i]), []))
    });
}

/// Compares slots in cells, and the counts that assigned them, with the keys themselves.
pub(super) fn check_slots(
    [counts_entry, slots_entry]: [&'static CheckEntry<0>; 2],
    cell_of: &[u32],
    slot: &[u32],
    counts: &[u32],
    table: &mut CheckTable,
) {
    let mut expected = vec![0; counts.len()];
    let mut keys: Vec<[u32; 2]> = Vec::with_capacity(slot.len());
    for (&cell, &slot) in cell_of.iter().zip(slot) {
        if let Some(count) = expected.get_mut(cell as usize) {
            *count += 1;
        }
        keys.push([cell, slot]);
    }
    table.add_exact(counts_entry, counts, &expected);
    keys.sort_unstable();
    let mut next = 0;
    let slots: Vec<u32> = (0..keys.len())
        .map(|k| {
            let is_same = k > 0 && keys[k - 1][0] == keys[k][0];
            next = if is_same { next + 1 } else { 0 };
            next
        })
        .collect();
    let found: Vec<u32> = keys.iter().map(|key| key[1]).collect();
    table.add_exact(slots_entry, &found, &slots);
}
