//! One mark of a run: a number a frame, and what these come to.

use glam::DVec3;

use crate::{
    domain::{
        bounds::Bounds,
        probe::{energies, volume},
        solver::{Projection, StepReport},
    },
    scene::{
        Scene,
        study::stability::{Mark, Other, Over, Quantity},
    },
    study::stability::{Flight, filled_volume, least_spacing, matched, outside, point},
};

use super::view::View;

/// A run beside the one that is measured, and who is who.
pub(super) struct Beside<'a> {
    pub(super) view: View<'a>,
    pub(super) other: &'a Other,
    /// For each particle of the run its own; `None` where it has none there.
    pub(super) partner: Vec<Option<usize>>,
    /// Of the run that is measured.
    origin: DVec3,
}

/// A place of the other run, about its own origin, where the run would have it, about its own.
fn to_ours(p: DVec3, origin: DVec3, view: &View<'_>, other: &Other) -> DVec3 {
    (p + view.scene.origin - other.shift) / other.scale - origin
}

impl<'a> Beside<'a> {
    pub(super) fn new(view: View<'a>, other: &'a Other, ours: &View<'_>) -> Self {
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

    /// Where a particle of the run would be if it went as here; its place at the start as well.
    fn places(&self, k: usize) -> Option<(DVec3, DVec3)> {
        let of = |p: &[f32; 3]| to_ours(point(p), self.origin, &self.view, self.other);
        let partner = self.partner[k]?;
        let start = &self.view.start.particles;
        Some((
            of(&self.view.state.position[partner]),
            of(&start.position[partner]),
        ))
    }
}

/// A mark while a run is under way.
pub(super) struct Watch<'a> {
    pub(super) mark: &'a Mark,
    memory: Memory,
    /// Seconds and numbers, one a frame that counts.
    pub(super) curve: Vec<[f64; 2]>,
    value: Option<f64>,
}

/// What a quantity remembers of the frames before.
enum Memory {
    Nothing,
    Flight(Flight),
    /// Lowest place so far, a particle.
    Lowest(Vec<f64>),
    /// Of the start, and the least so far.
    Energy(f64, f64),
    /// Sums a probe, and how many there are.
    Means(Vec<f64>, f64),
    /// At `since`, or of the start; `None` before.
    Reference(Option<f64>),
    /// Two sums.
    Sums([f64; 2]),
}

impl<'a> Watch<'a> {
    pub(super) fn new(mark: &'a Mark, run: &View<'_>) -> Self {
        let start = &run.start.particles;
        let memory = match mark.of {
            Quantity::BallisticError => {
                Memory::Flight(Flight::new(&start.position, &start.velocity))
            }
            Quantity::Rebound => {
                Memory::Lowest(start.position.iter().map(|p| f64::from(p[1])).collect())
            }
            Quantity::EnergyGain | Quantity::EnergyRise => {
                let mass = run.scene.water.rest_density * run.scene.particle_spacing().powi(3);
                let gravity = run.scene.water.gravity;
                let (kinetic, potential) = energies(start, mass, gravity, run.scene.domain.min);
                Memory::Energy(kinetic + potential, kinetic + potential)
            }
            Quantity::MeanPressureError => {
                Memory::Means(vec![0.0; run.scene.pressure_points().len()], 0.0)
            }
            Quantity::Sinking => {
                let start = mean_height(&start.position) - run.scene.domain.min.y;
                Memory::Reference(mark.since.is_none().then_some(start))
            }
            Quantity::VolumeDrift | Quantity::FilledVolume => {
                Memory::Reference(mark.since.is_none().then_some(1.0))
            }
            Quantity::IterationsRatio | Quantity::GaugeConvergence => Memory::Sums([0.0; 2]),
            _ => Memory::Nothing,
        };
        Self {
            mark,
            memory,
            curve: Vec::new(),
            value: None,
        }
    }

    /// After each frame.
    pub(super) fn look(&mut self, run: &View<'_>, beside: &[Beside<'_>], report: &StepReport) {
        let from = self.mark.after.max(self.mark.since.unwrap_or(0.0));
        let counts = run.time() >= from * (1.0 - 1e-9);
        // What sums up the way from the start has to see all of it; means begin where the mark does.
        if !counts && !matches!(self.memory, Memory::Flight(_) | Memory::Lowest(_)) {
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

    /// What the frames come to; `None` where none counted or it is no number.
    pub(super) fn value(&self) -> Option<f64> {
        self.value.filter(|value| value.is_finite())
    }

    fn number(&mut self, run: &View<'_>, beside: &[Beside<'_>], report: &StepReport) -> f64 {
        let scene = run.scene;
        let spacing = scene.particle_spacing();
        let (start, now) = (&run.start.particles, &run.state);
        let projection = report.projection.unwrap_or_default();
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
            Quantity::Compression => report.density_error_mean,
            Quantity::LargestCompression => report.density_error_max,
            Quantity::Residual
            | Quantity::Missed
            | Quantity::Pockets
            | Quantity::Incompatible
            | Quantity::Dropped => of_projection(self.mark.of, &projection),
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
            Quantity::InRegion => match &self.mark.region {
                Some(region) => (now.len() - outside(&now.position, &about(region, scene))) as f64,
                None => f64::NAN,
            },
            Quantity::PressureError => {
                let pressures = run.pressures.iter().map(|p| p.unwrap_or(f64::NAN));
                pressure_error(run, pressures)
            }
            Quantity::Difference => self.difference(run, beside),
            Quantity::DisplacementError => displacement_error(run, beside),
            Quantity::GaugeDifference => match beside {
                [other, ..] => {
                    largest(gaps(run, &other.view, other.other.scale)) / run.resolution()
                }
                [] => f64::NAN,
            },
            Quantity::Sinking
            | Quantity::VolumeDrift
            | Quantity::FilledVolume
            | Quantity::BallisticError
            | Quantity::Rebound
            | Quantity::EnergyGain
            | Quantity::EnergyRise
            | Quantity::MeanPressureError
            | Quantity::IterationsRatio
            | Quantity::GaugeConvergence => self.remembered(run, beside, report),
        }
    }

    /// Of quantities that depend on the frames before.
    fn remembered(&mut self, run: &View<'_>, beside: &[Beside<'_>], report: &StepReport) -> f64 {
        let now = &run.state;
        match &mut self.memory {
            Memory::Flight(flight) => {
                let gravity = run.scene.water.gravity;
                flight.advance(gravity, run.scene.shot.frame_seconds(), report.substeps);
                flight.error(&now.position)
            }
            Memory::Lowest(lowest) => {
                let mut most = 0.0f64;
                let start = run.start.particles.position.iter();
                for ((low, p), from) in lowest.iter_mut().zip(&now.position).zip(start) {
                    *low = low.min(f64::from(p[1]));
                    let fallen = f64::from(from[1]) - *low;
                    if fallen > 0.0 {
                        most = most.max((f64::from(p[1]) - *low) / fallen);
                    }
                }
                most
            }
            Memory::Reference(reference) => {
                let scene = run.scene;
                let spacing = scene.particle_spacing();
                let number = match self.mark.of {
                    Quantity::Sinking => mean_height(&now.position) - scene.domain.min.y,
                    Quantity::FilledVolume => {
                        filled_volume(&now.position, spacing, &scene.domain).unwrap_or(f64::NAN)
                    }
                    _ => volume(now, spacing, &scene.domain) / (now.len() as f64 * spacing.powi(3)),
                };
                let ratio = number / *reference.get_or_insert(number);
                match self.mark.of {
                    Quantity::Sinking => 1.0 - ratio,
                    _ => (ratio - 1.0).abs(),
                }
            }
            Memory::Energy(first, least) => {
                let energy = report.kinetic_energy + report.potential_energy;
                *least = least.min(energy);
                match self.mark.of {
                    Quantity::EnergyRise => (energy - *least) / *first,
                    _ => energy / *first - 1.0,
                }
            }
            Memory::Means(sums, count) => {
                *count += 1.0;
                for (sum, p) in sums.iter_mut().zip(&run.pressures) {
                    *sum += p.unwrap_or(f64::NAN);
                }
                pressure_error(run, sums.iter().map(|sum| sum / *count))
            }
            Memory::Sums(sums) => match (self.mark.of, beside) {
                (Quantity::IterationsRatio, [other, ..]) => {
                    let theirs = other.view.report.as_ref().map_or(0, |r| r.iterations);
                    sums[0] += report.iterations as f64;
                    sums[1] += theirs as f64;
                    sums[0] / sums[1]
                }
                (Quantity::GaugeConvergence, [second, third, ..]) => {
                    let square = |gaps: Vec<f64>| gaps.iter().map(|gap| gap * gap).sum::<f64>();
                    sums[0] += square(gaps(&second.view, &third.view, 1.0));
                    sums[1] += square(gaps(run, &second.view, second.other.scale));
                    (sums[0] / sums[1]).sqrt()
                }
                _ => f64::NAN,
            },
            Memory::Nothing => f64::NAN,
        }
    }

    fn difference(&self, run: &View<'_>, beside: &[Beside<'_>]) -> f64 {
        let [other, ..] = beside else {
            return f64::NAN;
        };
        let (start, now) = (&run.start.particles, &run.state);
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

fn displacement_error(run: &View<'_>, beside: &[Beside<'_>]) -> f64 {
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

/// A box of the world about the scene's origin.
fn about(region: &Bounds, scene: &Scene) -> Bounds {
    Bounds {
        min: region.min - scene.origin,
        max: region.max - scene.origin,
    }
}

/// Ids that one of two ascending lists has and the other has not.
fn lost(a: &[u32], b: &[u32]) -> usize {
    if a == b {
        return 0;
    }
    let missing = |a: &[u32], b: &[u32]| a.iter().filter(|id| b.binary_search(id).is_err()).count();
    missing(a, b) + missing(b, a).max(usize::from(a.len() == b.len()))
}

fn of_projection(of: Quantity, projection: &Projection) -> f64 {
    match of {
        Quantity::Residual => projection.residual,
        Quantity::Missed => f64::from(projection.missed),
        Quantity::Pockets => f64::from(projection.pockets),
        Quantity::Incompatible => projection.incompatible,
        _ => projection.dropped as f64,
    }
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

/// Largest; what is no number is larger than any.
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

fn pressure_error(run: &View<'_>, pressures: impl Iterator<Item = f64>) -> f64 {
    let scene = run.scene;
    let surface = top(&run.start.particles.position) + 0.5 * scene.particle_spacing();
    let weight = scene.water.rest_density * scene.water.gravity.length();
    let points = scene.pressure_points();
    let off = points.iter().zip(pressures);
    largest(off.map(|(at, p)| (p / (weight * (surface - at.y)) - 1.0).abs()))
}

/// Of the probes of elevation, metres of the first run.
fn gaps(a: &View<'_>, b: &View<'_>, scale: f64) -> Vec<f64> {
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
        // 3 is lost, 2 doubled.
        assert_eq!(lost(&[1, 2, 3], &[1, 2, 2]), 2);
    }

    #[test]
    fn what_is_no_number_is_the_largest() {
        assert_eq!(largest([1.0, 3.0, 2.0]), 3.0);
        assert!(largest([1.0, f64::NAN, 2.0]).is_nan());
    }
}
