//! Runs a GPU pass of one's own, and compares it with its f64 reference within a derived tolerance.
//!
//! The pass computes |v| of each particle. `cargo run --release --example own_pass`
#![expect(clippy::print_stdout, reason = "a program that says what it measured")]

use std::error::Error;

use swell::gpu::{
    adapter::Context,
    buffer::Buf,
    program::{PassSpec, Program},
    recording::{Command, Recording},
};

const PASS: &str = "own/speeds";
/// Bindings are found by the names of the shader's variables.
const VELOCITY: Buf<[f32; 4]> = Buf::new("velocity");
const SPEED: Buf<f32> = Buf::new("speed");
const WGSL: &str = r#"
#import "shared/thread.wgsl"

@group(0) @binding(0) var<storage, read> velocity: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> speed: array<f32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i < arrayLength(&velocity) {
        speed[i] = sqrt(dot(velocity[i].xyz, velocity[i].xyz));
    }
}
"#;

/// The same in f64.
fn reference(velocity: &[[f32; 4]]) -> Vec<f64> {
    let of = |v: &[f32; 4]| v[..3].iter().map(|x| f64::from(*x).powi(2)).sum::<f64>();
    velocity.iter().map(|v| of(v).sqrt()).collect()
}

/// Three products and two sums, which the root halves, and the root with 4.5 ulp (WGSL: 1 /
/// inverseSqrt, 2.5 and 2), each relative to the result; a rounding is half an ulp.
const TOLERANCE: f64 = (5.0 / 2.0 * 0.5 + 4.5) * f32::EPSILON as f64;

fn main() -> Result<(), Box<dyn Error>> {
    let mut context = Context::open(None)?;
    context.shaders = context.shaders.with_file("own/speeds.wgsl", WGSL);
    let velocity: Vec<[f32; 4]> = (0..10_000)
        .map(|i| {
            let t = i as f32;
            [(0.3 * t).sin(), 2.0 * (0.7 * t).cos(), 0.01 * t, 0.0]
        })
        .collect();

    let pass = PassSpec {
        name: PASS,
        defines: Vec::new(),
        constants: Vec::new(),
    };
    let buffers = [VELOCITY.sized(velocity.len()), SPEED.sized(velocity.len())];
    let program = Program::new(&context, &buffers, &[pass], &[])?;
    program.upload(VELOCITY, 0, &velocity);
    let recording = Recording::new(&program, &[Command::over(PASS, velocity.len())]);
    recording.run(&program, None)?;
    let speeds = program.read(SPEED, velocity.len())?;

    let both = speeds.iter().zip(reference(&velocity));
    let errors = both.map(|(found, exact)| (f64::from(*found) - exact).abs() / exact.max(1e-30));
    // A value that is not a number stays, where `f64::max` would drop it.
    let worst = errors.fold(0.0, |worst, e| if e <= worst { worst } else { e });
    println!(
        "{}: largest relative error {worst:.1e}, tolerance {TOLERANCE:.1e}",
        context.info.name
    );
    if worst <= TOLERANCE {
        Ok(())
    } else {
        Err("the pass is out of tolerance".into())
    }
}
