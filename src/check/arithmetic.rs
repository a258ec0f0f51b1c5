//! Arithmetic of the device, by itself: sums over many particles hide an operation that is less
//! exact than the tolerances of all other rows take for granted (`compare::rounding`).

use swell_compare::rounding::U;
use swell_gpu::{
    adapter::{Context, GpuError},
    buffer::Buf,
    program::Program,
    recording::{Command, Recording},
    sort::plain_pass,
};

use super::table::{CheckEntry, CheckTable, entries, pair};

const PASS: &str = "measure/accuracy";
const NUMBERS: Buf<[f32; 2]> = Buf::new("numbers");
const RESULTS: Buf<[f32; 4]> = Buf::new("results");

/// Pairs of numbers.
const COUNT: usize = 4096;

entries! {
    "measure/accuracy" {
        SUM = "sum", "": [exact: "|x + y|"] U * exact,
            "WGSL asks for the nearest number; one that is cut off has twice this error";
        PRODUCT = "product", "": [exact: "|x y|"] U * exact, "the same";
        QUOTIENT = "quotient", "": [exact: "|x / y|"] 5.0 * U * exact, "2.5 ulp in WGSL";
        INVERSE_ROOT = "inverse square root", "": [exact: "1 / √x"] 4.0 * U * exact,
            "2 ulp in WGSL";
    }
}

/// Positive numbers of several magnitudes, the first of each pair also between two powers of four,
/// so that inverse square roots are of all mantissas.
fn numbers() -> Vec<[f32; 2]> {
    let mixed = |k: u32| {
        let word = k.wrapping_mul(0x9e37_79b9);
        let word = (word ^ word >> 15).wrapping_mul(0x2c1b_3c6d);
        word ^ word >> 13
    };
    let number = |k: u32| {
        let word = mixed(k);
        let mantissa = 1.0 + (word & 0x7f_ffff) as f32 / 8_388_608.0;
        mantissa * 2.0f32.powi((word >> 23 & 15) as i32 - 8)
    };
    let count = COUNT as u32;
    (0..count)
        .map(|k| [number(2 * k), number(2 * k + 1)])
        .collect()
}

/// Compares sums, products, quotients and inverse square roots of the device with f64.
///
/// # Errors
/// [`GpuError`], for a device that is lost and a shader that does not compile.
pub fn check(context: &Context) -> Result<CheckTable, GpuError> {
    let numbers = numbers();
    let buffers = [NUMBERS.sized(COUNT), RESULTS.sized(COUNT)];
    let program = Program::new(context, &buffers, &[plain_pass(PASS)], &[])?;
    program.upload(NUMBERS, 0, &numbers);
    Recording::new(&program, &[Command::over(PASS, COUNT)]).run(&program, None)?;
    let results = program.read(RESULTS, COUNT)?;
    let mut table = CheckTable::default();
    let mut add = |entry: &'static CheckEntry<1>, lane: usize, exact: fn(f64, f64) -> f64| {
        table.each(entry, 0..COUNT, |k| {
            let [x, y] = numbers[k].map(f64::from);
            let exact = exact(x, y);
            pair(k, f64::from(results[k][lane]), exact, [exact.abs()])
        });
    };
    add(&SUM, 0, |x, y| x + y);
    add(&PRODUCT, 1, |x, y| x * y);
    add(&QUOTIENT, 2, |x, y| x / y);
    add(&INVERSE_ROOT, 3, |x, _| 1.0 / x.sqrt());
    Ok(table)
}
