//! What a scene's probes see of a frame.

use crate::{
    cache::{Entry, ProbeRecord, ProbeValues, stream::PROBES},
    domain::{
        particles::Particles,
        probe::{elevation, energies, flux, front, run_up, volume},
    },
    scene::{Scene, probe::ProbeKind},
    study::chart::{Chart, Series},
};

/// The scene's probes as the cache keeps them.
pub(super) fn records(scene: &Scene) -> Vec<ProbeRecord> {
    let probes = scene.probes.iter();
    probes
        .map(|probe| ProbeRecord {
            name: probe.name.clone(),
            kind: probe.kind.name().to_owned(),
            at: probe.kind.at(scene.origin),
            axis: probe.kind.towards().map(|wall| wall.name().to_owned()),
            quantile: probe.kind.quantile(),
            columns: probe.kind.columns().iter().map(|&c| c.to_owned()).collect(),
        })
        .collect()
}

/// Values of a frame, one list a probe. `pressures` are those at the scene's
/// [`pressure_points`](Scene::pressure_points), Pa.
pub(super) fn look(scene: &Scene, particles: &Particles, pressures: &[Option<f64>]) -> ProbeValues {
    let spacing = scene.particle_spacing();
    let mut pressures = pressures.iter().copied();
    let probes = scene.probes.iter();
    probes
        .map(|probe| match probe.kind {
            ProbeKind::Elevation { at } => {
                let height = elevation(particles, spacing, &scene.domain, at);
                vec![height.map(|y| scene.origin.y + y)]
            }
            ProbeKind::Pressure { .. } => vec![pressures.next().flatten()],
            ProbeKind::Energy => {
                let mass = scene.water.rest_density * spacing.powi(3);
                let gravity = scene.water.gravity;
                let (kinetic, potential) = energies(particles, mass, gravity, scene.domain.min);
                vec![Some(kinetic), Some(potential), Some(kinetic + potential)]
            }
            ProbeKind::Volume => vec![Some(volume(particles, spacing, &scene.domain))],
            ProbeKind::Front { towards, quantile } => {
                let sign = if towards.is_max { 1.0 } else { -1.0 };
                let place = front(particles, spacing, towards.axis, sign, quantile);
                vec![place.map(|place| scene.origin[towards.axis] + place)]
            }
            ProbeKind::RunUp { quantile } => {
                let height = run_up(particles, spacing, quantile);
                vec![height.map(|y| scene.origin.y + y)]
            }
            ProbeKind::Flux { towards, at } => {
                let rate = flux(particles, spacing, towards.axis, at);
                vec![Some(if towards.is_max { rate } else { -rate })]
            }
        })
        .collect()
}

/// What the probe of `index` saw over time as a chart, one line a column.
pub(super) fn chart(shot: &str, record: &ProbeRecord, index: usize, entries: &[Entry]) -> Chart {
    let columns = || record.columns.iter().map(|column| column.rsplit_once('_'));
    let value = |entry: &Entry, column: usize| *entry.row(PROBES, index).get(column)?;
    let series = columns().enumerate().map(|(column, parts)| {
        let points = entries.iter();
        let points = points.map(|entry| (entry.clock.time, value(entry, column)));
        Series::curve(parts.map_or("", |(quantity, _)| quantity), points)
    });
    let unit = columns().flatten().map(|(_, unit)| unit).next();
    let place = match &record.at[..] {
        [] => String::new(),
        at => format!(" at {at:?} m"),
    };
    Chart {
        title: format!("{shot}: {}{place}", record.name),
        x_label: "time, s".to_owned(),
        y_label: unit.unwrap_or_default().replace("m3", "m³"),
        series: series.collect(),
        ..Chart::default()
    }
}
