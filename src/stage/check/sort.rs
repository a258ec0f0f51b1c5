//! The scan and the counting sort against plain loops: whole numbers, so that nothing may differ.

use crate::{
    compare::check::{Field, Table},
    gpu::recording::Moment,
    solve::{SolveError, trace::Traced},
};

/// Values that one workgroup scans.
const BLOCK: usize = 1024;

const EXACT: &str = "whole numbers: equal";

static SCAN: Field = Field {
    pass: "sort/scan_blocks",
    name: "sums within a block",
    unit: "",
    derivation: EXACT,
};
static ADD: Field = Field {
    pass: "sort/add_block_sums",
    name: "sums",
    unit: "",
    derivation: EXACT,
};
static PLACE: Field = Field {
    pass: "sort/place",
    name: "elements by cell",
    unit: "",
    derivation: EXACT,
};
static STABILIZE: Field = Field {
    pass: "sort/stabilize",
    name: "elements by cell and id",
    unit: "",
    derivation: EXACT,
};

/// Inputs of the pass that runs now.
#[derive(Default)]
pub(super) struct SortCheck {
    values: Vec<u32>,
    sums: Vec<u32>,
}

impl SortCheck {
    /// Holds a pass of the sort of `n` elements against its twin; false for any other pass.
    pub(super) fn observe(
        &mut self,
        traced: Traced<'_>,
        n: usize,
        table: &mut Table,
    ) -> Result<bool, SolveError> {
        match traced.pass {
            "sort/scan_blocks" | "sort/add_block_sums" => self.scan(traced, table)?,
            "sort/place" if traced.moment == Moment::After => {
                let cell_of = traced.read::<u32>("cell_of", n)?;
                let slot = traced.read::<u32>("slot_in_cell", n)?;
                let start = starts(traced, &cell_of)?;
                let mut placed = vec![u32::MAX; n];
                for i in 0..n {
                    let place = start[cell_of[i] as usize] + slot[i];
                    if let Some(place) = placed.get_mut(place as usize) {
                        *place = i as u32;
                    }
                }
                table.add_exact(&PLACE, &traced.read("placed", n)?, &placed);
            }
            "sort/stabilize" if traced.moment == Moment::After => {
                let cell_of = traced.read::<u32>("cell_of", n)?;
                let id = traced.read::<u32>("id", n)?;
                let mut order = traced.read::<u32>("placed", n)?;
                order.sort_by_key(|&k| (cell_of[k as usize], id[k as usize]));
                table.add_exact(&STABILIZE, &traced.read("order", n)?, &order);
            }
            "sort/place" | "sort/stabilize" => {}
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn scan(&mut self, traced: Traced<'_>, table: &mut Table) -> Result<(), SolveError> {
        let length = traced.uniform::<u32>("length")? as usize;
        let values = traced.read::<u32>(traced.buffer("values"), length)?;
        let sums = traced.read::<u32>(traced.buffer("block_sums"), length.div_ceil(BLOCK))?;
        if traced.moment == Moment::Before {
            (self.values, self.sums) = (values, sums);
            return Ok(());
        }
        if traced.pass == SCAN.pass {
            let (mut found, mut totals) = (Vec::with_capacity(length), Vec::new());
            for block in self.values.chunks(BLOCK) {
                let mut sum = 0u32;
                for value in block {
                    found.push(sum);
                    sum = sum.wrapping_add(*value);
                }
                totals.push(sum);
            }
            table.add_exact(&SCAN, &values, &found);
            table.add_exact(&SCAN, &sums, &totals);
        } else {
            let found: Vec<u32> = (self.values.iter().enumerate())
                .map(|(k, value)| value.wrapping_add(self.sums[k / BLOCK]))
                .collect();
            table.add_exact(&ADD, &values, &found);
        }
        Ok(())
    }
}

/// Holds slots in cells, and the counts that handed them out, against the keys themselves.
pub(super) fn check_slots(
    [counts_field, slots_field]: [&'static Field; 2],
    cell_of: &[u32],
    slot: &[u32],
    counts: &[u32],
    table: &mut Table,
) {
    let mut expected = vec![0; counts.len()];
    let mut keys: Vec<[u32; 2]> = Vec::with_capacity(slot.len());
    for (&cell, &slot) in cell_of.iter().zip(slot) {
        if let Some(count) = expected.get_mut(cell as usize) {
            *count += 1;
        }
        keys.push([cell, slot]);
    }
    table.add_exact(counts_field, counts, &expected);
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
    table.add_exact(slots_field, &found, &slots);
}

/// `cell_start` as far as the keys of `cell_of` reach.
fn starts(traced: Traced<'_>, cell_of: &[u32]) -> Result<Vec<u32>, SolveError> {
    let cells = cell_of.iter().max().map_or(0, |&cell| cell as usize + 1);
    traced.read("cell_start", cells)
}
