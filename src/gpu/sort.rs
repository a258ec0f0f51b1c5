//! Exclusive prefix scan and the stable counting sort.
//!
//! Counting sort by cell (Hoetzlein 2014). Slots within a cell are handed out by integer atomics in
//! whatever order the device runs, and `sort/stabilize` then ranks each cell's members by id, so the
//! result depends on keys and ids alone. Its work is Σ k² over cells of k members: about ten reads a
//! particle at rest, and quadratic only where all particles share a cell.

use super::{
    program::{BufferSpec, PassSpec},
    recording::{Bind, Command},
};

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

fn level_name(data: &str, level: usize) -> String {
    if level == 0 {
        data.to_owned()
    } else {
        format!("{data}.sums{level}")
    }
}

/// Buffers that a scan of `count` elements in buffer `data` needs beside it, `data`'s own `count`+1 apart.
pub fn scan_buffers(data: &str, count: usize) -> Vec<BufferSpec> {
    let lengths = levels(count + 1);
    let mut specs: Vec<BufferSpec> = (1..lengths.len())
        .map(|level| storage(&level_name(data, level), 4 * lengths[level] as u64))
        .collect();
    // One length a level, bound through a 256-byte window; the last level's sum goes nowhere.
    specs.push(BufferSpec {
        name: format!("{data}.lengths"),
        bytes: 256 * lengths.len() as u64,
        is_uniform: true,
    });
    specs.push(storage(&format!("{data}.total"), 4));
    specs
}

/// A storage buffer.
pub fn storage(name: &str, bytes: u64) -> BufferSpec {
    BufferSpec {
        name: name.to_owned(),
        bytes,
        is_uniform: false,
    }
}

/// Contents of the scan's uniform buffer `{data}.lengths`.
pub fn scan_lengths(count: usize) -> Vec<[u32; 64]> {
    levels(count + 1)
        .iter()
        .map(|&length| {
            let mut slot = [0; 64];
            slot[0] = length as u32;
            slot
        })
        .collect()
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
pub fn scan(data: &str, count: usize) -> Vec<Command> {
    let lengths = levels(count + 1);
    let binds = |level: usize| {
        let sums = if level + 1 < lengths.len() {
            level_name(data, level + 1)
        } else {
            format!("{data}.total")
        };
        vec![
            Bind {
                variable: "values",
                buffer: level_name(data, level),
                window: None,
            },
            Bind {
                variable: "block_sums",
                buffer: sums,
                window: None,
            },
            Bind {
                variable: "length",
                buffer: format!("{data}.lengths"),
                window: Some((256 * level as u64, 16)),
            },
        ]
    };
    let mut commands = Vec::new();
    for (level, &length) in lengths.iter().enumerate() {
        commands.push(Command::with(
            SCAN_PASSES[0],
            length.div_ceil(4).next_multiple_of(BLOCK / 4),
            binds(level),
        ));
    }
    for level in (0..lengths.len() - 1).rev() {
        commands.push(Command::with(SCAN_PASSES[1], lengths[level], binds(level)));
    }
    commands
}
