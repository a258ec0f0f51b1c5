//! Checks that the errors of a sweep can be measured.

use toml::Spanned;

use super::{ErrorMeasure, Line, Measure, Point, SAMPLES, SweepSpec, errors};
use crate::{document::Document, physics_hash};
use swell_domain::sampling::fill_water;
use swell_scene::{Method, Scene, SceneError};

/// Most particles for which the distance to convergence is measured. With 8000 particles a
/// factorisation takes about 1 s and Newton's method needs some 20 of them; both grow faster than
/// the number of particles.
const MOST_CONVERGED: usize = 9000;

/// Checks that the runs of a line can be measured.
pub(super) fn check_fit(
    doc: &Document<'_>,
    spec: &SweepSpec,
    line: &Line,
    error: ErrorMeasure,
    state: Option<&Point>,
) -> Result<(), SceneError> {
    let fault = |problem: String| Err(doc.fault_at(spec.errors.span(), problem));
    let of_frames = |_: &&Point| error.measure() == Measure::Finest;
    for Point {
        scene,
        frames,
        label,
        ..
    } in line
        .points
        .iter()
        .chain(line.coarser.iter().filter(of_frames))
    {
        if error.measure() == Measure::Finest && frames % SAMPLES != 0 {
            return fault(format!(
                "{} is taken at {SAMPLES} times, and {:?} with {label} has {frames} frames, which \
                 is not a multiple of that",
                error.name(),
                line.name
            ));
        }
        let is_same = |state: &Point| {
            let water = |scene: &Scene| {
                (
                    scene.solver.method(),
                    scene.particle_spacing(),
                    scene.domain,
                )
            };
            water(scene) == water(&state.scene)
                && scene.solver.cell_size() == state.scene.solver.cell_size()
        };
        if !state.is_none_or(is_same) {
            return fault(format!(
                "{} is measured on one state, and {:?} with {label} has another \
                 solver, domain or resolution",
                error.name(),
                line.name
            ));
        }
    }
    Ok(())
}

/// Checks that there are pressures to compare with the water's weight.
pub(super) fn check_weighed(
    doc: &Document<'_>,
    spec: &SweepSpec,
    line: &Line,
) -> Result<(), SceneError> {
    let lacking = |point: &Point| {
        let has_weight = point.scene.water.gravity != glam::DVec3::ZERO;
        let has_probes = !point.scene.pressure_points().is_empty();
        match (has_probes, has_weight) {
            (false, _) => Some("its scene has no probe of pressure"),
            (true, false) => Some("its scene has no gravity"),
            (true, true) => None,
        }
    };
    let found = line
        .points
        .iter()
        .find_map(|point| Some((point, lacking(point)?)));
    match found {
        None => Ok(()),
        Some((point, why)) => {
            let problem = format!(
                "weight_error cannot be measured of {:?} with {}: {why}",
                line.name, point.label
            );
            Err(doc.fault_at(spec.errors.span(), problem))
        }
    }
}

/// Checks that the distance to convergence can be measured, and within minutes.
pub(super) fn check_converged(
    doc: &Document<'_>,
    spec: &SweepSpec,
    line: &Line,
) -> Result<(), SceneError> {
    let fault = |problem: String| Err(doc.fault_at(spec.errors.span(), problem));
    for Point { scene, label, .. } in &line.points {
        let name = &line.name;
        if scene.solver.method() != Method::Pbf {
            return fault(format!(
                "distance_to_converged is measured with solver.method pbf, and {name:?} \
                 with {label} has another"
            ));
        }
        let water = scene.water.meshes.iter().map(|placed| &placed.mesh);
        let (blocks, spacing) = (&scene.water.blocks, scene.particle_spacing());
        let filled = match fill_water(blocks, water, None, &scene.domain, spacing) {
            Ok(fill) => fill.particles.len(),
            Err(error) => return fault(error.to_string()),
        };
        if filled > MOST_CONVERGED {
            return fault(format!(
                "distance_to_converged takes some 20 sparse factors of the constraints a run, a \
                 second each with 8000 particles and soon gigabytes with more; {name:?} with \
                 {label} has {filled} particles, and up to {MOST_CONVERGED} are measured"
            ));
        }
    }
    Ok(())
}

/// Checks that `coarser` can estimate the error of `finest`.
pub(super) fn check_coarser(
    doc: &Document<'_>,
    spec: &SweepSpec,
    set: &Spanned<Vec<Spanned<String>>>,
    coarser: &Scene,
    finest: &Scene,
) -> Result<(), SceneError> {
    let fault = |problem: &str| Err(doc.fault_at(set.span(), problem));
    match errors(doc, &spec.errors)?[0].measure() {
        Measure::Finest if physics_hash(coarser) != physics_hash(finest) => Ok(()),
        Measure::Finest => fault("the scene is that of the last value: this changes nothing"),
        Measure::Projection => {
            let size = |scene: &Scene| scene.solver.cell_size();
            let is_same = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b;
            let is_twice = coarser.solver.method() == finest.solver.method()
                && is_same(size(coarser), 2.0 * size(finest))
                && is_same(coarser.particle_spacing(), finest.particle_spacing())
                && coarser.domain == finest.domain;
            match is_twice {
                true => Ok(()),
                false => fault(
                    "a projection is compared with one of the same particles on cells twice as \
                     large, with eight times as many in each",
                ),
            }
        }
        Measure::Report | Measure::Converged => fault(
            "these errors measure what the iterations leave, so that no grid or step is coarser \
             for them",
        ),
    }
}
