//! Exclusive prefix scan and stable counting sort.
//!
//! Counting sort by cell (Hoetzlein 2014). Slots within a cell are assigned by integer atomics in
//! the order in which the device happens to run; `sort/stabilize` then ranks each cell's members by
//! id, so that the result depends only on keys and ids. Its work is Σ k² over cells of k members:
//! about ten reads per particle at rest, and quadratic only if all particles share a cell.

use super::{
    buffer::{Buf, BufferSpec, Windows},
    program::{PassSpec, Program},
    recording::{Bind, Command},
};

/// Number of elements of each cell; after the scan, the start of each cell in sorted order,
/// followed by the total.
pub const CELL_START: Buf<u32> = Buf::new("cell_start");
/// Cell of each element, in storage order.
pub const CELL_OF: Buf<u32> = Buf::new("cell_of");
/// Index of each element within its cell, in storage order, as assigned by the device.
pub const SLOT_IN_CELL: Buf<u32> = Buf::new("slot_in_cell");
/// Elements by cell, in arbitrary order within a cell.
pub const PLACED: Buf<u32> = Buf::new("placed");
/// Elements by cell, and within a cell by id.
pub const ORDER: Buf<u32> = Buf::new("order");
/// Id of each element, in storage order; ids in sorted order follow.
pub const ID: Buf<u32> = Buf::new("id");
/// Number of elements, in the first component.
pub const ELEMENT_COUNT: Buf<[u32; 4]> = Buf::uniform("element_count");

/// Elements that one workgroup scans.
const BLOCK: usize = 1024;

/// Lengths of the scan levels: the data, then block sums until a single block holds them.
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

/// Destination of the last level's sum, which is never read.
fn total(data: &Buf<u32>) -> Buf<u32> {
    Buf::named(format!("{}.total", data.name()))
}

/// Length of each level, in the first component.
fn lengths(data: &Buf<u32>) -> Windows<[u32; 4]> {
    Windows::named("length", format!("{}.lengths", data.name()))
}

/// Describes the buffers that a scan of `count` elements in buffer `data` needs, in addition to
/// `data` with its `count` + 1 elements.
pub fn scan_buffers(data: &Buf<u32>, count: usize) -> Vec<BufferSpec> {
    let lengths_of = levels(count + 1);
    let mut specs: Vec<BufferSpec> = (1..lengths_of.len())
        .map(|level| level_buffer(data, level).sized(lengths_of[level]))
        .collect();
    specs.push(lengths(data).sized(lengths_of.len()));
    specs.push(total(data).sized(1));
    specs
}

/// Uploads the lengths of all levels for a scan of `count` elements in buffer `data`.
pub fn upload_lengths(program: &Program, data: &Buf<u32>, count: usize) {
    let levels = levels(count + 1);
    let values: Vec<[u32; 4]> = levels
        .iter()
        .map(|&length| [length as u32, 0, 0, 0])
        .collect();
    program.upload_windows(&lengths(data), &values);
}

/// Passes of the scan.
pub const SCAN_PASSES: [&str; 2] = ["sort/scan_blocks", "sort/add_block_sums"];

/// Passes of the counting sort after its keys have been counted.
pub const SORT_PASSES: [&str; 2] = ["sort/place", "sort/stabilize"];

/// Describes a pass without conditions or constants.
pub fn plain_pass(name: &'static str) -> PassSpec {
    PassSpec {
        name,
        defines: Vec::new(),
        constants: Vec::new(),
    }
}

/// Returns the commands of an in-place scan: element k becomes the sum of those before it, and
/// element `count` the total.
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
