//! Operation counts that passes report.

use swell::gpu::{
    adapter::InjectedFault,
    buffer::Buf,
    operations::Operations,
    program::Program,
    recording::{Command, Recording, Timer},
    sort::plain_pass,
};

use crate::support::{context, device::PooledDevice};

const COMPUTING: &str = "measure/arithmetic";
const ESCAPED: Buf<[f32; 4]> = Buf::new("escaped");
const COPYING: &str = "measure/copy";
const COPIED: Buf<[f32; 4]> = Buf::new("copied");
const COPY: Buf<[f32; 4]> = Buf::new("copy");
const COUNT: usize = 256;

/// The index of a thread takes two multiplications and two additions.
const INDEX: u64 = 4;
/// And one comparison with the number of elements.
const GUARD: u64 = 1;

fn counting(spoil: Option<InjectedFault>) -> PooledDevice {
    let mut context = context();
    context.counts_operations = true;
    context.spoil = spoil;
    context
}

/// Operations that a timer reports for a number of runs of a pass.
fn counted(program: &Program, pass: &'static str, threads: usize, runs: u64) -> Operations {
    let recording = Recording::new(program, &[Command::over(pass, threads)]);
    let mut timer = Timer::new(&program.context);
    for _ in 0..runs {
        recording.run(program, Some(&mut timer)).unwrap();
    }
    let times = timer.times(|name, _, times, _, operations| {
        assert_eq!((name, times), (pass, runs));
        operations.unwrap()
    });
    times[0]
}

/// Operations of `measure/arithmetic`.
fn computed(threads: usize, spoil: Option<InjectedFault>) -> Operations {
    let context = counting(spoil);
    let program = Program::new(&context, &[ESCAPED.sized(1)], &[plain_pass(COMPUTING)], &[]);
    counted(&program.unwrap(), COMPUTING, threads, 1)
}

/// Operations of `measure/copy` with `words` in place of its copy, over values whose first
/// components are 0, 1, 2, 3, 0, and so on; and the contents of `copy` afterwards, initially zeros.
fn copied(words: &'static str, runs: u64) -> (Operations, Vec<[f32; 4]>) {
    let context = counting(Some(InjectedFault {
        pass: COPYING,
        from: "copy[i] = copied[i];",
        to: words,
    }));
    let buffers = [COPIED.sized(COUNT), COPY.sized(COUNT)];
    let program = Program::new(&context, &buffers, &[plain_pass(COPYING)], &[]).unwrap();
    let values: Vec<[f32; 4]> = (0..COUNT)
        .map(|k| [(k % 4) as f32, 1.0, 2.0, 4.0])
        .collect();
    program.upload(COPIED, 0, &values);
    let operations = counted(&program, COPYING, COUNT, runs);
    (operations, program.read(COPY, COUNT).unwrap())
}

#[test]
fn loops_count_as_often_as_they_go_round() {
    const ROUNDS: u64 = 512;
    const THREADS: u64 = 1024;
    // Three times four multiplications and additions per round; then two sums of vectors, three of
    // numbers, a comparison.
    let floats = ROUNDS * 3 * 8 + 2 * 4 + 3 + 1;
    let integers = INDEX + ROUNDS + (ROUNDS + 1);
    let found = computed(THREADS as usize, None);
    assert_eq!(found, [THREADS * floats, THREADS * integers]);
    // Negative control: one addition of four numbers less.
    let spoil = InjectedFault {
        pass: COMPUTING,
        from: "a = a * FACTOR + TERM;",
        to: "a = a * FACTOR;",
    };
    let fewer = computed(THREADS as usize, Some(spoil));
    assert_eq!(fewer, [THREADS * (floats - 4 * ROUNDS), THREADS * integers]);
    // More than 32 bits can hold.
    let many = 1u64 << 19;
    assert!(many * floats > u64::from(u32::MAX));
    let found = computed(many as usize, None);
    assert_eq!(found, [many * floats, many * integers]);
}

/// Branches, returns and loops with data-dependent ends are counted as executed, and counting does
/// not affect the state: a pass adds its values once per run.
#[test]
fn what_is_counted_is_what_was_done_and_the_state_stays() {
    let words = "let rounds = u32(copied[i].x);
        if rounds == 3u { return; }
        for (var k = 0u; k < 10u; k++) {
            if k == rounds { break; }
            copy[i] = copy[i] + copied[i];
        }";
    let (rounds, threads) = ([0u64, 1, 2], COUNT as u64 / 4);
    let floats: u64 = rounds.iter().map(|rounds| 4 * rounds).sum();
    // A completed round: a comparison with 10, one with `rounds`, an increment; the last
    // has no increment.
    let of_rounds: u64 = rounds.iter().map(|rounds| 3 * rounds + 2).sum();
    let integers = 4 * (INDEX + GUARD + 1) + of_rounds;
    let once = [threads * floats, threads * integers];
    assert_eq!(copied(words, 1).0, once);
    // Counted in the first run and in some later ones; the runs between count the same.
    let (nine, sums) = copied(words, 9);
    assert_eq!(nine, once.map(|count| 9 * count));
    for (k, sum) in sums.iter().enumerate() {
        let added = [0.0, 1.0, 2.0, 0.0][k % 4];
        let of = [(k % 4) as f32, 1.0, 2.0, 4.0];
        assert_eq!(*sum, of.map(|value| 9.0 * added * value), "{k}");
    }
}

#[test]
fn each_expression_has_the_operations_of_its_formula() {
    for (words, floats, integers) in [
        ("copy[i] = copied[i];", 0, 0),
        ("copy[i] = copied[i] * copied[i];", 4, 0),
        ("copy[i] = 2.0 * copied[i];", 4, 0),
        ("copy[i] = -copied[i];", 4, 0),
        ("copy[i] = sqrt(copied[i]);", 4, 0),
        ("copy[i] = fma(copied[i], copied[i], copied[i]);", 8, 0),
        ("copy[i] = mix(copied[i], copied[i], copied[i]);", 12, 0),
        ("copy[i] = clamp(copied[i], copied[i], copied[i]);", 8, 0),
        ("copy[i] = vec4f(dot(copied[i].xyz, copied[i].xyz));", 5, 0),
        ("copy[i] = vec4f(length(copied[i].xyz));", 6, 0),
        ("copy[i] = vec4f(normalize(copied[i].xyz), 0.0);", 9, 0),
        (
            "copy[i] = vec4f(refract(copied[i].xyz, copied[i].xyz, 1.3), 0.0);",
            22,
            0,
        ),
        (
            "copy[i] = vec4f(cross(copied[i].xyz, copied[i].wzx), 0.0);",
            9,
            0,
        ),
        (
            "copy[i] = select(copied[i], -copied[i], copied[i].x < 1.0);",
            5,
            0,
        ),
        ("copy[i].x = f32(u32(copied[i].x) << 2u);", 0, 1),
        ("copy[i] = vec4f(~bitcast<vec4u>(copied[i]));", 0, 4),
        (
            "let v = copied[i].xyz; copy[i] = vec4f(mat3x3f(v, v, v) * v, 0.0);",
            15,
            0,
        ),
        (
            "let v = copied[i].xyz; copy[i] = vec4f(v * mat3x3f(v, v, v), 0.0);",
            15,
            0,
        ),
        (
            "let v = copied[i].xyz; let m = mat3x3f(v, v, v); copy[i] = vec4f((m * m)[0], 0.0);",
            45,
            0,
        ),
        (
            "let v = copied[i].xyz; copy[i] = vec4f((2.0 * mat3x3f(v, v, v))[0], 0.0);",
            9,
            0,
        ),
    ] {
        let expected = [floats, INDEX + GUARD + integers].map(|count| COUNT as u64 * count);
        assert_eq!(copied(words, 1).0, expected, "{words}");
    }
}
