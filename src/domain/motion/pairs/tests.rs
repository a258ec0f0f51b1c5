use std::f64::consts::TAU;

use super::{
    super::{piston_height_ratio, second_order::second_harmonic},
    *,
};

const WATER: [f64; 2] = [1.0, 9.81];

/// A wave of a given kh on a depth of one metre.
fn of_kh(kh: f64) -> Wave {
    Wave::new((9.81 * kh * kh.tanh()).sqrt(), WATER, modes_for(2.0 * kh))
}

fn transfer(first: &Wave, second: &Wave, of: Of) -> Complex {
    let pair = Pair::new(first, second, of, WATER);
    pair.transfer() * pair.whole.recip()
}

/// ½ F A² (−1) exp(2iφ) is B sin 2φ + C cos 2φ for regular waves.
#[test]
fn two_equal_waves_are_a_regular_one() {
    for kh in [0.3, 0.5, 1.0, 2.0, 3.0, 8.0] {
        let wave = of_kh(kh);
        let found = transfer(&wave, &wave, Of::Sum) * 0.5;
        let [sin, cos] = second_harmonic(wave.frequency, 1.0, 9.81);
        let off = |found: Complex| f64::hypot(found.im - sin, -found.re - cos) / sin.hypot(cos);
        // The evanescent modes' sum for regular waves is accurate to 1e-3 of itself
        // (second_order.rs).
        assert!(off(found) < 1e-3, "{kh}: {}", off(found));
        // Negative control: a wave with a 1 % higher frequency.
        let other = Wave::new(1.01 * wave.frequency, WATER, modes_for(2.0 * kh));
        assert!(off(transfer(&other, &wave, Of::Sum) * 0.5) > 3e-3);
    }
}

/// Longuet-Higgins and Stewart 1962: beneath slow groups the water is lower by Sxx / ρ (gh − c_g²)
/// with Sxx = E (2n − ½), and that wave, which travels with the group, carries c_g times its
/// elevation. The wall has to move this much water.
#[test]
fn as_waves_become_alike_the_wall_follows_their_group() {
    for kh in [0.2f64, 0.7, 1.2, 2.5] {
        let wave = of_kh(kh);
        let other = Wave::new(1.0001 * wave.frequency, WATER, modes_for(2.0 * kh));
        let found = Pair::new(&other, &wave, Of::Difference, WATER).transfer();
        let n = 0.5 + kh / (2.0 * kh).sinh();
        let group = n * wave.frequency / wave.number;
        let lower = |stress: f64| 9.81 * stress / (9.81 - group * group);
        let of = |stress: f64| group * lower(stress) * piston_height_ratio(kh, 1.0).powi(2);
        let off = |stress: f64| f64::hypot(found.re, found.im - of(stress)) / of(stress);
        // Waves 1e-4 apart are off by about as much.
        assert!(off(2.0 * n - 0.5) < 1e-3, "{kh}: {}", off(2.0 * n - 0.5));
        // Negative control: the radiation stress of deep-water waves everywhere.
        assert!(off(n) > 2e-3, "{kh}");
    }
}

/// Sharma and Dean's kernel of the difference in the form of Hasselmann 1962, and Stokes'
/// second harmonic.
#[test]
fn what_is_bound_to_two_waves_is_published() {
    let g = 9.81;
    for (kh, other) in [(0.6, 0.5), (1.5, 0.9), (3.0, 2.7), (6.0, 1.0)] {
        let (i, j) = (of_kh(kh), of_kh(other));
        let (wi, wj, ki, kj): (f64, f64, f64, f64) = (i.frequency, j.frequency, i.number, j.number);
        let k = ki - kj;
        let published = |half: f64| {
            let c = (wi - wj) * (wi * wi * wj * wj / (g * g) + ki * kj)
                - half * (wi * kj * kj / kj.cosh().powi(2) - wj * ki * ki / ki.cosh().powi(2));
            -g * ki * kj / (2.0 * wi * wj) + (wi * wi - wi * wj + wj * wj) / (2.0 * g)
                - c * g * (wi - wj) / (wi * wj * (g * k * k.tanh() - (wi - wj).powi(2)))
        };
        let found = Pair::new(&i, &j, Of::Difference, WATER).bound();
        let off = |half: f64| (found / published(half) - 1.0).abs();
        assert!(off(0.5) < 1e-10, "{kh} {other}: {found} {}", published(0.5));
        assert!(off(0.6) > 1e-5);
        let tanh = kh.tanh();
        let stokes = 0.25 * kh * (3.0 - tanh * tanh) / tanh.powi(3);
        let found = 0.5 * Pair::new(&i, &i, Of::Sum, WATER).bound();
        assert!(
            (found / stokes - 1.0).abs() < 1e-10,
            "{kh}: {found} {stokes}"
        );
    }
}

/// A flow of second order by finite volumes, without Green's identity: forcing by two waves at the
/// surface and at the wall, with their modes summed pointwise, and a far end through which the free
/// wave leaves. Returns the potential of the free wave there relative to the part of the bound wave
/// that the wall has to supply, with the wall's correction scaled by `by`.
fn free_wave(pair: &Pair<'_>, [columns, rows]: [usize; 2], by: f64) -> Complex {
    let (first, second) = (pair.first, pair.second);
    let length = 3.0;
    let (dx, dz) = (length / columns as f64, 1.0 / rows as f64);
    let correction = pair.transfer() * (by / pair.whole);
    // Potential of each wave for a wall amplitude of 1 m: k and amplitude of each mode.
    let modes = |wave: &Wave, frequency: f64, number: f64| -> Vec<(Complex, Complex)> {
        let progressive = (Complex::from(number), wave.part);
        let others = wave
            .modes
            .iter()
            .map(|&[kappa, d]| (Complex::new(0.0, -kappa), d));
        std::iter::once(progressive)
            .chain(others)
            .map(|(k, d)| (k, k.inverse() * (-frequency * d)))
            .collect()
    };
    let one = modes(first, first.frequency, first.number);
    let two = modes(second, pair.frequency, pair.number);
    let run = |k: Complex, x: f64| Complex::polar((k.im * x).exp(), -k.re * x);
    // φ, φx and φzz of a wave at the surface.
    let surface = |modes: &[(Complex, Complex)], x: f64| {
        modes
            .iter()
            .fold([Complex::default(); 3], |[a, b, c], &(k, size)| {
                let here = size * run(k, x);
                [
                    a + here,
                    b + here * k * Complex::new(0.0, -1.0),
                    c + here * k * k,
                ]
            })
    };
    let g = pair.gravity;
    let forcing = |x: f64| {
        let [a, ax, azz] = surface(&one, x);
        let [b, bx, bzz] = surface(&two, x);
        let i = Complex::new(0.0, 1.0);
        // −∂t (∇φ₁·∇φ₂) − ½ Σ η ∂z (φtt + g φz), where η = −φt / g.
        let speeds = ax * bx + a * b * (first.deep * second.deep);
        let rises = a * i * (-first.frequency / g) * (bzz - b * second.deep.powi(2)) * g
            + b * i * (-pair.frequency / g) * (azz - a * first.deep.powi(2)) * g;
        speeds * i * -pair.whole + rises * -0.5
    };
    let depth_of = |k: Complex, z: f64| {
        // cosh k(z + h) / cosh kh, for real and imaginary k.
        match k.im == 0.0 {
            true => (k.re * (z + 1.0)).cosh() / k.re.cosh(),
            false => (k.im * (z + 1.0)).cos() / k.im.cos(),
        }
    };
    let wall = |z: f64| {
        let of = |modes: &[(Complex, Complex)]| {
            modes.iter().fold(Complex::default(), |sum, &(k, size)| {
                sum + k * k * size * depth_of(k, z)
            })
        };
        correction * Complex::new(0.0, pair.whole) + (of(&one) + of(&two)) * 0.5
    };
    // The bound wave, which is all that is left where the evanescent modes have decayed.
    let s = first.number + pair.number;
    let bound = {
        let (k, l) = (first.number, pair.number);
        let forced = pair.whole * (k * l - first.deep * second.deep)
            + 0.5 * first.frequency * (l * l - second.deep.powi(2))
            + 0.5 * pair.frequency * (k * k - first.deep.powi(2));
        let tuned = g * s * s.tanh() - pair.whole.powi(2);
        one[0].1 * two[0].1 * Complex::new(0.0, forced / tuned)
    };
    let bound_at = |x: f64, z: f64| bound * run(s.into(), x) * depth_of(s.into(), z);
    let free = pair.squared.sqrt();
    let size = columns * rows;
    // The bandwidth is one column each way; Gaussian elimination without pivoting, as the matrix is
    // nearly symmetric and diagonally dominant.
    let width = 2 * rows + 1;
    let mut matrix = vec![Complex::default(); size * width];
    let mut right = vec![Complex::default(); size];
    let at = |row: usize, column: usize| row * width + column + rows - row;
    for i in 0..columns {
        for j in 0..rows {
            let cell = i * rows + j;
            let (x, z) = ((i as f64 + 0.5) * dx, (j as f64 + 0.5) * dz - 1.0);
            let join = |matrix: &mut Vec<Complex>, other: usize, by: f64| {
                matrix[at(cell, other)] += by.into();
                matrix[at(cell, cell)] += (-by).into();
            };
            if j > 0 {
                join(&mut matrix, cell - 1, dx / dz);
            }
            if j + 1 < rows {
                join(&mut matrix, cell + 1, dx / dz);
            } else {
                let below = 1.0 - 0.5 * pair.deep * dz;
                matrix[at(cell, cell)] += (pair.deep / below * dx).into();
                right[cell] = right[cell] - forcing(x) * (dx / (g * below));
            }
            if i > 0 {
                join(&mut matrix, cell - rows, dz / dx);
            } else {
                right[cell] += wall(z) * dz;
            }
            if i + 1 < columns {
                join(&mut matrix, cell + rows, dz / dx);
            } else {
                // (φ − b)x = −iK (φ − b) at the face.
                let out = Complex::new(0.0, -free);
                let face = Complex::new(1.0, 0.5 * free * dx).inverse();
                let b = bound_at(length, z);
                let slope = b * Complex::new(0.0, -s);
                matrix[at(cell, cell)] += out * face * dz;
                right[cell] = right[cell] - (slope - out * b) * face * dz;
            }
        }
    }
    for row in 0..size {
        let pivot = matrix[at(row, row)].inverse();
        for lower in row + 1..(row + rows + 1).min(size) {
            let by = matrix[at(lower, row)] * pivot;
            if by == Complex::default() {
                continue;
            }
            for column in row..(row + rows + 1).min(size) {
                let change = by * matrix[at(row, column)];
                matrix[at(lower, column)] = matrix[at(lower, column)] - change;
            }
            right[lower] = right[lower] - by * right[row];
        }
    }
    for row in (0..size).rev() {
        for column in row + 1..(row + rows + 1).min(size) {
            right[row] = right[row] - matrix[at(row, column)] * right[column];
        }
        right[row] = right[row] * matrix[at(row, row)].inverse();
    }
    // Projects the last column onto the free wave.
    let (mut sum, mut norm) = (Complex::default(), 0.0);
    for j in 0..rows {
        let (x, z) = (length - 0.5 * dx, (j as f64 + 0.5) * dz - 1.0);
        let shape = depth_of(free.into(), z);
        sum += (right[(columns - 1) * rows + j] - bound_at(x, z)) * shape;
        norm += shape * shape;
    }
    sum * norm.recip()
}

/// The remainder is the discretisation error, of first order, as the forcing has a logarithmic
/// singularity where the wall meets the surface; without the correction it is not.
#[test]
fn a_flow_by_finite_volumes_has_no_free_wave() {
    for (kh, other) in [(1.2, 0.9), (2.0, 1.0)] {
        let [first, second] =
            [kh, other].map(|kh: f64| Wave::new((9.81 * kh * kh.tanh()).sqrt(), WATER, 1200));
        for of in [Of::Sum, Of::Difference] {
            let pair = Pair::new(&first, &second, of, WATER);
            let left = |by: f64| {
                let [coarse, fine] = [20, 40].map(|rows| free_wave(&pair, [3 * rows, rows], by));
                [fine.size(), (fine * 2.0 - coarse).size()]
            };
            let ([_, without], [fine, found]) = (left(0.0), left(1.0));
            assert!(
                fine < 0.05 * without,
                "{kh} {other} {of:?}: {}",
                fine / without
            );
            assert!(
                found < 0.01 * without,
                "{kh} {other} {of:?}: {}",
                found / without
            );
            // Negative control: half of the correction.
            assert!((left(0.5)[1] / without - 0.5).abs() < 0.01);
        }
    }
}

/// For long waves, the water that the wall pushes is what the waves carry: ξ' (h + η) at x = ξ is Σ
/// (ω/k) η over first-order and bound waves, at the sum and the difference too.
#[test]
fn the_wall_pushes_what_long_waves_carry() {
    let [first, second] = [0.06, 0.04].map(of_kh);
    let size = 1e-6;
    // Elevations of `size`, crests at the wall at time 0.
    let ways = [&first, &second].map(|wave| size / piston_height_ratio(wave.number, 1.0));
    for of in [Of::Sum, Of::Difference] {
        let pair = Pair::new(&first, &second, of, WATER);
        let sign = if of == Of::Sum { -1.0 } else { 1.0 };
        let left = |by: f64| {
            // Re F X₁X₂ with X = −i A.
            let way = transfer(&first, &second, of) * (sign * by * ways[0] * ways[1]);
            let bound = pair.bound() * size * size;
            let s = first.number + pair.number;
            let mut sum = Complex::default();
            for i in 0..256 {
                // Independent phases cover all times.
                for j in 0..16 {
                    let a = TAU * f64::from(i) / 256.0;
                    let b = TAU * f64::from(j) / 16.0;
                    let whole = if of == Of::Sum { a + b } else { a - b };
                    let turned = Complex::polar(1.0, whole);
                    let at = ways[0] * a.sin() + ways[1] * b.sin();
                    let speed = first.frequency * ways[0] * a.cos()
                        + second.frequency * ways[1] * b.cos()
                        + (way * turned * Complex::new(0.0, pair.whole)).re;
                    let of = |wave: &Wave, phase: f64| size * (phase - wave.number * at).cos();
                    let (one, two) = (of(&first, a), of(&second, b));
                    let three = bound * (whole - s * at).cos();
                    let carried = one * first.frequency / first.number
                        + two * second.frequency / second.number
                        + three * pair.whole / s;
                    let off = speed * (1.0 + one + two + three) - carried;
                    sum += turned.conjugate() * off;
                }
            }
            2.0 * sum.size() / 4096.0 / (bound * pair.whole / s).abs()
        };
        // The speed varies over the depth by the order of (kh)², 4e-3.
        assert!(left(1.0) < 4e-3, "{of:?}: {}", left(1.0));
        assert!(left(0.9) > 0.02, "{of:?}: {}", left(0.9));
    }
}

/// Accuracy between the nodes, and in the deepest water allowed, where one wave has almost twice
/// the frequency of another.
#[test]
fn the_table_is_the_theory() {
    for (last, water, within) in [
        (600, WATER, 1e-5),
        (600, [0.1, 9.81], 1e-8),
        (1000, WATER, 1e-3),
        (2000, [0.25, 9.81], 1e-3),
    ] {
        // Lines 100 to `last`, where 200 is the peak's own frequency, of 2 s.
        let step = TAU / 400.0;
        let count = last - 99;
        let pairs = Pairs::new([100, last], step, water);
        let mut worst = 0.0f64;
        for (n, m) in [
            (0.13, 0.02),
            (0.5, 0.495),
            (0.71, 0.26),
            (0.97, 0.43),
            (0.99, 0.1),
            (1.0, 0.98),
        ] {
            let [n, m] = [n, m].map(|part: f64| (part * (count - 1) as f64) as usize);
            let mut ways = vec![Complex::default(); count];
            ways[n] = Complex::polar(1.0, 0.3);
            ways[m] = Complex::polar(1.0, 1.1);
            let found = pairs.corrected(&ways, 1);
            let wave = |line: usize| Wave::new(step * (100 + line) as f64, water, 600);
            let (first, second) = (wave(n), wave(m));
            for (of, at, phase) in [(Of::Sum, 200 + n + m, 1.4), (Of::Difference, n - m, -0.8)] {
                let pair = Pair::new(&first, &second, of, water);
                let expected = pair.transfer() * pair.whole.recip() * Complex::polar(1.0, phase);
                // The waves themselves are at their own lines.
                let own = |line: usize| {
                    if line == at {
                        ways[line - 100]
                    } else {
                        Complex::default()
                    }
                };
                let found = match (100..=last).contains(&at) {
                    true => found[at] - own(at),
                    false => found[at],
                };
                worst = worst.max((found - expected).size() / expected.size());
            }
        }
        assert!(worst < within, "{last} {water:?}: {worst}");
    }
}
