//! A point that is a run of frames.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::Instant,
};

use glam::{DVec3, Vec3};

use crate::{
    domain::{particles::Particles, solver::Solver},
    reference::{
        neighbors::{Cells, Crowd, Neighbors},
        pbf::constraint::distance_to_converged,
    },
    scene::{
        Method, Scene,
        flip::Preconditioner,
        study::sweep::{Measure, Point, SAMPLES},
    },
    study::measure::Gauge,
};

use super::{
    super::{
        super::{
            device::{Opened, SolverError},
            prepare::Start,
        },
        StudyError,
    },
    ledger::{Run, Sample},
    specific_energy,
};

/// Compression at which constraints hold: Newton's next step would move particles by less than f32 tells apart.
const CONVERGED: f64 = 1e-6;

type AnySolver = Box<dyn Solver<Error = SolverError>>;

/// Runs a point `repeats` times, each from the scene's start, after one frame that is not counted: it makes the
/// device's programs ready. Samples are taken where there is a gauge; the distance to where the constraints hold is taken
/// of the end alone, and its time is not the run's. `None` where `stop` ended it before.
pub(super) fn run(
    opened: &Opened,
    point: &Point,
    repeats: u32,
    measure: Measure,
    gauge: Option<&Gauge>,
    stop: &AtomicBool,
) -> Result<Option<Run>, StudyError> {
    let scene = &point.scene;
    let start = Start::of(scene)?;
    let mut solver = opened.build(scene, &start, false)?.solver;
    solver.load(0, &start.particles)?;
    solver.advance()?;
    let mut run = Run {
        particles: start.particles.len(),
        frames: point.frames,
        ..Run::default()
    };
    let once = |solver: &mut AnySolver, run: &mut Run, gauge| {
        run_once(solver, point, &start.particles, run, gauge, stop)
    };
    let Some(mut end) = once(&mut solver, &mut run, gauge)? else {
        return Ok(None);
    };
    for _ in 1..repeats {
        // The same steps again: only their time is new.
        let mut again = Run::default();
        let Some(again_end) = once(&mut solver, &mut again, None)? else {
            return Ok(None);
        };
        end = again_end;
        run.seconds.append(&mut again.seconds);
    }
    if measure == Measure::Converged {
        let distance =
            distance_to_converged(scene, &start.boundary, point.frames, &end, CONVERGED)?;
        run.distance = Some(distance);
    }
    run.work = match scene.solver.method {
        Method::Pbf => neighbor_visits(scene, &end, &run),
        Method::Flip => {
            run.work
                * match opened {
                    Opened::Gpu(_) => products(scene.solver.flip().pressure.preconditioner),
                    // The reference's incomplete Cholesky reads in its two halves what one product does, as IPP.
                    Opened::Cpu => products(Preconditioner::Ipp),
                }
        }
    };
    Ok(Some(run))
}

/// All frames once; the state at the end, `None` where `stop` came before.
fn run_once(
    solver: &mut AnySolver,
    point: &Point,
    start: &Particles,
    run: &mut Run,
    gauge: Option<&Gauge>,
    stop: &AtomicBool,
) -> Result<Option<Particles>, StudyError> {
    solver.load(0, start)?;
    let mut state = Particles::default();
    let mut seconds = 0.0;
    for frame in 1..=point.frames {
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let begin = Instant::now();
        let (particles, report) = solver.advance()?;
        seconds += begin.elapsed().as_secs_f64();
        run.substeps += u64::from(report.substeps);
        run.iterations += report.iterations;
        run.density.push([
            report.density_error_mean,
            report.density_error_p99,
            report.density_error_max,
        ]);
        if let Some(projection) = report.projection {
            run.missed += projection.missed;
            run.work += (report.iterations + projection.correction_iterations) as f64;
        }
        if let Some(gauge) = gauge
            && frame % (point.frames / SAMPLES) == 0
        {
            run.samples.push(sample(&point.scene, gauge, &particles));
        }
        state = particles;
    }
    run.seconds.push(seconds);
    Ok(Some(state))
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

/// Neighbour visits of a PBF run: particles × mean neighbours × passes over them, which are one of λ and one of
/// corrections an iteration and the search of each substep. The mean is that of the end.
fn neighbor_visits(scene: &Scene, end: &Particles, run: &Run) -> f64 {
    let pbf = scene.solver.pbf();
    let radius = pbf.support_ratio * pbf.particle_spacing;
    let place = |x: &[f32; 3]| Vec3::from_array(*x).as_dvec3() - scene.domain.min;
    let positions: Vec<DVec3> = end.position.iter().map(place).collect();
    let cells = Cells::new(scene.domain.size(), radius);
    let order = cells.order(&positions, &end.id);
    let points: Vec<DVec3> = order.iter().map(|&k| positions[k]).collect();
    let crowd = Crowd {
        cells,
        points: &points,
        particles: points.len(),
    };
    // Each pair from either side: particles × mean neighbours.
    let pairs = Neighbors::search(&crowd, radius).pairs() as f64;
    pairs * (2 * run.iterations + run.substeps) as f64
}

/// Products with the finest matrix that an iteration comes to: one of its own, and what its preconditioner reads of
/// neighbours. Both halves of IPP make one; a V-cycle takes half a product each for the second colour, the residual, the
/// corrected colour and the last, and an eighth as much on each coarser level.
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

    /// By hand, beside the iteration's own product: four half-products on each level, which has an eighth of the cells of the one before.
    #[test]
    fn a_v_cycle_s_products_are_counted_over_its_levels() {
        let cycle: f64 = (0..20).map(|level| 4.0 * 0.5 / 8f64.powi(level)).sum();
        assert!((products(Preconditioner::Multigrid) - 1.0 - cycle).abs() < 1e-12);
        assert_eq!(products(Preconditioner::Ipp), 2.0);
        assert_eq!(products(Preconditioner::Jacobi), 1.0);
    }
}
