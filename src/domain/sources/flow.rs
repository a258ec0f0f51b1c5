//! Inflow of an emitter without a level: a lattice that moves through its volume.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::{
    super::bounds::Bounds, Emitter, ON_FACE, PredictedInflow, Shape, Solids, Sources, flow,
    particles_along, swept,
};

/// Samples per spacing of a position's path through the volume.
const LOOKS: f64 = 8.0;

/// Distance to a solid below which a position counts as inside, in spacings: an allowance for the
/// 32-bit rounding of coordinates and distances up to some hundred metres. A position that enters a
/// volume in the plane of a solid's face is on that face.
const TOUCHING: f64 = 1e-3;

/// Layers of an oblique flow whose covered fraction is counted.
const COUNTED: f64 = 16.0;

/// Layers of an oblique flow whose particles are counted: a layer more or less at either end is
/// below 1 %.
const LONG: f64 = 256.0;

/// An emitter's lattice, and what it moves through.
pub(super) struct Flow<'a> {
    sources: &'a Sources,
    emitter: &'a Emitter<Shape>,
    solids: Solids<'a>,
    lines: [LatticeAxis; 3],
}

/// Particles that enter at a frame's end.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Brought {
    /// Positions of the new particles.
    pub(super) born: Vec<DVec3>,
    /// Number of particles that left the volume during the frame without an open position in it.
    pub(super) blocked: u64,
}

/// Time span in which a lattice position is in the emitter's box, seconds: after the first and
/// before the second.
type Passage = (f64, f64);

/// Fate of a lattice position in a time span.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fate {
    /// It enters at this time, seconds.
    Born(f64),
    /// It leaves the volume without entering.
    Blocked,
}

impl<'a> Flow<'a> {
    pub(super) fn of(
        sources: &'a Sources,
        emitter: &'a Emitter<Shape>,
        solids: &Solids<'a>,
    ) -> Self {
        let (bounds, velocity) = (&emitter.shape.bounds, emitter.velocity);
        Self {
            sources,
            emitter,
            solids: *solids,
            lines: [0, 1, 2]
                .map(|axis| LatticeAxis::of(bounds, axis, velocity[axis], sources.spacing)),
        }
    }

    /// Particles that enter at the end of a frame.
    pub(super) fn brings(&self, frame: u32) -> Brought {
        let sources = self.sources;
        let (begin, end) = (sources.time(frame.saturating_sub(1)), sources.time(frame));
        let window = self.emitter.window;
        if end <= window.from || window.is_over(begin) {
            return Brought::default();
        }
        let fates: Vec<_> = self
            .cells(begin, end)
            .filter_map(|cell| Some((cell, self.fate(cell, begin, end)?)))
            .map(|(cell, fate)| match fate {
                Fate::Born(birth) => self.entrance(cell, birth, frame),
                Fate::Blocked => None,
            })
            .collect();
        let blocked = fates.iter().filter(|place| place.is_none()).count() as u64;
        Brought {
            born: fates.into_iter().flatten().collect(),
            blocked,
        }
    }

    /// Predicts the inflow with solids at rest.
    pub(super) fn promise(&self) -> PredictedInflow {
        let layers = if self.is_aligned() { 1.0 } else { COUNTED };
        let end = self.duration(layers);
        let entering: Vec<_> = self
            .cells(0.0, end)
            .filter_map(|cell| {
                let passage = self.passage(cell)?;
                (0.0 < passage.0 && passage.0 <= end).then(|| self.looked(cell, passage))
            })
            .collect();
        let count = |is: fn(&Looked) -> bool| entering.iter().filter(|it| is(it)).count() as f64;
        let open = count(|it| it.is_open);
        // Flows so slow that times become indistinguishable are not counted.
        let part = |of: f64| if of > 0.0 { open / of } else { 1.0 };
        let bounds = &self.emitter.shape.bounds;
        let is_box = self.emitter.shape.mesh.is_none();
        PredictedInflow {
            rate: self.rate() * part(entering.len() as f64),
            asked: is_box.then(|| swept(bounds.size(), self.emitter.velocity)),
            open: part(entering.len() as f64),
            covered: 1.0 - part(count(|it| it.is_inside)),
        }
    }

    /// Positions that come into the box after `begin` and not after `end`, seconds, whatever the
    /// emitter's window.
    pub(super) fn entering(&self, begin: f64, end: f64) -> u64 {
        let [x, y, z] = &self.lines;
        let clip = |(a, b): Passage, of: Option<Passage>| {
            of.map_or((a, b), |(from, to)| (a.max(from), b.min(to)))
        };
        let enters = |&(enter, _): &Passage| begin < enter && enter <= end;
        // Each while its other coordinates are within the box.
        let in_row = |j: i64, k: i64, span: Passage| {
            let (from, to) = clip(span, y.passage(j));
            if from > to {
                return 0;
            }
            let cells = x.cells_within(from, to).map(|i| self.passage([i, j, k]));
            cells.flatten().filter(enters).count() as u64
        };
        let in_layer = |k: i64| {
            let span = clip((begin, end), z.passage(k));
            if span.0 > span.1 {
                return 0;
            }
            let rows = y.cells_within(span.0, span.1);
            rows.map(|j| in_row(j, k, span)).sum::<u64>()
        };
        let layers = z.cells_within(begin, end);
        layers.into_par_iter().map(in_layer).sum()
    }

    /// Flow rate of the lattice without solids, m³/s. Across a flow along an axis it has whole rows
    /// of particles; the rows of an oblique flow, too, are whole where they line up with it.
    fn rate(&self) -> f64 {
        let velocity = self.emitter.velocity;
        let exact = flow(
            self.emitter.shape.bounds.size(),
            velocity,
            self.sources.spacing,
        );
        let seconds = self.duration(LONG);
        let speeds = velocity.abs().to_array().into_iter();
        let slowest = speeds.filter(|v| *v > 0.0).fold(f64::INFINITY, f64::min);
        // Rows that drift by few spacings meanwhile show only some of their phases.
        let drifts = slowest * seconds > COUNTED * self.sources.spacing;
        if self.is_aligned() || seconds == f64::MAX || !drifts {
            return exact;
        }
        let counted = self.entering(0.0, seconds) as f64 * self.sources.spacing.powi(3) / seconds;
        // Within the layers that the two ends cut.
        if (counted / exact - 1.0).abs() < 2.0 / LONG {
            exact
        } else {
            counted
        }
    }

    /// Whether the water moves along an axis.
    fn is_aligned(&self) -> bool {
        let speeds = self.emitter.velocity.to_array();
        speeds.into_iter().filter(|speed| *speed != 0.0).count() == 1
    }

    /// Returns the time in which this number of layers enters, seconds.
    fn duration(&self, layers: f64) -> f64 {
        (layers * self.sources.spacing / self.speed()).min(f64::MAX)
    }

    /// Samples a position's path: whether it is inside the volume, and outside of solids there.
    fn looked(&self, cell: [i64; 3], passage: Passage) -> Looked {
        let mut looked = Looked::default();
        for time in self.looks(passage) {
            looked.is_inside |= self.is_inside(cell, time);
            if self.is_open(cell, time) {
                looked.is_open = true;
                break;
            }
        }
        looked
    }

    /// Lattice positions that may be in the volume at some time of a span, x fastest.
    fn cells(&self, begin: f64, end: f64) -> impl ParallelIterator<Item = [i64; 3]> {
        let [x, y, z] = [0, 1, 2].map(|axis: usize| self.lines[axis].cells_within(begin, end));
        let rows: Vec<_> = z.flat_map(|k| y.clone().map(move |j| (j, k))).collect();
        let row = move |(j, k)| x.clone().map(move |i| [i, j, k]);
        rows.into_par_iter().flat_map_iter(row)
    }

    fn at(&self, cell: [i64; 3], time: f64) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|axis| self.lines[axis].at(cell[axis], time)))
    }

    fn passage(&self, cell: [i64; 3]) -> Option<Passage> {
        let along = [0, 1, 2].map(|axis| self.lines[axis].passage(cell[axis]));
        let all = along.into_iter().flatten();
        let (enter, leave) = all.reduce(|a, b| (a.0.max(b.0), a.1.min(b.1)))?;
        (enter < leave).then_some((enter, leave))
    }

    /// Fate of a position later than `begin` and not later than `end`. The time at which it enters
    /// depends only on the position and the scene, so that frames of any length find the same.
    fn fate(&self, cell: [i64; 3], begin: f64, end: f64) -> Option<Fate> {
        let window = self.emitter.window;
        let (enter, leave) = self.passage(cell)?;
        // Water inside the volume when the emitter begins does not enter.
        if enter <= window.from.max(0.0) || enter > end || window.is_over(enter) {
            return None;
        }
        if self.solids.is_empty() && self.emitter.shape.mesh.is_none() {
            return (enter > begin).then_some(Fate::Born(enter));
        }
        let last = window.until.map_or(leave, |until| until.min(leave));
        if last <= begin {
            return None;
        }
        // Most positions entered long ago: the newest sample before the span shows it.
        if self
            .newest_look(enter, begin)
            .is_some_and(|time| self.is_open(cell, time))
        {
            return None;
        }
        let mut was_inside = false;
        let looks = self.looks((enter, leave));
        for time in looks.take_while(|time| *time <= end && *time <= last) {
            if self.is_open(cell, time) {
                return (time > begin).then_some(Fate::Born(time));
            }
            was_inside |= self.is_inside(cell, time);
        }
        (last <= end && was_inside).then_some(Fate::Blocked)
    }

    /// Times at which a position's path through the box is sampled.
    fn looks(&self, (enter, leave): Passage) -> impl Iterator<Item = f64> {
        let step = self.step();
        (0..)
            .map(move |k| enter + f64::from(k) * step)
            .take_while(move |time| *time < leave)
    }

    /// Newest of these times that is not later than `time`; `None` if all are later.
    fn newest_look(&self, enter: f64, time: f64) -> Option<f64> {
        let step = self.step();
        let look = |k: u32| enter + f64::from(k) * step;
        let near = ((time - enter) / step).ceil().max(0.0) as u32;
        // Corrects for the rounding of the quotient.
        let near = [near + 1, near, near.saturating_sub(1)].map(look);
        near.into_iter().find(|look| *look <= time)
    }

    /// Time between samples, seconds.
    fn step(&self) -> f64 {
        self.duration(1.0 / LOOKS)
    }

    /// Speed, m/s, scaled so that the squares of tiny velocities do not underflow.
    fn speed(&self) -> f64 {
        let velocity = self.emitter.velocity;
        let most = velocity.abs().max_element();
        most * (velocity / most).length()
    }

    /// Whether a position in the box is in the volume.
    fn is_inside(&self, cell: [i64; 3], time: f64) -> bool {
        self.emitter.shape.is_in_mesh(self.at(cell, time))
    }

    /// Whether it is in the volume and outside of the solids in their poses at the end of the
    /// frame, when the particle would meet them.
    fn is_open(&self, cell: [i64; 3], time: f64) -> bool {
        let p = self.at(cell, time);
        let seconds = self.sources.time(self.sources.frame_of(time));
        let least = TOUCHING * self.sources.spacing;
        self.emitter.shape.is_in_mesh(p) && self.solids.distance(p, seconds) > least
    }

    /// Position at the end of its frame of a particle that came in at `birth`. If its path meets a
    /// solid or an end of the domain, the frame's water is spread over the open part of the path.
    fn entrance(&self, cell: [i64; 3], birth: f64, frame: u32) -> Option<DVec3> {
        let sources = self.sources;
        let (begin, end) = (sources.time(frame.saturating_sub(1)), sources.time(frame));
        let settled = |time: f64| sources.settled(self.at(cell, time), frame, &self.solids);
        if let Some(place) = settled(end) {
            return Some(place);
        }
        let looks = (0..).map(|k| birth + f64::from(k) * self.step());
        let is_clear = |time: f64| settled(time).is_some();
        let open = looks.take_while(|time| *time <= end && is_clear(*time));
        let last = open.last().unwrap_or(birth);
        let part = (end - birth) / (end - begin);
        settled(birth + part * (last - birth)).or_else(|| settled(birth))
    }
}

/// Result of sampling a position's path.
#[derive(Clone, Copy, Debug, Default)]
struct Looked {
    is_inside: bool,
    is_open: bool,
}

/// One axis of a lattice that moves through a box.
struct LatticeAxis {
    min: f64,
    max: f64,
    /// Coordinate of position 0 at the start, metres.
    first: f64,
    spacing: f64,
    /// Velocity along the axis, m/s.
    speed: f64,
    /// Number of positions along an axis without motion; `None` along others.
    places: Option<usize>,
}

impl LatticeAxis {
    fn of(bounds: &Bounds, axis: usize, speed: f64, spacing: f64) -> Self {
        let (min, max) = (bounds.min[axis], bounds.max[axis]);
        let places = (speed == 0.0).then(|| particles_along(max - min, spacing));
        // Across the flow, positions are centred.
        let first = match places {
            Some(n) => 0.5 * (min + max) - 0.5 * spacing * (n as f64 - 1.0),
            None => min + 0.5 * spacing,
        };
        Self {
            min,
            max,
            first,
            spacing,
            speed,
            places,
        }
    }

    fn at(&self, cell: i64, time: f64) -> f64 {
        self.first + self.spacing * cell as f64 + self.speed * time
    }

    /// Time span in which a position is in the box along this axis; `None`, which means always,
    /// without motion. A position on a face of the volume counts as on its least face, however
    /// it rounds.
    fn passage(&self, cell: i64) -> Option<Passage> {
        if self.places.is_some() {
            return None;
        }
        let from = self.at(cell, 0.0) + ON_FACE * self.spacing;
        let [a, b] = [self.min, self.max].map(|face| (face - from) / self.speed);
        Some((a.min(b), a.max(b)))
    }

    /// Those that may be inside at some time of a span.
    fn cells_within(&self, begin: f64, end: f64) -> Range<i64> {
        let (a, b) = (self.cells(begin), self.cells(end));
        a.start.min(b.start)..a.end.max(b.end)
    }

    /// Those that may be inside.
    fn cells(&self, time: f64) -> Range<i64> {
        match self.places {
            Some(n) => 0..n as i64,
            None => {
                let cell = |x: f64| (x - self.first - self.speed * time) / self.spacing;
                cell(self.min).floor() as i64..cell(self.max).ceil() as i64 + 1
            }
        }
    }
}
