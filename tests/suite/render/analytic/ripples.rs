//! Ripples: waves of deep water, and how they deflect reflections.

use std::f64::consts::{PI, SQRT_2, TAU};

use glam::{DVec2, DVec3};
use swell::gpu::adapter::Context;
use swell::render::Image;

use super::support::{RAMP_ERROR, Setup, context, kernel, ramp_sky, scene, sky_place};
use super::water::{BLACK, INDEX, Meeting, RADIUS, meetings, pool, setup_at};

/// Longest wave, m, and the ratio of each of the seven wavelengths to the previous one.
const LONGEST: f64 = 1.0;
const RATIO: f64 = 0.74;
const WAVES: usize = 7;

/// Slopes and lost variance at (x, z), time in seconds and footprint, of ripples with a slope of
/// 0.1.
fn ripples(context: &Context, input: &[[f32; 4]]) -> Vec<[f32; 4]> {
    let body = "let r = ripple_at(value.xy, value.z, 1.0, 0.1, value.w); \
                return vec4f(r.slope, r.lost, 0.0);";
    kernel(context, "shared/ssfr_ripple", body, input)
}

/// Solves a small dense system by Gaussian elimination with pivoting.
fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for k in 0..n {
        let pivot = (k..n)
            .max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs()))
            .unwrap();
        a.swap(k, pivot);
        b.swap(k, pivot);
        for i in k + 1..n {
            let factor = a[i][k] / a[k][k];
            let row = a[k].clone();
            a[i].iter_mut()
                .zip(&row)
                .for_each(|(x, y)| *x -= factor * y);
            b[i] -= factor * b[k];
        }
    }
    for k in (0..n).rev() {
        let rest: f64 = (k + 1..n).map(|j| a[k][j] * b[j]).sum();
        b[k] = (b[k] - rest) / a[k][k];
    }
    b
}

struct Fit {
    /// Amplitude and phase of each wave at time 0: a cos(φ − ω t).
    waves: Vec<[f64; 2]>,
    /// Rms of the residual relative to that of the series.
    rest: f64,
}

/// Least-squares fit with the given frequencies.
fn fit(times: &[f64], series: &[f64], frequencies: &[f64]) -> Fit {
    let row = |t: f64| -> Vec<f64> {
        frequencies
            .iter()
            .flat_map(|w| [(w * t).cos(), (w * t).sin()])
            .collect()
    };
    let n = 2 * frequencies.len();
    let (mut normal, mut right) = (vec![vec![0.0; n]; n], vec![0.0; n]);
    for (&t, &value) in times.iter().zip(series) {
        let row = row(t);
        for i in 0..n {
            right[i] += row[i] * value;
            for j in 0..n {
                normal[i][j] += row[i] * row[j];
            }
        }
    }
    let parts = solve(normal, right);
    let square = |values: &mut dyn Iterator<Item = f64>| values.map(|x| x * x).sum::<f64>();
    let left = square(
        &mut times
            .iter()
            .zip(series)
            .map(|(&t, value)| value - row(t).iter().zip(&parts).map(|(x, y)| x * y).sum::<f64>()),
    );
    Fit {
        waves: parts
            .chunks_exact(2)
            .map(|p| [p[0].hypot(p[1]), p[1].atan2(p[0])])
            .collect(),
        rest: (left / square(&mut series.iter().copied())).sqrt(),
    }
}

/// Fits both slopes at a position over 25 s, and returns the lost variance there.
fn watch(context: &Context, place: DVec2, footprint: f64, gravity: f64) -> ([Fit; 2], f64) {
    let times: Vec<f64> = (0..512)
        .map(|i| f64::from(i) * 0.05)
        .map(|t| f64::from(t as f32))
        .collect();
    let input: Vec<[f32; 4]> = times
        .iter()
        .map(|&t| [place.x, place.y, t, footprint].map(|x| x as f32))
        .collect();
    let found = ripples(context, &input);
    let frequencies: Vec<f64> = (0..WAVES as i32)
        .map(|i| (gravity * TAU / (LONGEST * RATIO.powi(i))).sqrt())
        .collect();
    let fits = [0, 1].map(|axis: usize| {
        let series: Vec<f64> = found.iter().map(|v| f64::from(v[axis])).collect();
        fit(&times, &series, &frequencies)
    });
    (fits, f64::from(found[0][2]))
}

const GRAVITY: f64 = 9.81;

#[test]
fn ripples_obey_the_dispersion_of_deep_water() {
    let context = context();
    // Near the origin the noise that bends the crests does not change: its slope is zero there.
    let step = 3e-4;
    let at = |x: f64, z: f64| watch(&context, DVec2::new(x, z) * step, 0.0, GRAVITY).0;
    let [east, west] = [at(1.0, 0.0), at(-1.0, 0.0)];
    let [north, south] = [at(0.0, 1.0), at(0.0, -1.0)];
    // Phases of up to 500 are f32, accurate to 3e-5.
    assert!(
        east[0].rest < 2e-4 && east[1].rest < 2e-4,
        "{}",
        east[0].rest
    );
    let turned = |a: &Fit, b: &Fit, i: usize| {
        let angle = a.waves[i][1] - b.waves[i][1];
        (angle + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0
    };
    for i in 0..WAVES {
        // The wave vector from the difference of phases between positions; the fit has given the
        // frequency.
        let k = DVec2::new(
            turned(&east[0], &west[0], i),
            turned(&north[0], &south[0], i),
        ) / (2.0 * step);
        let length = TAU / (LONGEST * RATIO.powi(i as i32));
        // 11 × 3 × (1.4 step)² of bending, on a phase of 2 step k.
        let error = (k.length() / length - 1.0).abs();
        assert!(error < 3e-3, "{i}: {} for {length}", k.length());
        // The slope is along the wave's direction of travel.
        let slope = DVec2::new(east[0].waves[i][0], east[1].waves[i][0]);
        assert!((slope.normalize().dot(k.normalize().abs()) - 1.0).abs() < 1e-3);
        assert!(k.x > 0.0, "{i} comes from ahead");
    }
    // Control: 1 % of gravity is 0.5 % of the frequency, and 0.5 to 2 radians after 25 s.
    let ([along, _], _) = watch(&context, DVec2::ZERO, 0.0, 1.01 * GRAVITY);
    assert!(along.rest > 0.05, "{}", along.rest);
}

#[test]
fn slopes_that_a_pixel_cannot_show_are_in_its_roughness() {
    let context = context();
    let total = |footprint: f64| {
        let (fits, lost) = watch(&context, DVec2::ZERO, footprint, GRAVITY);
        let shown: f64 = fits
            .iter()
            .flat_map(|fit| &fit.waves)
            .map(|w| 0.5 * w[0] * w[0])
            .sum();
        (shown + lost, lost)
    };
    let (all, none) = total(0.0);
    assert!(none < 1e-9, "{none}");
    // Vulkan lets sines err by 2⁻¹¹. What is shown has the square of a direction's length, which
    // errs by 2 √2 of that, and of the fitted amplitude of a cosine, by 2 × 4 / π; what is lost has
    // neither.
    let of_sines = (2.0 * SQRT_2 + 8.0 / PI) * context.rounding().unwrap().sine;
    for footprint in [0.05, 0.2] {
        let (sum, lost) = total(footprint);
        let allowed = 1e-4 + of_sines * lost / all;
        assert!(
            (sum / all - 1.0).abs() < allowed,
            "{footprint}: {sum} {all}"
        );
        // Control: the lost part is not negligible.
        assert!(lost > 0.02 * all, "{lost} {all}");
    }
}

/// Largest error of the reflection of [`ramp_sky`] in black water with ripples, 10 s after frame 0.
/// The expected reflection uses a clock that is `clock` times as fast, and slopes that are `sign`
/// times the ripples'.
fn ripple_error(context: &Context, image: &Image, setup: &Setup, clock: f64, sign: f64) -> f64 {
    let found = meetings(image, &setup.eye);
    let input: Vec<[f32; 4]> = found
        .iter()
        .map(|at| {
            let away = (at.position - setup.eye.position).dot(setup.eye.forward());
            let footprint = away / setup.eye.focal / -at.normal.dot(at.along);
            [at.position.x, at.position.z, 10.0 * clock, footprint].map(|x| x as f32)
        })
        .collect();
    let slopes = ripples(context, &input);
    let mut worst = 0.0f64;
    for (i, (at, slope)) in found.iter().zip(&slopes).enumerate() {
        let tilt = DVec3::new(slope[0].into(), 0.0, slope[1].into()) * sign;
        let facet = Meeting {
            normal: (at.normal - tilt).normalize(),
            ..*at
        };
        let place = sky_place(facet.reflected());
        for (c, expected) in [place.x, place.y].into_iter().enumerate() {
            let value = f64::from(image.beauty[i][c]) / facet.reflectance(INDEX);
            worst = worst.max((value - expected).abs());
        }
    }
    worst
}

#[test]
fn ripples_turn_the_mirror_at_the_frames_instant() {
    // The tolerance of `water_mirrors_the_sky_by_the_law_of_reflection`; a position rounded by 1e-6
    // m turns a crest of 17 cm by 4e-5 rad.
    let context = context();
    let mut setup = setup_at(20.0, 2.0, BLACK.to_owned());
    setup.surface += "ripple = { wavelength_m = 1.0, slope = 0.1 }\n";
    let image = pool(&context, &setup, &ramp_sky, &scene(RADIUS, 1.0), 2.0, 240);
    let error = ripple_error(&context, &image, &setup, 1.0, 1.0);
    assert!(error < RAMP_ERROR, "{error}");
    for (clock, sign) in [(1.01, 1.0), (1.0, -1.0), (1.0, 1.02)] {
        let control = ripple_error(&context, &image, &setup, clock, sign);
        assert!(control > 2.0 * RAMP_ERROR, "{clock} {sign}: {control}");
    }
}
