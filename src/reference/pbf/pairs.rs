//! SIMD sums over a particle's neighbours.

use glam::DVec3;
use pulp::{Simd, WithSimd};

use super::passes::Inputs;
use swell_domain::{
    lanes::{LANES, positive, sum},
    period::Period,
};

/// Neighbours that are held at once. All are gathered before the first is summed: loading a vector
/// right after storing its elements one by one would stall.
const HELD: usize = 48;

/// Vectors from neighbours to a particle, metres, one array per axis, and two numbers per
/// neighbour.
struct Held {
    ways: [[f64; HELD]; 3],
    numbers: [[f64; HELD]; 2],
    /// Number of filled lanes: a multiple of [`LANES`].
    end: usize,
}

impl Held {
    #[inline(always)]
    fn new() -> Self {
        Self {
            ways: [[0.0; HELD]; 3],
            numbers: [[0.0; HELD]; 2],
            end: 0,
        }
    }

    /// Gathers up to [`HELD`] neighbours of particle `i`. Padding lanes get a distance of more than
    /// 2 h, where kernels are 0 whatever numbers were there before.
    #[inline(always)]
    fn gather(
        &mut self,
        inputs: &Inputs<'_>,
        i: usize,
        near: &[u32],
        numbers: impl Fn(usize) -> [f64; 2],
    ) {
        let (x, period) = (inputs.points[i], inputs.model.period());
        let is_walled = period == Period::default();
        let count = near.len().min(HELD);
        for (k, &j) in near[..count].iter().enumerate() {
            let j = j as usize;
            let mut way = x - inputs.points[j];
            if !is_walled {
                way = period.shortest(way);
            }
            [self.ways[0][k], self.ways[1][k], self.ways[2][k]] = way.to_array();
            [self.numbers[0][k], self.numbers[1][k]] = numbers(j);
        }
        self.end = count.next_multiple_of(LANES);
        let far = 2.0 * inputs.model.calibration.support_radius;
        for k in count..self.end {
            [self.ways[0][k], self.ways[1][k], self.ways[2][k]] = [far; 3];
        }
    }

    /// Returns vectors and numbers of [`LANES`] neighbours from index `first` on.
    #[inline(always)]
    fn lanes(&self, first: usize) -> ([&[f64]; 3], [&[f64]; 2]) {
        let ([x, y, z], [a, b], part) = (&self.ways, &self.numbers, first..first + LANES);
        (
            [&x[part.clone()], &y[part.clone()], &z[part.clone()]],
            [&a[part.clone()], &b[part]],
        )
    }
}

/// Sums of a density constraint over neighbours.
pub(super) struct RowSums<'a> {
    pub(super) inputs: Inputs<'a>,
    pub(super) particle: usize,
}

impl WithSimd for RowSums<'_> {
    /// Σ m W / W(0), Σ m s² e with the unit vector e from each neighbour, and Σ s⁴ over the fluid
    /// neighbours; s = 1 − r/h.
    type Output = (f64, DVec3, f64);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let (inputs, i) = (&self.inputs, self.particle);
        let inverse_h = 1.0 / inputs.model.calibration.support_radius;
        let inverse_h2 = inverse_h * inverse_h;
        let (mut kernel, mut along, mut squares) = ([0.0; LANES], [[0.0; LANES]; 3], [0.0; LANES]);
        let mut held = Held::new();
        let particles = inputs.particles();
        let (fluid, solid) = inputs.neighbors.of(i);
        for (near, is_fluid) in [(fluid, true), (solid, false)] {
            let numbers = |j: usize| match is_fluid {
                true => [1.0, 1.0],
                // Boundary samples are not moved by corrections: they contribute no gradient of
                // their own.
                false => [inputs.model.sample_weights[j - particles], 0.0],
            };
            for near in near.chunks(HELD) {
                held.gather(inputs, i, near, numbers);
                for first in (0..held.end).step_by(LANES) {
                    let ([x, y, z], [mass, moves]) = held.lanes(first);
                    for k in 0..LANES {
                        let r2 = x[k] * x[k] + y[k] * y[k] + z[k] * z[k];
                        let r = r2.sqrt();
                        let p = positive(1.0 - r2 * inverse_h2);
                        let s = positive(1.0 - r * inverse_h);
                        let slope = s * s;
                        let over_r = mass[k] * slope / if r > 1e-15 { r } else { 1e-15 };
                        kernel[k] += mass[k] * (p * p * p);
                        along[0][k] += x[k] * over_r;
                        along[1][k] += y[k] * over_r;
                        along[2][k] += z[k] * over_r;
                        squares[k] += moves[k] * (slope * slope);
                    }
                }
            }
        }
        (sum(kernel), DVec3::from_array(along.map(sum)), sum(squares))
    }
}

/// Sum of a correction over neighbours.
pub(super) struct CorrectionSum<'a> {
    pub(super) inputs: Inputs<'a>,
    pub(super) particle: usize,
    pub(super) lambda: &'a [f64],
    /// Artificial pressure over Σ|∇C|² in the bulk, m².
    pub(super) artificial: f64,
}

/// W at Δq = 0.2 h over W(0).
const REFERENCE_KERNEL: f64 = 0.884_736;

impl WithSimd for CorrectionSum<'_> {
    /// Σ m (λ + λ' + s_corr) s² e, m², and the distance of the nearest neighbour, metres.
    type Output = (DVec3, f64);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let (inputs, i, lambda) = (&self.inputs, self.particle, self.lambda);
        let inverse_h = 1.0 / inputs.model.calibration.support_radius;
        let inverse_h2 = inverse_h * inverse_h;
        let (mut along, mut least) = ([[0.0; LANES]; 3], [f64::INFINITY; LANES]);
        let mut held = Held::new();
        let particles = inputs.particles();
        let (fluid, solid) = inputs.neighbors.of(i);
        for (near, is_fluid) in [(fluid, true), (solid, false)] {
            let numbers = |j: usize| match is_fluid {
                true => [1.0, lambda[i] + lambda[j]],
                false => [inputs.model.sample_weights[j - particles], lambda[i]],
            };
            for near in near.chunks(HELD) {
                held.gather(inputs, i, near, numbers);
                for first in (0..held.end).step_by(LANES) {
                    let ([x, y, z], [mass, scale]) = held.lanes(first);
                    for k in 0..LANES {
                        let r2 = x[k] * x[k] + y[k] * y[k] + z[k] * z[k];
                        let r = r2.sqrt();
                        let p = positive(1.0 - r2 * inverse_h2);
                        let w = p * p * p * (1.0 / REFERENCE_KERNEL);
                        let s = positive(1.0 - r * inverse_h);
                        let scale = scale[k] - self.artificial * (w * w * (w * w));
                        let over_r =
                            mass[k] * (scale * (s * s)) / if r > 1e-15 { r } else { 1e-15 };
                        along[0][k] += x[k] * over_r;
                        along[1][k] += y[k] * over_r;
                        along[2][k] += z[k] * over_r;
                        least[k] = if r < least[k] { r } else { least[k] };
                    }
                }
            }
        }
        let least = least.into_iter().fold(f64::INFINITY, f64::min);
        (DVec3::from_array(along.map(sum)), least)
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::{
        Timings,
        pbf::{Model, Sorted, Substep},
    };
    use swell_domain::{boundary::Boundary, lanes::widely};
    use swell_files::parse_scene;

    /// Roundings of a term: of a vector and its length, of the kernel's argument, of powers and
    /// products.
    const OF_A_TERM: f64 = 20.0;

    /// Returns a block of irregularly placed particles, with boundary samples of a floor in it.
    fn block() -> (Model, Substep, Vec<DVec3>) {
        let text = "[shot]\nname = \"lanes\"\nframes = 1\nframes_per_second = 50\n\
            [domain]\nmin = [0.0, 0.0, 0.0]\nmax = [2.0, 2.0, 2.0]\n\
            [[water.block]]\nmin = [0.0, 0.0, 0.0]\nmax = [0.5, 0.5, 0.5]\n\
            [solver]\nmethod = \"pbf\"\n[solver.pbf]\nparticle_spacing = 0.1\n\
            artificial_pressure = 0.1\n";
        let scene = parse_scene(text, Path::new("lanes.toml"), Path::new("."), &[]).unwrap();
        let scene = scene.with_pbf().unwrap();
        let mut model = Model::new(&scene, &Boundary::default());
        let uneven = |k: usize| DVec3::new(0.31, 0.17, 0.23) * (k * k % 97) as f64 * 1e-3;
        let place =
            |k: usize| DVec3::new((k % 8) as f64, (k / 8 % 8) as f64, (k / 64) as f64) * 0.09;
        model.samples = (0..64).map(|k| place(k) + DVec3::splat(0.33)).collect();
        model.sample_weights = (0..64).map(|k| 0.5 + 0.01 * f64::from(k)).collect();
        let points = (0..512).map(|k| place(k) + uneven(k) + 0.3).collect();
        (
            model,
            Substep::new(&scene, &Default::default(), 0.0, 0.01),
            points,
        )
    }

    /// Every sum has the same bits with the processor's widest instructions and with scalar ones.
    /// It equals the sequential sum of its terms up to rounding: n roundings for n terms, and less
    /// than [`OF_A_TERM`] for each, on either side, relative to a bound on the terms.
    #[test]
    fn sums_do_not_depend_on_the_processor() {
        let (model, substep, points) = block();
        let id: Vec<u32> = (0..points.len() as u32).collect();
        let sorted = Sorted::new(&model, &points, &id, &mut Timings::default());
        let inputs = sorted.inputs(&model, &substep);
        let lambda: Vec<f64> = (0..points.len()).map(|k| -1e-4 * (k % 7) as f64).collect();
        let h = model.calibration.support_radius;
        let (mut others, mut of_solids) = (0, 0);
        // Some particles have more neighbours than are held at once, and most have a last vector
        // that is not full.
        let counts: Vec<usize> = (0..points.len())
            .map(|i| inputs.neighbors.fluid(i).len())
            .collect();
        assert!(counts.iter().any(|&n| n > HELD) && counts.iter().any(|&n| n % LANES > 0));
        for particle in 0..points.len() {
            let row = || RowSums { inputs, particle };
            let correction = || CorrectionSum {
                inputs,
                particle,
                lambda: &lambda,
                artificial: 1e-4,
            };
            let (wide, plain) = (widely(row()), row().with_simd(pulp::Scalar));
            assert_eq!(wide, plain);
            let corrected = widely(correction());
            assert_eq!(corrected, correction().with_simd(pulp::Scalar));
            let mut terms = (0.0, DVec3::ZERO, 0.0);
            let mut pushed = DVec3::ZERO;
            let (mut count, mut most, mut most_pushed) = (0.0, 0.0, 0.0);
            for j in inputs.neighbors.all(particle) {
                let (d, j) = (inputs.between(particle, j as usize), j as usize);
                let (mass, own) = match j.checked_sub(points.len()) {
                    None => (1.0, lambda[particle] + lambda[j]),
                    Some(sample) => (model.sample_weights[sample], lambda[particle]),
                };
                let p = (1.0 - d.length_squared() / (h * h)).max(0.0);
                let s = (1.0 - d.length() / h).max(0.0);
                terms.0 += mass * p.powi(3);
                terms.1 += mass * s * s * d.normalize();
                terms.2 += if j < points.len() { s.powi(4) } else { 0.0 };
                let repulsion = 1e-4 * (p.powi(3) / REFERENCE_KERNEL).powi(4);
                pushed += mass * s * s * (own - repulsion) * d.normalize();
                of_solids += usize::from(j >= points.len());
                count += 1.0;
                most += mass;
                most_pushed += mass * (own.abs() + repulsion);
            }
            let off =
                (wide.0 - terms.0).abs() + wide.1.distance(terms.1) + (wide.2 - terms.2).abs();
            let rounding = 2.0 * (count + OF_A_TERM) * f64::EPSILON;
            assert!(off <= 3.0 * rounding * most, "{particle}: {off}");
            let off = corrected.0.distance(pushed);
            assert!(off <= rounding * most_pushed, "{particle}: {off}");
            others += usize::from(wide.0 != terms.0);
        }
        // Negative control: another order gives other bits, so that equal bits are significant.
        assert!(others > 100 && of_solids > 100, "{others} {of_solids}");
    }
}
