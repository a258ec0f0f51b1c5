//! Evaluates one mark of a run: a value per frame, and their aggregate.

use glam::DVec3;

use swell_domain::{body::BodyState, bounds::Bounds, probe::energies, solver::StepReport};
use swell_files::study::stability::{Mark, Other, Over, Quantity};
use swell_scene::Scene;
use swell_study::stability::{Flight, filled_volume, least_spacing, matched, outside, point};

use super::view::RunView;

/// A run beside the measured one, with the correspondence of their particles.
pub(super) struct Beside<'a> {
    pub(super) view: RunView<'a>,
    pub(super) other: &'a Other,
    /// Index in this run of each particle of the measured run; `None` where it has no counterpart.
    pub(super) partner: Vec<Option<usize>>,
    /// Origin of the measured run.
    origin: DVec3,
}

/// Maps a position of the other run, relative to that run's origin, to the measured run's
/// coordinates.
fn to_ours(p: DVec3, origin: DVec3, view: &RunView<'_>, other: &Other) -> DVec3 {
    (p + view.scene.origin - other.shift) / other.scale - origin
}

impl<'a> Beside<'a> {
    pub(super) fn new(view: RunView<'a>, other: &'a Other, ours: &RunView<'_>) -> Self {
        let partner = matched(
            &ours.state.position,
            &view.state.position,
            |p| to_ours(p, ours.scene.origin, &view, other),
            ours.scene.particle_spacing(),
        );
        Self {
            origin: ours.scene.origin,
            view,
            other,
            partner,
        }
    }

    /// Current and initial position in this run of the counterpart of particle `k`, in the measured
    /// run's coordinates.
    fn places(&self, k: usize) -> Option<(DVec3, DVec3)> {
        let of = |p: &[f32; 3]| to_ours(point(p), self.origin, &self.view, self.other);
        let partner = self.partner[k]?;
        let start = &self.view.at_start;
        Some((
            of(&self.view.state.position[partner]),
            of(&start.position[partner]),
        ))
    }
}

/// State of a mark during a run.
pub(super) struct Watch<'a> {
    pub(super) mark: &'a Mark,
    flight: Option<Flight>,
    /// Values that a quantity carries from frame to frame, initialised by [`remembered`].
    memory: Vec<f64>,
    /// Time in seconds and value of each frame that the mark covers.
    pub(super) curve: Vec<[f64; 2]>,
    value: Option<f64>,
}

/// Initial value of the memory of a quantity.
fn remembered(mark: &Mark, run: &RunView<'_>) -> Vec<f64> {
    let (scene, start) = (run.scene, &run.at_start);
    let of_start = |number: f64| mark.since.is_none().then_some(number);
    match mark.of {
        // Lowest height so far of each particle.
        Quantity::Rebound => start.position.iter().map(|p| f64::from(p[1])).collect(),
        // Energy at the start, and the lowest energy so far.
        Quantity::EnergyGain | Quantity::EnergyRise => {
            let mass = scene.water.rest_density * scene.particle_spacing().powi(3);
            let (gravity, corner) = (scene.water.gravity, scene.domain.min);
            let (kinetic, potential) = energies(start, mass, gravity, corner);
            vec![kinetic + potential + run.energy_of_bodies(); 2]
        }
        // Sum for each probe, and the number of terms.
        Quantity::MeanPressureError => vec![0.0; scene.pressure_points().len() + 1],
        // Quantities relative to the state at `since` have no reference before that time.
        Quantity::Sinking => {
            let height = mean_height(&start.position) - scene.domain.min.y;
            of_start(height).into_iter().collect()
        }
        Quantity::VolumeDrift | Quantity::FilledVolume => of_start(1.0).into_iter().collect(),
        // Two sums.
        Quantity::IterationsRatio | Quantity::GaugeConvergence => vec![0.0; 2],
        _ => Vec::new(),
    }
}

impl<'a> Watch<'a> {
    pub(super) fn new(mark: &'a Mark, run: &RunView<'_>) -> Self {
        let start = &run.at_start;
        let is_flight = mark.of == Quantity::BallisticError;
        Self {
            mark,
            flight: is_flight.then(|| Flight::new(&start.position, &start.velocity)),
            memory: remembered(mark, run),
            curve: Vec::new(),
            value: None,
        }
    }

    /// Updates the mark after a frame.
    pub(super) fn look(&mut self, run: &RunView<'_>, beside: &[Beside<'_>], report: &StepReport) {
        let from = self.mark.after.max(self.mark.since.unwrap_or(0.0));
        let counts = run.time() >= from * (1.0 - 1e-9);
        // Quantities that integrate from the start need every frame; means begin where the mark
        // does.
        let sees_all = self.flight.is_some() || self.mark.of == Quantity::Rebound;
        if !counts && !sees_all {
            return;
        }
        let number = self.number(run, beside, report);
        if counts {
            self.curve.push([run.time(), number]);
            self.value = Some(match (self.mark.of.about().over, self.value) {
                (Over::Worst, Some(before)) => self.mark.bound.worse(before, number),
                _ => number,
            });
        }
    }

    /// Aggregate of all frames; `None` where no frame was covered or the value is not finite.
    pub(super) fn value(&self) -> Option<f64> {
        self.value.filter(|value| value.is_finite())
    }

    fn number(&mut self, run: &RunView<'_>, beside: &[Beside<'_>], report: &StepReport) -> f64 {
        let scene = run.scene;
        let spacing = scene.particle_spacing();
        let (start, now) = (&run.at_start, &run.state);
        let projection = report.projection.unwrap_or_default();
        let of_water = report.kinetic_energy + report.potential_energy;
        let energy = of_water + run.energy_of_bodies();
        match self.mark.of {
            Quantity::Escaped => outside(&now.position, &scene.domain) as f64,
            Quantity::Lost => lost(&start.id, &now.id) as f64,
            Quantity::NotFinite => {
                let values = now.position.iter().chain(&now.velocity).flatten();
                values.filter(|value| !value.is_finite()).count() as f64
            }
            Quantity::Speed => report.max_speed,
            Quantity::SpeedOverCap => {
                let step = scene.shot.frame_seconds() / f64::from(report.substeps.max(1));
                report.max_speed * step / run.cap()
            }
            Quantity::LeastSpacing => least_spacing(&now.position, spacing),
            Quantity::Climb => (top(&now.position) - top(&start.position)) / spacing,
            Quantity::Sinking => 1.0 - self.drift(mean_height(&now.position) - scene.domain.min.y),
            Quantity::BallisticError => self.flight.as_mut().map_or(f64::NAN, |flight| {
                let seconds = scene.shot.frame_seconds();
                flight.advance(scene.water.gravity, seconds, report.substeps);
                flight.error(&now.position)
            }),
            Quantity::Rebound => {
                let mut most = 0.0f64;
                let all = now.position.iter().zip(&start.position);
                for (low, (p, from)) in self.memory.iter_mut().zip(all) {
                    *low = low.min(f64::from(p[1]));
                    let fallen = f64::from(from[1]) - *low;
                    if fallen > 0.0 {
                        most = most.max((f64::from(p[1]) - *low) / fallen);
                    }
                }
                most
            }
            Quantity::VolumeDrift => {
                let held = now.len() as f64 * spacing.powi(3);
                (self.drift(run.volume() / held) - 1.0).abs()
            }
            Quantity::FilledVolume => {
                let filled = filled_volume(&now.position, spacing, &scene.domain);
                (self.drift(filled.unwrap_or(f64::NAN)) - 1.0).abs()
            }
            Quantity::EnergyGain => energy / self.memory[0] - 1.0,
            Quantity::EnergyRise => {
                self.memory[1] = self.memory[1].min(energy);
                (energy - self.memory[1]) / self.memory[0]
            }
            Quantity::PressureError => {
                let pressures = run.pressures.iter().map(|p| p.unwrap_or(f64::NAN));
                pressure_error(run, pressures)
            }
            Quantity::MeanPressureError => {
                let now = run.pressures.iter().map(|p| p.unwrap_or(f64::NAN));
                for (sum, p) in self.memory.iter_mut().zip(now.chain([1.0])) {
                    *sum += p;
                }
                let (count, sums) = self.memory.split_last().unwrap_or((&f64::NAN, &[]));
                pressure_error(run, sums.iter().map(|sum| sum / count))
            }
            Quantity::Compression => report.density_error_mean,
            Quantity::LargestCompression => report.density_error_max,
            Quantity::Residual => projection.residual,
            Quantity::Missed => f64::from(projection.missed),
            Quantity::Pockets => f64::from(projection.pockets),
            Quantity::Incompatible => projection.incompatible,
            Quantity::Dropped => projection.dropped as f64,
            Quantity::Iterations => report.iterations as f64,
            Quantity::Substeps => f64::from(report.substeps),
            Quantity::Capped => {
                let steps = now.len() as f64 * f64::from(report.substeps);
                report.capped as f64 / steps.max(1.0)
            }
            Quantity::Behind => outside(&now.position, &run.walls()) as f64,
            Quantity::InSolid => {
                let depths = now.position.iter().map(|p| run.depth_in_solid(point(p)));
                depths.fold(f64::NEG_INFINITY, f64::max).max(-1e3) / run.resolution()
            }
            Quantity::BodySpeed => scene.fastest_body(&now.bodies),
            Quantity::BodiesEscaped => {
                let lost =
                    |body: &&BodyState| !body.is_finite() || !run.walls().contains(body.centre);
                now.bodies.iter().filter(lost).count() as f64
            }
            Quantity::BodyOverlap => run.overlap_of_bodies() / run.resolution(),
            Quantity::InRegion => match &self.mark.region {
                Some(region) => (now.len() - outside(&now.position, &about(region, scene))) as f64,
                None => f64::NAN,
            },
            Quantity::Difference => self.difference(run, beside),
            Quantity::DisplacementError => displacement_error(run, beside),
            Quantity::IterationsRatio => {
                let theirs = beside.first().and_then(|other| other.view.report.as_ref());
                let theirs = theirs.map_or(f64::NAN, |report| report.iterations as f64);
                self.ratio([report.iterations as f64, theirs])
            }
            Quantity::GaugeDifference => match beside {
                [other, ..] => {
                    largest(gaps(run, &other.view, other.other.scale)) / run.resolution()
                }
                [] => f64::NAN,
            },
            Quantity::GaugeConvergence => match beside {
                [second, third, ..] => {
                    let square = |gaps: Vec<f64>| gaps.iter().map(|gap| gap * gap).sum::<f64>();
                    let finer = square(gaps(&second.view, &third.view, 1.0));
                    let coarser = square(gaps(run, &second.view, second.other.scale));
                    self.ratio([finer, coarser]).sqrt()
                }
                _ => f64::NAN,
            },
        }
    }

    /// Ratio of a value to the reference, which the first value becomes where none is known.
    fn drift(&mut self, number: f64) -> f64 {
        if self.memory.is_empty() {
            self.memory.push(number);
        }
        number / self.memory[0]
    }

    /// Ratio of two sums over the frames so far.
    fn ratio(&mut self, numbers: [f64; 2]) -> f64 {
        let sums = self.memory.iter_mut().zip(numbers);
        sums.for_each(|(sum, number)| *sum += number);
        self.memory[0] / self.memory[1]
    }

    fn difference(&self, run: &RunView<'_>, beside: &[Beside<'_>]) -> f64 {
        let [other, ..] = beside else {
            return f64::NAN;
        };
        let (start, now) = (&run.at_start, &run.state);
        let is_meant = |k: &usize| {
            let region = self.mark.region.as_ref();
            let at = point(&start.position[*k]) + run.scene.origin;
            region.is_none_or(|region| region.contains(at))
        };
        let gap = |k: usize| match other.places(k) {
            Some((place, _)) => place.distance(point(&now.position[k])),
            None => f64::NAN,
        };
        largest((0..now.len()).filter(is_meant).map(gap)) / run.resolution()
    }
}

fn displacement_error(run: &RunView<'_>, beside: &[Beside<'_>]) -> f64 {
    let [other, ..] = beside else {
        return f64::NAN;
    };
    let (mut gaps, mut ways) = (0.0, 0.0);
    for (k, p) in run.state.position.iter().enumerate() {
        let Some((place, start)) = other.places(k) else {
            return f64::NAN;
        };
        gaps += place.distance_squared(point(p));
        ways += place.distance_squared(start);
    }
    (gaps / ways).sqrt()
}

/// Converts a box from world space to the scene's coordinates.
fn about(region: &Bounds, scene: &Scene) -> Bounds {
    Bounds {
        min: region.min - scene.origin,
        max: region.max - scene.origin,
    }
}

/// Number of ids that are in only one of two ascending lists; duplicates count where the lengths
/// are equal.
fn lost(a: &[u32], b: &[u32]) -> usize {
    if a == b {
        return 0;
    }
    let missing = |a: &[u32], b: &[u32]| a.iter().filter(|id| b.binary_search(id).is_err()).count();
    missing(a, b) + missing(b, a).max(usize::from(a.len() == b.len()))
}

fn top(position: &[[f32; 3]]) -> f64 {
    position
        .iter()
        .map(|p| f64::from(p[1]))
        .fold(f64::MIN, f64::max)
}

fn mean_height(position: &[[f32; 3]]) -> f64 {
    position.iter().map(|p| f64::from(p[1])).sum::<f64>() / position.len() as f64
}

/// Largest value; NaN if any value is NaN.
fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    let larger = |a: f64, b: f64| {
        if a.is_nan() || b.is_nan() {
            f64::NAN
        } else {
            a.max(b)
        }
    };
    values.into_iter().fold(0.0, larger)
}

fn pressure_error(run: &RunView<'_>, pressures: impl Iterator<Item = f64>) -> f64 {
    let scene = run.scene;
    let surface = top(&run.at_start.position) + 0.5 * scene.particle_spacing();
    let weight = scene.water.rest_density * scene.water.gravity.length();
    let points = scene.pressure_points();
    let off = points.iter().zip(pressures);
    largest(off.map(|(at, p)| (p / (weight * (surface - at.y)) - 1.0).abs()))
}

/// Differences between the elevation probes of two runs, in metres of the first run.
fn gaps(a: &RunView<'_>, b: &RunView<'_>, scale: f64) -> Vec<f64> {
    let pairs = a.elevations.iter().zip(&b.elevations);
    let gap = |(a, b): (&Option<f64>, &Option<f64>)| match (a, b) {
        (Some(a), Some(b)) => (a - b / scale).abs(),
        (None, None) => 0.0,
        _ => f64::NAN,
    };
    pairs.map(gap).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lost_and_doubled_particles_count() {
        assert_eq!(lost(&[1, 2, 3], &[1, 2, 3]), 0);
        assert_eq!(lost(&[1, 2, 3], &[1, 3]), 1);
        assert_eq!(lost(&[1, 2, 3], &[1, 2, 3, 7]), 1);
        assert_eq!(lost(&[1, 2, 3], &[1, 2, 9]), 2);
        // 3 is lost, 2 is duplicated.
        assert_eq!(lost(&[1, 2, 3], &[1, 2, 2]), 2);
    }

    #[test]
    fn what_is_no_number_is_the_largest() {
        assert_eq!(largest([1.0, 3.0, 2.0]), 3.0);
        assert!(largest([1.0, f64::NAN, 2.0]).is_nan());
    }
}
