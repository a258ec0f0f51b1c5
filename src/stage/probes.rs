//! Evaluates a scene's probes.

use std::borrow::Cow;

use swell_cache::{LedgerEntry, ProbeRecord, ProbeValues, stream::PROBES};
use swell_domain::{
    absorber::AbsorberStates,
    particles::Particles,
    probe::{Patch, Rate, elevation, energies, flux, front, load, run_up, volume},
    solver::{Observed, Requested, Span, Watch},
};
use swell_scene::{
    Scene,
    probe::{Probe, ProbeKind},
};
use swell_study::chart::{Chart, Series};

/// The scene's probes as the manifest records them.
pub(super) fn records(scene: &Scene) -> Vec<ProbeRecord> {
    let probes = scene.probes.iter();
    probes
        .map(|probe| ProbeRecord {
            name: probe.name.clone(),
            kind: probe.kind.name().to_owned(),
            at: probe.kind.at(scene.origin),
            axis: probe.kind.towards().map(|wall| wall.name().to_owned()),
            quantile: probe.kind.quantile(),
            solid: match probe.kind {
                ProbeKind::Force { on, .. } => Some(on.name(scene)),
                _ => None,
            },
            rate_hz: probe.rate,
            window: probe.window,
            columns: probe.kind.columns().iter().map(|&c| c.to_owned()).collect(),
        })
        .collect()
}

/// Values of a frame that ends at `time` seconds, one list per probe. `pressures` are those at the
/// scene's [`pressure_points`](Scene::pressure_points), Pa. `looks` are the values of a
/// [`Recorder`], or `None` at the start, where all probes sample.
pub(super) fn look(
    scene: &Scene,
    time: f64,
    particles: &Particles,
    pressures: &[Option<f64>],
    looks: Option<ProbeValues>,
) -> ProbeValues {
    let frame = |probe: &Probe| !is_recorded(probe) || looks.is_none();
    let mut values = of_state(scene, particles, pressures, frame);
    match looks {
        Some(looks) => {
            for ((values, looks), probe) in values.iter_mut().zip(looks).zip(&scene.probes) {
                values.extend(looks);
                if values.is_empty() && probe.rate == Rate::Frame {
                    // No substep ran, because there is no water.
                    values.resize(probe.kind.columns().len(), None);
                }
            }
        }
        None => {
            let own = scene.probes.iter().zip(&mut values);
            for (_, values) in own.filter(|(probe, _)| probe.rate != Rate::Frame) {
                values.insert(0, Some(time));
            }
        }
    }
    values
}

/// Whether a probe samples during a frame: it has its own rate, or what it observes is gone
/// afterwards.
pub(super) fn is_recorded(probe: &Probe) -> bool {
    probe.rate != Rate::Frame || matches!(probe.kind, ProbeKind::Force { .. })
}

/// Counts how often probes with their own rate sampled, and how often they were asked to; they
/// sample at most once per substep.
#[derive(Clone, Debug)]
pub(super) struct Looked {
    /// By probe: samples taken, samples requested.
    times: Vec<[u64; 2]>,
}

impl Looked {
    /// Before any frame.
    pub(super) fn new(scene: &Scene) -> Self {
        Self {
            times: vec![[0, 0]; scene.probes.len()],
        }
    }

    /// Adds frame `frame`, in which probes took these samples.
    pub(super) fn add(&mut self, scene: &Scene, frame: u32, looks: &ProbeValues) {
        let [start, end] = [frame.saturating_sub(1), frame].map(|frame| scene.shot.time(frame));
        for ((times, values), probe) in self.times.iter_mut().zip(looks).zip(&scene.probes) {
            times[0] += (values.len() / (1 + probe.kind.columns().len())) as u64;
            times[1] += probe.rate.times(start, end);
        }
    }

    /// A warning for each probe that sampled less often than requested.
    pub(super) fn warnings(&self, scene: &Scene) -> Vec<String> {
        let probes = self.times.iter().zip(&scene.probes);
        let short = probes.filter(|([looked, asked], _)| *looked > 0 && looked < asked);
        short
            .map(|([looked, asked], probe)| {
                format!(
                    "probe {} was sampled {looked} of the {asked} times that its rate_hz asks for: \
                     it samples at the ends of substeps",
                    probe.name
                )
            })
            .collect()
    }
}

/// Records the values of probes during a frame.
pub(super) struct Recorder<'a> {
    scene: &'a Scene,
    /// State of the absorbing walls in the frame.
    walls: AbsorberStates,
    /// Time at the end of the frame, seconds.
    end: f64,
    values: ProbeValues,
    /// For each force that is due, the probe's index and the surface as requested.
    surfaces: Vec<(usize, Vec<Patch>)>,
}

impl<'a> Recorder<'a> {
    /// A recorder for the frame that ends at `end` seconds.
    pub(super) fn new(scene: &'a Scene, walls: AbsorberStates, end: f64) -> Self {
        Self {
            scene,
            walls,
            end,
            values: vec![Vec::new(); scene.probes.len()],
            surfaces: Vec::new(),
        }
    }

    /// By probe, each sample's time and values; empty for probes that sample at frames.
    pub(super) fn into_values(self) -> ProbeValues {
        self.values
    }

    /// Probes that sample at the end of this substep, with their indices.
    fn due(&self, substep: Span) -> impl Iterator<Item = (usize, &'a Probe)> + use<'a> {
        let probes = self.scene.probes.iter().enumerate();
        probes.filter(move |(_, probe)| is_due(probe, substep))
    }

    fn take(&mut self, probe: usize, time: f64, found: impl IntoIterator<Item = Option<f64>>) {
        if self.scene.probes[probe].rate != Rate::Frame {
            self.values[probe].push(Some(time));
        }
        self.values[probe].extend(found);
    }
}

fn is_due(probe: &Probe, substep: Span) -> bool {
    match probe.rate {
        Rate::Frame => substep.is_last && is_recorded(probe),
        rate => rate.is_due(substep.start, substep.end),
    }
}

impl Watch for Recorder<'_> {
    fn wants(&mut self, substep: Span) -> Requested {
        let mut wanted = Requested::default();
        self.surfaces.clear();
        for (index, probe) in self.due(substep) {
            match probe.kind {
                ProbeKind::Pressure { .. } => wanted.pressures = true,
                ProbeKind::Force { on, .. } => {
                    // At the substep's start, as the cells were cut for which the pressure holds.
                    let patches = self.scene.patches(on, &self.walls, substep.start);
                    wanted.patches.extend_from_slice(&patches);
                    self.surfaces.push((index, patches));
                }
                _ => wanted.particles = true,
            }
        }
        wanted
    }

    fn look(&mut self, substep: Span, seen: Observed) {
        let is_force = |probe: &Probe| matches!(probe.kind, ProbeKind::Force { .. });
        let is_seen = |probe: &Probe| is_due(probe, substep) && !is_force(probe);
        let found = of_state(self.scene, &seen.particles, &seen.pressures, is_seen);
        // The frame's own time: the substeps' sum differs by round-off.
        let time = if substep.is_last {
            self.end
        } else {
            substep.end
        };
        for (probe, found) in found.into_iter().enumerate() {
            if !found.is_empty() {
                self.take(probe, time, found);
            }
        }
        let mut pressures = &seen.patches[..];
        for (probe, patches) in std::mem::take(&mut self.surfaces) {
            let ProbeKind::Force { about, .. } = self.scene.probes[probe].kind else {
                continue;
            };
            let (own, rest) = pressures.split_at(patches.len());
            pressures = rest;
            let sums = load(&patches, own, about);
            self.take(
                probe,
                time,
                sums.into_iter().flat_map(|sum| sum.to_array().map(Some)),
            );
        }
    }
}

/// Values of a state by probe, for the probes that are due; empty for the others.
fn of_state(
    scene: &Scene,
    particles: &Particles,
    pressures: &[Option<f64>],
    is_due: impl Fn(&Probe) -> bool,
) -> ProbeValues {
    let spacing = scene.particle_spacing();
    let water = match scene.probes.is_empty() {
        true => Cow::Borrowed(particles),
        false => particles.water(),
    };
    let particles = &*water;
    let mut pressures = pressures.iter().copied();
    let probes = scene.probes.iter();
    probes
        .map(|probe| match probe.kind {
            // The points cover all pressure probes, due or not.
            ProbeKind::Pressure { .. } => {
                let pressure = pressures.next().flatten();
                Vec::from_iter(is_due(probe).then_some(pressure))
            }
            _ if !is_due(probe) => Vec::new(),
            ProbeKind::Elevation { at } => {
                let height = elevation(particles, spacing, &scene.domain, at);
                vec![height.map(|y| scene.origin.y + y)]
            }
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
                vec![place.map(|place| within(scene, towards.axis, place))]
            }
            ProbeKind::RunUp { quantile } => {
                let height = run_up(particles, spacing, quantile);
                vec![height.map(|y| within(scene, 1, y))]
            }
            ProbeKind::Flux { towards, at } => {
                let rate = flux(particles, spacing, towards.axis, at);
                vec![Some(if towards.is_max { rate } else { -rate })]
            }
            // No substep has run; like pressures at the start.
            ProbeKind::Force { .. } => vec![None; probe.kind.columns().len()],
        })
        .collect()
}

/// World coordinate of the end of the water: half a spacing beyond its last particle, clamped to
/// the domain's walls.
fn within(scene: &Scene, axis: usize, place: f64) -> f64 {
    let (min, max) = (scene.domain.min[axis], scene.domain.max[axis]);
    scene.origin[axis] + place.clamp(min, max)
}

/// Chart of the values of the probe at `index` over time, one line per column.
pub(super) fn chart(
    shot: &str,
    record: &ProbeRecord,
    index: usize,
    entries: &[LedgerEntry],
) -> Chart {
    let columns = || record.columns.iter().map(|column| column.rsplit_once('_'));
    let looks = |entry: &'_ LedgerEntry| {
        let looks = record.looks(entry.row(PROBES, index), entry.clock.time);
        looks
            .map(|look| (look.time, look.values.to_vec()))
            .collect::<Vec<_>>()
    };
    let looks: Vec<_> = entries.iter().flat_map(looks).collect();
    let series = columns().enumerate().map(|(column, parts)| {
        let points = looks.iter().map(|(time, values)| (*time, values[column]));
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
