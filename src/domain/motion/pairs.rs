//! The wave maker problem to second order for waves of many frequencies: the motion that a piston
//! needs at the sum and at the difference of each two frequencies so that it generates no free wave
//! there (Schäffer 1996, the full theory), and the bound waves of each pair (Sharma and Dean 1981;
//! Dalzell 1999).

use super::{complex::Complex, second_order::evanescent, wave_number};
use crate::parallel;

/// Number of evanescent modes that are summed: a base for shallow water, and more per kh of the
/// shorter wave. The truncation error falls as one over their number and its powers; extrapolation
/// from the sums over an eighth, a quarter and half of the modes removes most of it. 5e-5 of the
/// whole is left at kh = 9, 2e-4 at kh = 25.
const MODES: f64 = 32.0;
const MODES_PER_KH: f64 = 10.0;

/// Weights of a mode in the first eighth, quarter, half or the rest: three steps of
/// Richardson extrapolation.
const WEIGHTS: [f64; 4] = [1.0, 22.0 / 21.0, 8.0 / 21.0, 64.0 / 21.0];

/// Number of frequencies at which pairs are solved; in between, polynomials of the fifth degree
/// interpolate. In water as deep as four of the shortest waves, the deepest allowed, the difference
/// frequencies are off by 1e-3 at most, where one wave has twice the frequency of the other; for
/// kh = 9 of the shortest wave, all are off by 1e-5.
const NODES: usize = 96;
const POINTS: usize = 6;

/// Largest kh of the shortest waves: the depth is then four of their lengths. In deeper water the
/// differences need more nodes than `NODES`.
pub const DEEPEST: f64 = 25.0;

/// Selects one of the two products of a pair of waves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Of {
    Sum,
    Difference,
}

/// A wave of first order near the wall that makes it. The wall's displacement is Re X exp(iωt), and
/// the potential is −ωX Σ (Dⱼ / kⱼ) cosh kⱼ(z + h) / cosh kⱼh · exp(i(ωt − kⱼx)) with ω² = g kⱼ
/// tanh kⱼh, k₀ real and the others −iκⱼ.
struct Wave {
    /// ω, rad/s.
    frequency: f64,
    /// ν = ω²/g, 1/m.
    deep: f64,
    /// k₀, rad/m.
    number: f64,
    /// D₀.
    part: f64,
    /// [κⱼ, Dⱼ].
    modes: Vec<[f64; 2]>,
}

impl Wave {
    fn new(frequency: f64, [depth, gravity]: [f64; 2], modes: usize) -> Self {
        let number = wave_number(frequency, depth, gravity);
        let deep = frequency.powi(2) / gravity;
        let twice = (2.0 * number * depth).min(300.0);
        Self {
            frequency,
            deep,
            number,
            part: 2.0 / (1.0 + twice / twice.sinh()),
            modes: (1..=modes as u32)
                .map(|j| evanescent(j, deep, depth))
                .collect(),
        }
    }
}

fn modes_for(kh: f64) -> usize {
    ((MODES + MODES_PER_KH * kh) / 8.0).ceil() as usize * 8
}

/// Two waves. For their difference, the second enters with −ω and −k*: exp(i(ωt − kx)) is then
/// the conjugate.
struct Pair<'a> {
    first: &'a Wave,
    second: &'a Wave,
    /// Signed frequency and wavenumber of the second wave, rad/s and rad/m.
    frequency: f64,
    number: f64,
    /// Combined frequency Ω, rad/s.
    whole: f64,
    /// Ω²/g, 1/m.
    deep: f64,
    /// K², with K the wavenumber of the free wave of Ω.
    squared: f64,
    depth: f64,
    gravity: f64,
}

impl<'a> Pair<'a> {
    fn new(first: &'a Wave, second: &'a Wave, of: Of, [depth, gravity]: [f64; 2]) -> Self {
        let sign = if of == Of::Sum { 1.0 } else { -1.0 };
        let frequency = sign * second.frequency;
        let whole = first.frequency + frequency;
        Self {
            first,
            second,
            frequency,
            number: sign * second.number,
            whole,
            deep: whole * whole / gravity,
            squared: wave_number(whole.abs(), depth, gravity).powi(2),
            depth,
            gravity,
        }
    }

    /// Returns Ω F, rad/(s m): the wall's correction is Re F X₁X₂ exp(iΩt) for the sum, and Re F
    /// X₁X₂* exp(iΩt) for the difference.
    ///
    /// Products of the waves force the surface by Re p φ₁φ₂, and the wall is at its displacement,
    /// not at the mean position. By Green's identity the free wave of Ω vanishes if
    /// i Ω F tanh Kh / K is
    /// −½ Σₗ ω₂ kₗDₗ Iₗ − ½ Σⱼ ω₁ kⱼDⱼ Iⱼ − Σⱼₗ ω₁ω₂ (DⱼDₗ / kⱼkₗ) s p / g (s² − K²)
    /// with s = kⱼ + kₗ, where I is (ν − N) / (k² − K²), N = Ω²/g, and
    /// p = Ω (kⱼkₗ − ν₁ν₂) + ½ ω₁ (kₗ² − ν₂²) + ½ ω₂ (kⱼ² − ν₁²).
    fn transfer(&self) -> Complex {
        let (first, second) = (self.first, self.second);
        let kh = first.number.max(second.number) * self.depth;
        let count = modes_for(kh).min(first.modes.len());
        let [k, l] = [first.number, self.number].map(Complex::from);
        let mut sum = self.product(k, l) * (first.part * second.part);
        sum += self.at_wall(k, first.deep) * (0.5 * first.frequency * first.part);
        sum += self.at_wall(l, second.deep) * (0.5 * self.frequency * second.part);
        for (index, [&[kappa, d], &[lambda, e]]) in (first.modes.iter().zip(&second.modes))
            .map(<[_; 2]>::from)
            .take(count)
            .enumerate()
        {
            let weight = WEIGHTS[block(index, count)];
            let [kappa, lambda] = [kappa, lambda].map(|x| Complex::new(0.0, -x));
            let with_second = self.product(kappa, l) * second.part
                + self.at_wall(kappa, first.deep) * (0.5 * first.frequency);
            let with_first = self.product(k, lambda) * first.part
                + self.at_wall(lambda, second.deep) * (0.5 * self.frequency);
            sum += with_second * (weight * d) + with_first * (weight * e);
        }
        sum.im += self.evanescent(count);
        // Multiplies by K² / (iN).
        Complex::new(sum.im, -sum.re) * (self.squared / self.deep)
    }

    /// ω₁ω₂ s p / (g kⱼkₗ (s² − K²)) of two modes.
    fn product(&self, k: Complex, l: Complex) -> Complex {
        let (first, second) = (self.first, self.second);
        let s = k + l;
        let forced = (k * l - (first.deep * second.deep).into()) * self.whole
            + (l * l - second.deep.powi(2).into()) * (0.5 * first.frequency)
            + (k * k - first.deep.powi(2).into()) * (0.5 * self.frequency);
        let below = k * l * (s * s - self.squared.into());
        s * forced * below.inverse() * (first.frequency * self.frequency / self.gravity)
    }

    /// k ∫ cosh k(z + h) cosh K(z + h) dz / (cosh kh cosh Kh) for a mode of a wave of ν.
    fn at_wall(&self, k: Complex, deep: f64) -> Complex {
        let off = k * k - self.squared.into();
        if off.size() > 1e-7 * self.squared {
            return k * off.inverse() * (deep - self.deep);
        }
        // The free wave coincides with one of the two: (½ ν/k² + ½ h (1 − ν²/k²)) k.
        let k = k.re;
        (0.5 * deep / k + 0.5 * self.depth * (k - deep * deep / k)).into()
    }

    /// Imaginary part of [`Self::product`] summed over all pairs of the first `count` evanescent
    /// modes; the real part is zero.
    fn evanescent(&self, count: usize) -> f64 {
        let (first, second) = (self.first, self.second);
        let ends = [count / 8, count / 4, count / 2, count];
        let [nu, mu] = [first.deep, second.deep].map(|deep| deep * deep);
        let mut all = 0.0;
        for (index, &[kappa, d]) in first.modes[..count].iter().enumerate() {
            let still = -self.whole * first.deep * second.deep
                - 0.5 * (first.frequency * mu + self.frequency * (kappa * kappa + nu));
            let with = |modes: &[[f64; 2]]| -> f64 {
                let of = |&[lambda, e]: &[f64; 2]| {
                    let s = kappa + lambda;
                    let forced =
                        still - lambda * (self.whole * kappa + 0.5 * first.frequency * lambda);
                    s * e * forced / (lambda * (s * s + self.squared))
                };
                modes.iter().map(of).sum()
            };
            // The larger of the two indices decides the group of a pair.
            let mut from = 0;
            let mut row = 0.0;
            for (part, &end) in ends.iter().enumerate().skip(block(index, count)) {
                row += WEIGHTS[part] * with(&second.modes[from..end]);
                from = end;
            }
            all -= row * d / kappa;
        }
        all * first.frequency * self.frequency / self.gravity
    }

    /// Elevation bound to two progressive waves of one metre each, metres: b in Re b
    /// exp(i(Ωt − (k₁ + k₂)x)).
    fn bound(&self) -> f64 {
        let (first, second) = (self.first, self.second);
        let (k, l) = (first.number, self.number);
        let rates = first.frequency * self.frequency;
        let forced = self.whole * (k * l - first.deep * second.deep)
            + 0.5 * first.frequency * (l * l - second.deep.powi(2))
            + 0.5 * self.frequency * (k * k - first.deep.powi(2));
        let s = k + l;
        let tuned = self.gravity * s * (s * self.depth).tanh() - self.whole * self.whole;
        let squares =
            first.deep * second.deep - k * l + rates / self.gravity * (first.deep + second.deep);
        self.gravity / rates * (0.5 * squares - self.whole * forced / tuned)
    }
}

/// Index of the first of an eighth, a quarter, half and all of `count` that contains `index`.
fn block(index: usize, count: usize) -> usize {
    [8, 4, 2]
        .iter()
        .filter(|part| index >= count / **part)
        .count()
}

/// Second-order solution for waves whose frequencies are `first` to `last` times a step.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pairs {
    first: usize,
    last: usize,
    /// Frequency step, rad/s.
    step: f64,
    /// Ω F at the nodes, one row per node of the first wave. The nodes of the second wave are half
    /// a node spacing lower, so that Ω is never 0.
    sums: Vec<Complex>,
    differences: Vec<Complex>,
    /// Bound elevation of each pair, grouped by the first line: of the sum and of the
    /// difference, 1/m.
    bound: Vec<[f64; 2]>,
}

/// Number of nodes of the second wave: one more, as they begin half a node spacing lower.
const ACROSS: usize = NODES + 1;

impl Pairs {
    /// Solves for lines of `first` to `last` times `step` rad/s in `water`, given as depth (m) and
    /// gravity (m/s²).
    pub(super) fn new([first, last]: [usize; 2], step: f64, water: [f64; 2]) -> Self {
        let greatest = wave_number(step * last as f64, water[0], water[1]);
        let modes = modes_for(greatest * water[0] * 1.1);
        let distance = step * (last - first) as f64 / (NODES - 1) as f64;
        let at = |node: f64| Wave::new(step * first as f64 + distance * node, water, modes);
        let rows: Vec<Wave> = (0..NODES).map(|i| at(i as f64)).collect();
        let columns: Vec<Wave> = (0..ACROSS).map(|i| at(i as f64 - 0.5)).collect();
        let table = |of: Of| -> Vec<Complex> {
            let cell = |index: usize| {
                let (row, column) = (index / ACROSS, index % ACROSS);
                // Only pairs whose first wave is the faster one are looked up.
                if column > row + POINTS {
                    return Complex::default();
                }
                Pair::new(&rows[row], &columns[column], of, water).transfer()
            };
            parallel::map(0..NODES * ACROSS, cell)
        };
        let lines: Vec<Wave> = (first..=last)
            .map(|line| Wave::new(step * line as f64, water, 0))
            .collect();
        let bound = parallel::flat_map(0..lines.len(), |n| {
            let lines = &lines;
            let of = move |m: usize, of| Pair::new(&lines[n], &lines[m], of, water).bound();
            (0..n)
                .map(move |m| [of(m, Of::Sum), of(m, Of::Difference)])
                // The pair of a line with itself counts once, and its difference is the mean level.
                .chain([[0.5 * of(n, Of::Sum), 0.0]])
        });
        Self {
            first,
            last,
            step,
            sums: table(Of::Sum),
            differences: table(Of::Difference),
            bound,
        }
    }

    /// Returns the wall's displacement to second order: the amplitude at each multiple of the step,
    /// from 0 on. `ways` are the first-order amplitudes, metres, line by line. Differences of fewer
    /// than `slowest` steps (at least 1) are left out: at 0 the wall would drift for ever.
    pub(super) fn corrected(&self, ways: &[Complex], slowest: usize) -> Vec<Complex> {
        let mut all = vec![Complex::default(); 2 * self.last + 1];
        for (n, &way) in ways.iter().enumerate() {
            all[self.first + n] += way;
            let [sums, differences] =
                [&self.sums, &self.differences].map(|table| self.row(table, n));
            for (m, &other) in ways[..=n].iter().enumerate() {
                let (start, weights) = self.place(m, 0.5, ACROSS);
                let at = |row: &[Complex]| {
                    let nodes = row[start..].iter().zip(weights);
                    nodes.fold(Complex::default(), |sum, (node, weight)| {
                        sum + *node * weight
                    })
                };
                let (sum, difference) = (2 * self.first + n + m, n - m);
                // The pair of a line with itself counts once.
                let share = if n == m { 0.5 } else { 1.0 };
                let per = |line: usize| share / (self.step * line as f64);
                all[sum] += at(&sums) * way * other * per(sum);
                if difference >= slowest {
                    all[difference] += at(&differences) * way * other.conjugate() * per(difference);
                }
            }
        }
        all
    }

    /// Row of a table for a line as the first wave.
    fn row(&self, table: &[Complex], line: usize) -> Vec<Complex> {
        let (start, weights) = self.place(line, 0.0, NODES);
        let mut row = vec![Complex::default(); ACROSS];
        for (k, weight) in weights.into_iter().enumerate() {
            let nodes = &table[(start + k) * ACROSS..][..ACROSS];
            for (sum, node) in row.iter_mut().zip(nodes) {
                *sum += *node * weight;
            }
        }
        row
    }

    /// First of the nodes around a line, and the Lagrange weights.
    fn place(&self, line: usize, offset: f64, nodes: usize) -> (usize, [f64; POINTS]) {
        let at = line as f64 * (NODES - 1) as f64 / (self.last - self.first) as f64 + offset;
        let start = (at.floor() as usize).saturating_sub(POINTS / 2 - 1);
        let start = start.min(nodes - POINTS);
        let off = at - start as f64;
        let weight = |i: usize| {
            let others = (0..POINTS).filter(|other| *other != i);
            others.fold(1.0, |product, other| {
                product * (off - other as f64) / (i as f64 - other as f64)
            })
        };
        (start, std::array::from_fn(weight))
    }

    /// Returns the elevation bound to waves of these elevations, metres, about the mean level.
    pub(super) fn bound(&self, elevations: &[Complex]) -> f64 {
        let mut pairs = self.bound.iter();
        let mut sum = 0.0;
        for (n, &wave) in elevations.iter().enumerate() {
            for &other in &elevations[..=n] {
                let &[of_sum, of_difference] = pairs.next().unwrap_or(&[0.0, 0.0]);
                let (cos, sin) = (wave.re * other.re, wave.im * other.im);
                sum += of_sum * (cos - sin) + of_difference * (cos + sin);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests;
