//! Exclusive prefix scan and the stable counting sort.
//!
//! Counting sort by cell (Hoetzlein 2014). Slots within a cell are handed out by integer atomics in
//! whatever order the device runs, and `sort/stabilize` then ranks each cell's members by id, so the
//! result depends on keys and ids alone. Its work is Σ k² over cells of k members: about ten reads a
//! particle at rest, and quadratic only where all particles share a cell.

use super::{
    buffer::{Buf, Windows},
    program::{BufferSpec, PassSpec, Program},
    recording::{Bind, Command},
};

/// Elements of each cell; then, scanned, where those of each cell begin in sorted order, and how many there are in all.
pub const CELL_START: Buf<u32> = Buf::new("cell_start");
/// Cell of each element, in storage order.
pub const CELL_OF: Buf<u32> = Buf::new("cell_of");
/// Place of each element in its cell, in storage order, as the device happened to hand it out.
pub const SLOT_IN_CELL: Buf<u32> = Buf::new("slot_in_cell");
/// Elements by cell, and within a cell as the device happened to place them.
pub const PLACED: Buf<u32> = Buf::new("placed");
/// Elements by cell, and within a cell by id.
pub const ORDER: Buf<u32> = Buf::new("order");
/// Name of each element, in storage order.
pub const ID: Buf<u32> = Buf::new("id");
/// How many elements there are, in the first component.
pub const ELEMENT_COUNT: Buf<[u32; 4]> = Buf::uniform("element_count");

/// Elements that one workgroup scans.
const BLOCK: usize = 1024;

/// Lengths of the scan levels: the data, then block sums until one block holds them.
fn levels(count: usize) -> Vec<usize> {
    let mut lengths = vec![count];
    while let Some(&last) = lengths.last()
        && last > BLOCK
    {
        lengths.push(last.div_ceil(BLOCK));
    }
    lengths
}

fn level_buffer(data: &Buf<u32>, level: usize) -> Buf<u32> {
    match level {
        0 => data.clone(),
        _ => Buf::named(format!("{}.sums{level}", data.name())),
    }
}

/// Where the sum of the last level goes, which no one reads.
fn total(data: &Buf<u32>) -> Buf<u32> {
    Buf::named(format!("{}.total", data.name()))
}

/// Elements of each level, in the first component.
fn lengths(data: &Buf<u32>) -> Windows<[u32; 4]> {
    Windows::named("length", format!("{}.lengths", data.name()))
}

/// Buffers that a scan of `count` elements in buffer `data` needs beside it, `data`'s own `count`+1 apart.
pub fn scan_buffers(data: &Buf<u32>, count: usize) -> Vec<BufferSpec> {
    let lengths_of = levels(count + 1);
    let mut specs: Vec<BufferSpec> = (1..lengths_of.len())
        .map(|level| level_buffer(data, level).sized(lengths_of[level]))
        .collect();
    specs.push(lengths(data).sized(lengths_of.len()));
    specs.push(total(data).sized(1));
    specs
}

/// Tells a scan of `count` elements in buffer `data` how long its levels are.
pub fn upload_lengths(program: &Program, data: &Buf<u32>, count: usize) {
    let levels = levels(count + 1);
    let values: Vec<[u32; 4]> = levels
        .iter()
        .map(|&length| [length as u32, 0, 0, 0])
        .collect();
    program.upload_windows(&lengths(data), &values);
}

/// Names of the scan's passes.
pub const SCAN_PASSES: [&str; 2] = ["sort/scan_blocks", "sort/add_block_sums"];

/// Passes of the counting sort after its keys are counted.
pub const SORT_PASSES: [&str; 2] = ["sort/place", "sort/stabilize"];

/// A pass without conditions or constants.
pub fn plain_pass(name: &'static str) -> PassSpec {
    PassSpec {
        name,
        defines: Vec::new(),
        constants: Vec::new(),
    }
}

/// In place: element k becomes the sum of those before it; element `count` becomes the total.
pub fn scan(data: &Buf<u32>, count: usize) -> Vec<Command> {
    let levels = levels(count + 1);
    let binds = |level: usize| {
        let sums = match level + 1 < levels.len() {
            true => level_buffer(data, level + 1),
            false => total(data),
        };
        vec![
            Bind::whole("values", &level_buffer(data, level)),
            Bind::whole("block_sums", &sums),
            lengths(data).bind(level),
        ]
    };
    let mut commands = Vec::new();
    for (level, &length) in levels.iter().enumerate() {
        commands.push(Command::with(
            SCAN_PASSES[0],
            length.div_ceil(4).next_multiple_of(BLOCK / 4),
            binds(level),
        ));
    }
    for level in (0..levels.len() - 1).rev() {
        commands.push(Command::with(SCAN_PASSES[1], levels[level], binds(level)));
    }
    commands
}
