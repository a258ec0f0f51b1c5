//! Scan and stable counting sort against the CPU, up to dispatches of two dimensions.
use swell::gpu::{
    adapter::Context,
    buffer::Buf,
    program::Program,
    recording::{Command, Recording},
    sort::{self, CELL_OF, CELL_START, ELEMENT_COUNT, ID, ORDER, PLACED, SLOT_IN_CELL},
};

use crate::support::context;

/// Deterministic and well mixed (SplitMix64).
fn random(seed: u64) -> impl FnMut() -> u32 {
    let mut state = seed;
    move || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as u32
    }
}

fn gpu_scan(context: &Context, values: &[u32]) -> Vec<u32> {
    const VALUES: Buf<u32> = Buf::new("values_to_scan");
    let mut buffers = sort::scan_buffers(&VALUES, values.len());
    buffers.push(VALUES.sized(values.len() + 1));
    let passes = sort::SCAN_PASSES.map(sort::plain_pass);
    let program = Program::new(context, &buffers, &passes, &[]).unwrap();
    program.upload(VALUES, 0, values);
    sort::upload_lengths(&program, &VALUES, values.len());
    Recording::new(&program, &sort::scan(&VALUES, values.len()))
        .run(&program, None)
        .unwrap();
    program.read(VALUES, values.len() + 1).unwrap()
}

fn cpu_scan(values: &[u32]) -> Vec<u32> {
    let mut sum = 0;
    let mut out = Vec::with_capacity(values.len() + 1);
    for &value in values {
        out.push(sum);
        sum += value;
    }
    out.push(sum);
    out
}

/// Sorts elements with `keys` and `ids` as the solver does, except that keys are counted here.
fn gpu_sort(context: &Context, keys: &[u32], ids: &[u32], cells: usize) -> Vec<u32> {
    let n = keys.len();
    let mut buffers = sort::scan_buffers(&CELL_START, cells);
    buffers.push(CELL_START.sized(cells + 1));
    buffers.extend([CELL_OF, SLOT_IN_CELL, PLACED, ORDER, ID].map(|buffer| buffer.sized(n)));
    buffers.push(ELEMENT_COUNT.sized(1));
    let passes: Vec<_> = sort::SCAN_PASSES
        .into_iter()
        .chain(sort::SORT_PASSES)
        .map(sort::plain_pass)
        .collect();
    let program = Program::new(context, &buffers, &passes, &[]).unwrap();

    // Slots in the worst order that atomics could hand out: last come, first served.
    let mut counts = vec![0; cells];
    let mut slots = vec![0; n];
    for k in (0..n).rev() {
        slots[k] = counts[keys[k] as usize];
        counts[keys[k] as usize] += 1;
    }
    program.upload(CELL_START, 0, &counts);
    sort::upload_lengths(&program, &CELL_START, cells);
    program.upload(CELL_OF, 0, keys);
    program.upload(SLOT_IN_CELL, 0, &slots);
    program.upload(ID, 0, ids);
    program.upload(ELEMENT_COUNT, 0, &[[n as u32, 0, 0, 0]]);
    let mut commands = sort::scan(&CELL_START, cells);
    commands.extend(sort::SORT_PASSES.map(|pass| Command::over(pass, n)));
    Recording::new(&program, &commands)
        .run(&program, None)
        .unwrap();
    program.read(ORDER, n).unwrap()
}

/// Number of elements whose 64-thread workgroups exceed one dimension of a dispatch.
const TWO_DIMENSIONAL: usize = 65_535 * 64 + 4_097;

#[test]
fn scan_matches_the_cpu() {
    let context = context();
    for n in [
        0,
        1,
        63,
        64,
        65,
        1_023,
        1_024,
        1_025,
        1_000_000,
        TWO_DIMENSIONAL,
    ] {
        let mut next = random(n as u64);
        let values: Vec<u32> = (0..n).map(|_| next() % 500).collect();
        let (gpu, mut cpu) = (gpu_scan(&context, &values), cpu_scan(&values));
        assert!(gpu == cpu, "n = {n}");
        // Negative control: one spoiled element is detected.
        cpu[n / 2] ^= 1;
        assert!(gpu != cpu, "n = {n}");
    }
}

#[test]
fn sort_is_stable_and_matches_the_cpu() {
    let context = context();
    for (n, cells) in [
        (0, 10),
        (1, 10),
        (63, 7),
        (64, 7),
        (65, 7),
        (5_000, 3),
        (1_000_000, 125_000),
        (TWO_DIMENSIONAL, 600_000),
    ] {
        let mut next = random(7 + n as u64);
        let keys: Vec<u32> = (0..n).map(|_| next() % cells as u32).collect();
        let ids: Vec<u32> = (0..n as u32).collect();
        let gpu = gpu_sort(&context, &keys, &ids, cells);
        let mut cpu = ids.clone();
        cpu.sort_by_key(|&k| keys[k as usize]);
        assert!(gpu == cpu, "n = {n}");
        if n >= 64 {
            // Negative control: an unstable order, as the atomics gave it, is detected.
            cpu.sort_by_key(|&k| (keys[k as usize], u32::MAX - k));
            assert!(gpu != cpu, "n = {n}");
        }
    }
}

/// Ties follow the ids, wherever their elements are.
#[test]
fn ties_follow_ids() {
    let context = context();
    let n = 10_000;
    let mut next = random(3);
    let keys: Vec<u32> = (0..n).map(|_| next() % 50).collect();
    let mut ids: Vec<u32> = (0..n as u32).collect();
    for k in (1..n).rev() {
        ids.swap(k, next() as usize % (k + 1));
    }
    let mut cpu: Vec<u32> = (0..n as u32).collect();
    cpu.sort_by_key(|&k| (keys[k as usize], ids[k as usize]));
    assert!(gpu_sort(&context, &keys, &ids, 50) == cpu);
}
