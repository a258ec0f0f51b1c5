//! Passes are compiled once per device.

use std::ptr;

use swell::gpu::{
    adapter::{Context, InjectedFault},
    buffer::Buf,
    program::Program,
    sort,
};

use crate::support::context;

const VALUES: Buf<u32> = Buf::new("values_to_scan");
const PASS: &str = "sort/scan_blocks";

fn program(context: &Context) -> Program {
    let mut buffers = sort::scan_buffers(&VALUES, 1000);
    buffers.push(VALUES.sized(1001));
    let passes = sort::SCAN_PASSES.map(sort::plain_pass);
    Program::new(context, &buffers, &passes, &[]).unwrap()
}

#[test]
fn a_second_program_has_the_first_ones_passes_and_a_fault_its_own() {
    let context = context();
    let [first, second] = [(); 2].map(|()| program(&context));
    assert!(ptr::eq(first.pass(PASS), second.pass(PASS)));
    // Negative controls: another shader text, and another device.
    let mut spoiled = context.clone();
    spoiled.spoil = Some(InjectedFault {
        pass: PASS,
        from: "workgroupBarrier();",
        to: "workgroupBarrier(); workgroupBarrier();",
    });
    let spoiled = program(&spoiled);
    assert!(!ptr::eq(first.pass(PASS), spoiled.pass(PASS)));
    let other = Context::open(None).unwrap();
    assert!(!ptr::eq(first.pass(PASS), program(&other).pass(PASS)));
    // The spoiled pass is not cached for contexts without the fault.
    assert!(ptr::eq(first.pass(PASS), program(&context).pass(PASS)));
}
