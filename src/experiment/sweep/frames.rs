//! Points that run frames.

use glam::{DVec3, Vec3};

use swell_domain::particles::Particles;
use swell_files::study::sweep::{ErrorMeasure, Measure, Point, SAMPLES, Sweep};
use swell_reference::{
    neighbors::{Cells, Neighbors, SortedPoints},
    pbf::constraint::distance_to_converged,
};
use swell_scene::{ByMethod, PbfScene, Scene, flip::Preconditioner};
use swell_stage::{
    device::Opened,
    drive::{ComputedFrame, Drive},
    prepare::Start,
};
use swell_study::measure::Gauge;

use super::{
    super::{
        StudyError,
        engine::{Bench, until_done},
    },
    measured::{Sample, SweepMeasurements, SweepRun},
};

/// Compression at which constraints count as met: the next Newton step would move particles by less
/// than f32 resolves.
const CONVERGED: f64 = 1e-6;

/// Runs a point as often as the sweep repeats it, each time from the scene's start, after one
/// warm-up frame that prepares the device's programs. Takes samples where there is a gauge. The
/// distance to converged constraints is measured at the end only, outside the run's time.
pub(super) fn measure(
    bench: &Bench<'_>,
    point: &Point,
    sweep: &Sweep,
    gauge: Option<&Gauge>,
) -> Result<SweepRun, StudyError> {
    let scene = &point.scene;
    let start = Start::of(scene)?;
    let opened = bench.devices.of(point.device);
    let mut drive = Drive::new(opened, scene, &start, false)?;
    let mut weights = Vec::new();
    if sweep.errors.contains(&ErrorMeasure::Weight) {
        drive = drive.with_pressures();
        weights = still_pressures(scene, &start.particles.water());
    }
    drive.advance()?;
    let mut run = SweepRun {
        particles: start.particles.len(),
        frames: point.frames,
        ..SweepRun::default()
    };
    let mut end = Particles::default();
    for repeat in 0..sweep.repeats {
        drive.load(0, &start.particles)?;
        let mut seconds = 0.0;
        until_done(&mut drive, point.frames, bench.stop, |step| {
            seconds += step.seconds;
            // Later repeats compute the same steps; only their times are new.
            if repeat == 0 {
                run.measured.look(point, gauge, &step);
                run.measured.weigh(&weights, &step);
            }
            end = step.particles.filled();
            Ok(())
        })?;
        run.seconds.push(seconds);
    }
    let measured = &mut run.measured;
    match (&scene.by_method(), opened) {
        (ByMethod::Pbf(scene), _) => {
            if sweep.errors[0].measure() == Measure::Converged {
                let (boundary, frame) = (&start.boundary, point.frames);
                let distance = distance_to_converged(scene, boundary, frame, &end, CONVERGED)?;
                measured.distance = Some(distance);
            }
            measured.work = neighbor_visits(scene, &end, measured);
        }
        (ByMethod::Flip(scene), Opened::Gpu(_)) => {
            measured.work *= products(scene.settings().pressure.preconditioner);
        }
        // The two halves of the reference's incomplete Cholesky read as much as one product, like
        // IPP.
        (ByMethod::Flip(_), Opened::Cpu) => measured.work *= products(Preconditioner::Ipp),
    }
    Ok(run)
}

impl SweepMeasurements {
    fn look(&mut self, point: &Point, gauge: Option<&Gauge>, step: &ComputedFrame) {
        let report = &step.report;
        self.substeps += u64::from(report.substeps);
        self.iterations += report.iterations;
        self.density.push([
            report.density_error_mean,
            report.density_error_p99,
            report.density_error_max,
        ]);
        self.speed.push(report.max_speed);
        if let Some(projection) = report.projection {
            self.missed += projection.missed;
            self.work += (report.iterations + projection.correction_iterations) as f64;
        }
        let is_sampled = || step.frame.is_multiple_of(point.frames / SAMPLES);
        if let Some(gauge) = gauge.filter(|_| is_sampled()) {
            self.samples
                .push(sample(&point.scene, gauge, &step.particles.water()));
        }
    }

    /// Records the pressure errors. `weights` are the hydrostatic pressures at the pressure probes,
    /// Pa; empty where not requested.
    fn weigh(&mut self, weights: &[f64], step: &ComputedFrame) {
        let off = |(p, weight): (&Option<f64>, &f64)| Some((p.as_ref()? / weight - 1.0).abs());
        let all: Option<Vec<f64>> = step.pressures.iter().zip(weights).map(off).collect();
        if !weights.is_empty() {
            let mean = |all: Vec<f64>| all.iter().sum::<f64>() / all.len() as f64;
            self.weight.push(all.map(mean));
        }
    }
}

/// Hydrostatic pressures ρ g depth at the scene's pressure probes, Pa, below the upper end of the
/// highest initial particle.
fn still_pressures(scene: &Scene, start: &Particles) -> Vec<f64> {
    let gravity = scene.water.gravity;
    let up = -gravity.normalize_or_zero();
    let height = |x: &[f32; 3]| up.dot(Vec3::from_array(*x).as_dvec3());
    let highest = start
        .position
        .iter()
        .map(height)
        .fold(f64::NEG_INFINITY, f64::max);
    let level = highest + 0.5 * scene.particle_spacing();
    let points = scene.pressure_points().into_iter();
    points
        .map(|at| scene.water.rest_density * gravity.length() * (level - up.dot(at)))
        .collect()
}

fn sample(scene: &Scene, gauge: &Gauge, particles: &Particles) -> Sample {
    let spacing = scene.particle_spacing();
    let measures = gauge.measure(&particles.position, spacing);
    Sample {
        crest: measures.crest_height,
        front: measures.front,
        energy: specific_energy(scene, particles),
        profile: gauge.profile(&particles.position, spacing),
    }
}

/// Mean energy per mass of the particles, m²/s²: ½ v² + g h above the domain's least corner.
fn specific_energy(scene: &Scene, particles: &Particles) -> f64 {
    let gravity = scene.water.gravity;
    let of = |(x, v): (&[f32; 3], &[f32; 3])| {
        let [x, v] = [x, v].map(|p| Vec3::from_array(*p).as_dvec3());
        0.5 * v.length_squared() - gravity.dot(x - scene.domain.min)
    };
    let all = particles.position.iter().zip(&particles.velocity);
    all.map(of).sum::<f64>() / particles.len().max(1) as f64
}

/// Neighbour visits of a PBF run: particles × mean neighbours at the run's end × passes over them,
/// which are one for λ and one for the corrections of each iteration, and the search of each
/// substep.
fn neighbor_visits(scene: &PbfScene, end: &Particles, run: &SweepMeasurements) -> f64 {
    let pbf = scene.settings();
    let radius = pbf.support_ratio * pbf.particle_spacing;
    let place = |x: &[f32; 3]| Vec3::from_array(*x).as_dvec3() - scene.domain.min;
    let positions: Vec<DVec3> = end.position.iter().map(place).collect();
    let cells = Cells::periodic(scene.domain.size(), radius, scene.period());
    let order = cells.order(&positions, &end.id);
    let points: Vec<DVec3> = order.iter().map(|&k| positions[k]).collect();
    let crowd = SortedPoints {
        cells,
        points: &points,
        particles: points.len(),
    };
    // Counts each pair from both sides: particles × mean neighbours.
    let pairs = Neighbors::search(&crowd, radius).pairs() as f64;
    pairs * (2 * run.iterations + run.substeps) as f64
}

/// Work of an iteration in products with the finest matrix: one of its own, and the neighbour reads
/// of its preconditioner. The two halves of IPP make one product; a V-cycle takes half a product
/// each for the second colour, the residual, the corrected colour and the last one, and an eighth
/// of that on each coarser level.
pub(super) fn products(preconditioner: Preconditioner) -> f64 {
    match preconditioner {
        Preconditioner::None | Preconditioner::Jacobi => 1.0,
        Preconditioner::Ipp => 2.0,
        Preconditioner::Multigrid => 1.0 + 2.0 * 8.0 / 7.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four half-products on each level, which has an eighth of the cells of the previous one,
    /// besides the iteration's own product.
    #[test]
    fn a_v_cycle_s_products_are_counted_over_its_levels() {
        let cycle: f64 = (0..20).map(|level| 4.0 * 0.5 / 8f64.powi(level)).sum();
        assert!((products(Preconditioner::Multigrid) - 1.0 - cycle).abs() < 1e-12);
        assert_eq!(products(Preconditioner::Ipp), 2.0);
        assert_eq!(products(Preconditioner::Jacobi), 1.0);
    }
}
