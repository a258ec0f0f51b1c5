//! Bytes that a pass moves, and the peak rates of a device.

use swell::gpu::{
    buffer::Buf,
    ceilings::Ceilings,
    program::Program,
    recording::{Bind, Command, Recording, Timer},
    reflect::reflect,
    shader,
    sort::plain_pass,
};

const PASS: &str = "measure/copy";
const COPIED: Buf<[f32; 4]> = Buf::new("copied");
const COPY: Buf<[f32; 4]> = Buf::new("copy");
const COUNT: usize = 1 << 12;

/// Bytes and runs that a timer reports for the copying pass, run twice with these bindings.
fn told(binds: &[Bind], count: usize) -> (u64, u64) {
    let context = crate::support::context();
    let buffers = [COPIED.sized(COUNT), COPY.sized(COUNT)];
    let program = Program::new(&context, &buffers, &[plain_pass(PASS)], &[]).unwrap();
    let values: Vec<[f32; 4]> = (0..COUNT).map(|k| [k as f32; 4]).collect();
    program.upload(COPIED, 0, &values);
    let recording = Recording::new(&program, &[Command::with(PASS, count, binds.to_vec())]);
    let mut timer = Timer::new(&context);
    for _ in 0..2 {
        recording.run(&program, Some(&mut timer)).unwrap();
    }
    assert_eq!(program.read(COPY, count).unwrap(), values[..count]);
    let times = timer.times(|pass, seconds, runs, bytes, operations| {
        assert_eq!(
            (pass, operations),
            (PASS, None),
            "none are counted unless asked for"
        );
        assert!(seconds > 0.0);
        (bytes, runs)
    });
    times[0]
}

#[test]
fn a_copy_moves_each_byte_twice() {
    let bytes = (size_of::<[f32; 4]>() * COUNT) as u64;
    assert_eq!(told(&[], COUNT), (2 * 2 * bytes, 2));
    // A binding of a quarter of the buffer counts as a quarter.
    let window = |variable, buffer: &Buf<[f32; 4]>| Bind {
        window: Some((0, bytes / 4)),
        ..Bind::whole(variable, buffer)
    };
    let quarter = [window("copied", &COPIED), window("copy", &COPY)];
    assert_eq!(told(&quarter, COUNT / 4), (2 * 2 * bytes / 4, 2));
}

/// A `read_write` variable that is only written does not count as read.
#[test]
fn what_a_shader_reads_and_writes_is_seen() {
    let uses = |name: &str, variable: &str| {
        let text = shader::compose(name, &[]).unwrap();
        let bindings = reflect(name, &text).unwrap().bindings;
        let binding = bindings.iter().find(|binding| binding.name == variable);
        binding.map(|binding| (binding.is_read, binding.is_written))
    };
    assert_eq!(uses(PASS, "copied"), Some((true, false)));
    assert_eq!(uses(PASS, "copy"), Some((false, true)));
    assert_eq!(uses("sort/scan_blocks", "values"), Some((true, true)));
    assert_eq!(uses("sort/scan_blocks", "block_sums"), Some((false, true)));
    // Atomics increment it.
    assert_eq!(uses("pbf/assign_cells", "cell_start"), Some((true, true)));
}

/// Lower bounds: a slow card's bus and one slow core. Upper bounds: ten times the rates of
/// any current device.
#[test]
fn a_device_has_ceilings() {
    let ceilings = Ceilings::measure(&crate::support::context()).unwrap();
    let Ceilings {
        bandwidth,
        arithmetic,
        start,
    } = ceilings;
    assert!(
        (1e7..1e14).contains(&bandwidth),
        "{bandwidth} bytes a second"
    );
    assert!(
        (1e8..1e15).contains(&arithmetic),
        "{arithmetic} operations a second"
    );
    assert!((1e-8..0.1).contains(&start), "{start} s");
}
