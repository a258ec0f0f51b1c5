//! Measures the rounding of a device: a test of a few milliseconds, with random numbers.

use super::{
    adapter::Context,
    buffer::Buf,
    error::GpuError,
    program::Program,
    recording::{Command, Recording},
    sort::plain_pass,
};

const PASS: &str = "measure/rounding";
const ZERO: Buf<u32> = Buf::new("rounding_zero");
const OPERANDS: Buf<[f32; 4]> = Buf::new("rounding_operands");
const SMALL: Buf<[f32; 2]> = Buf::new("rounding_small");
const RESULTS: Buf<[f32; 4]> = Buf::new("rounding_results");

/// Number of samples.
const COUNT: usize = 4096;
/// Error of two words up to which they keep what the first loses, in roundings of the first. It is
/// 0 for sums and 3 × 2⁻¹¹ for products, and about 1 where the second word is lost.
const KEPT: f64 = 1.0 / 64.0;

/// Largest errors of a device's arithmetic in random numbers from 2⁻⁸ to 2⁸. Errors of results that
/// are not finite are infinite.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rounding {
    /// Of a quotient, ulps.
    pub division: f64,
    /// Of a square root, ulps.
    pub square_root: f64,
    /// Of an inverse square root, ulps.
    pub inverse_square_root: f64,
    /// Of the length of a vector of two components, ulps.
    pub length: f64,
    /// Of exp(x), ulps beyond 2 |x|.
    pub exponential: f64,
    /// Of log(x) outside of 0.5 to 2, ulps.
    pub logarithm: f64,
    /// Of x^0.3, ulps.
    pub power: f64,
    /// Of sine and cosine of −π to π, absolute.
    pub sine: f64,
    /// Of the sum of two words that add two numbers (Knuth's two-sum), in roundings of the first.
    pub sum: f64,
    /// Of the sum of two words that multiply two numbers, in roundings of the first.
    pub product: f64,
    /// Whether a b + c is rounded once.
    pub contracts: bool,
    /// Whether subnormal numbers are read as 0.
    pub flushes_inputs: bool,
    /// Whether subnormal results are 0.
    pub flushes_results: bool,
}

impl Rounding {
    /// Measures the device.
    ///
    /// # Errors
    /// [`GpuError::Shader`], [`GpuError::Lost`].
    pub fn measure(context: &Context) -> Result<Self, GpuError> {
        let buffers = [
            ZERO.sized(1),
            OPERANDS.sized(COUNT),
            SMALL.sized(COUNT),
            RESULTS.sized(4 * COUNT),
        ];
        let program = Program::new(context, &buffers, &[plain_pass(PASS)], &[])?;
        let operands: Vec<[f32; 4]> = (0..COUNT as u64).map(operands).collect();
        program.upload(OPERANDS, 0, &operands);
        let small = [1.5 * f32::MIN_POSITIVE / 4.0, 1.5 * f32::MIN_POSITIVE];
        program.upload(SMALL, 0, &vec![small; COUNT]);
        Recording::new(&program, &[Command::over(PASS, COUNT)]).run(&program, None)?;
        let results = program.read(RESULTS, 4 * COUNT)?;
        let mut worst = Self::default();
        for (operands, results) in operands.iter().zip(results.chunks_exact(4)) {
            worst.absorb(*operands, results);
        }
        Ok(worst)
    }

    /// Takes the errors of a sample into account.
    fn absorb(&mut self, operands: [f32; 4], results: &[[f32; 4]]) {
        let [a, b, _, angle] = operands.map(f64::from);
        let rows: Vec<[f64; 4]> = results.iter().map(|row| row.map(f64::from)).collect();
        let [quotient, root, inverse_root, length] = rows[0];
        let [sum, sum_error, product, product_rest] = rows[1];
        let [contracted, is_zero_input, is_zero_result, sine] = rows[2];
        let [exponential, logarithm, power, cosine] = rows[3];
        let worse = |worst: &mut f64, error: f64| *worst = worst.max(finite(error));
        worse(&mut self.division, ulps(quotient, a / b));
        worse(&mut self.square_root, ulps(root, a.sqrt()));
        worse(
            &mut self.inverse_square_root,
            ulps(inverse_root, 1.0 / a.sqrt()),
        );
        worse(&mut self.length, ulps(length, (a * a + b * b).sqrt()));
        worse(
            &mut self.exponential,
            ulps(exponential, angle.exp()) - 2.0 * angle.abs(),
        );
        if !(0.5..=2.0).contains(&a) {
            worse(&mut self.logarithm, ulps(logarithm, a.ln()));
        }
        worse(&mut self.power, ulps(power, a.powf(f64::from(0.3_f32))));
        worse(&mut self.sine, (sine - angle.sin()).abs());
        worse(&mut self.sine, (cosine - angle.cos()).abs());
        let roundings =
            |error: f64, of: f64| error.abs() / (of.abs() * 0.5 * f64::from(f32::EPSILON));
        worse(&mut self.sum, roundings(sum + sum_error - (a + b), a + b));
        worse(
            &mut self.product,
            roundings(product + product_rest - a * b, a * b),
        );
        self.contracts |= contracted != 0.0;
        self.flushes_inputs |= is_zero_input > 0.0;
        self.flushes_results |= is_zero_result > 0.0;
    }

    /// Returns whether two words keep what one loses in a sum or a product.
    pub fn keeps_two_words(&self) -> bool {
        self.sum <= KEPT && self.product <= KEPT
    }

    /// Fails if the device loses what two words of a number have to keep.
    ///
    /// # Errors
    /// [`GpuError::NoErrorTerms`].
    pub fn require_two_words(&self, context: &Context) -> Result<(), GpuError> {
        let lost = match self.sum <= KEPT {
            true if self.product <= KEPT => return Ok(()),
            true => "the rounding errors of products",
            false => "the rounding errors of sums",
        };
        Err(GpuError::NoErrorTerms {
            adapter: context.info.name.clone(),
            lost,
        })
    }
}

/// Operands of sample `index`.
fn operands(index: u64) -> [f32; 4] {
    let [a, b] = [0, 1].map(|which| (16.0 * unit(2 * index + which) - 8.0).exp2() as f32);
    let angle = (2.0 * unit(index + (1 << 32)) - 1.0) * std::f64::consts::PI * 0.999;
    [a, b, -(a * b), angle as f32]
}

/// A number from 0 to 1 (splitmix64, Steele, Lea and Flood 2014).
fn unit(index: u64) -> f64 {
    let mut bits = index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Distance of an f32 from the exact value, in units of the last place there.
fn ulps(value: f64, exact: f64) -> f64 {
    let ulp = exact.abs().log2().floor().exp2() * f64::from(f32::EPSILON);
    (value - exact).abs() / ulp
}

fn finite(error: f64) -> f64 {
    match error.is_finite() {
        true => error,
        false => f64::INFINITY,
    }
}
