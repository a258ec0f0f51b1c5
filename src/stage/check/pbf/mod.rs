//! PBF's passes against their f64 twins, each from the inputs that the GPU had.

mod bounds;
mod effects;
mod fields;
mod lists;
mod stop;
mod whole;
mod work;

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    compare::{check::Table, rounding::U},
    domain::{boundary::Boundary, particles::Particles, solver::Solver, substep::Which},
    gpu::{adapter::Context, recording::Moment},
    reference::{
        neighbors::Neighbors,
        pbf::{
            Colour, Model, Substep,
            passes::{self, Inputs, Momentum},
        },
    },
    scene::{Iteration, Scene, Stop},
    solve::{
        SolveError,
        params::{Counters, IterationControl, Phase},
        pbf::Pbf,
        plan::Plan,
        trace::{Span, TraceFrame, Traced},
    },
};

use super::{
    Checked, pair, pair_of,
    sort::{SortCheck, check_slots},
    wide,
};
use bounds::Bounds;
use fields::*;
use lists::Lists;
use whole::Whole;

/// What the passes read: buffers of `vec4f` and of `u32`.
const READS: [(&str, &[&str], &[&str]); 10] = [
    ("pbf/predict", &["position", "velocity"], &[]),
    ("pbf/assign_cells", &["predicted"], &[]),
    ("pbf/reorder", &["predicted", "velocity"], &["order", "id"]),
    ("pbf/build_neighbors", &["predicted"], &[]),
    ("pbf/compute_lambda", &["predicted"], &[]),
    ("pbf/compute_delta", &["predicted"], &[]),
    (
        "pbf/update_velocity",
        &["predicted", "start_position", "sorted_velocity"],
        &["sorted_id"],
    ),
    ("pbf/measure_density", &["predicted"], &[]),
    ("effects", &["position", "velocity"], &[]),
    ("pbf/decide", &[], &[]),
];

/// Traces a substep of the frame after `particles`, the state at the end of `frame`, and holds it against the reference.
/// `boundary` is what the reference knows of the solids, `uploaded` what the device does: they differ in tests alone.
///
/// # Errors
/// The device, the numbers of the solver, or a substep that the frame does not have.
pub fn check(
    context: &Context,
    scene: &Scene,
    plan: Plan,
    [boundary, uploaded]: [&Boundary; 2],
    (frame, particles): (u32, &Particles),
    which: Which,
) -> Result<Checked, SolveError> {
    let mut solver = Pbf::new(context, scene, plan.clone(), uploaded, false)?;
    solver.load(frame, particles)?;
    let substeps = scene.pbf_substeps(frame, particles.max_speed())?;
    let length = scene.shot.frame_seconds();
    let time_step = length / f64::from(substeps);
    let number = match which {
        Which::Number(number) => number,
        Which::Last => substeps,
    };
    let end = f64::from(frame) * length + f64::from(number) * time_step;
    let substep = Substep::new(scene, end, time_step);
    let mut checker = Checker::new(scene, plan, boundary, substep);
    checker.take_samples(&solver)?;
    let span = Span::Only(which);
    let traced = solver.trace_frame(span, &mut |_, traced| checker.observe(traced))?;
    Ok(Checked {
        table: checker.finish(boundary)?,
        substep: Some(traced),
    })
}

struct Checker<'a> {
    scene: &'a Scene,
    model: Model,
    substep: Substep,
    plan: Plan,
    table: Table,
    sort: SortCheck,
    lists: Lists,
    whole: Whole,
    ran: Vec<&'static str>,
    vectors: BTreeMap<&'static str, Vec<[f32; 4]>>,
    words: BTreeMap<&'static str, Vec<u32>>,
    floats: Vec<f32>,
    /// What a pass adds to.
    work: Vec<f32>,
    counters: Counters,
    /// Of an iteration until a density error.
    control: IterationControl,
}

impl<'a> Checker<'a> {
    fn new(scene: &'a Scene, plan: Plan, boundary: &Boundary, substep: Substep) -> Self {
        Self {
            model: Model::new(scene, boundary),
            lists: Lists::new(&plan),
            scene,
            substep,
            plan,
            table: Table::default(),
            sort: SortCheck::default(),
            whole: Whole::default(),
            ran: Vec::new(),
            vectors: BTreeMap::new(),
            words: BTreeMap::new(),
            floats: Vec::new(),
            work: Vec::new(),
            counters: Counters::default(),
            control: IterationControl::default(),
        }
    }

    fn inputs<'b>(&'b self, points: &'b [DVec3], neighbors: &'b Neighbors) -> Inputs<'b> {
        Inputs {
            model: &self.model,
            substep: &self.substep,
            points,
            neighbors,
        }
    }

    fn n(&self) -> usize {
        self.plan.counts.particles
    }

    /// Samples on solids as the device has them are inputs of its passes; here they are outputs of the upload.
    fn take_samples(&mut self, solver: &Pbf) -> Result<(), SolveError> {
        let (n, samples) = (self.n(), self.plan.counts.boundary_samples);
        let all = solver.field::<[f32; 4]>("predicted", 2 * n + samples)?;
        if samples == 0 {
            return Ok(());
        }
        let model = &mut self.model;
        let (mut places, mut weights) = (Vec::new(), Vec::new());
        for (index, value) in all[2 * n..].iter().enumerate() {
            let (x, weight) = (wide(value), f64::from(value[3]));
            let (at, expected) = (model.samples[index], model.sample_weights[index]);
            places.push(pair(index, x, at, U * at.length()));
            weights.push(pair_of(index, weight, expected, U * expected));
            model.samples[index] = x;
            model.sample_weights[index] = weight;
        }
        self.table.add(&SAMPLES, &places, 0);
        self.table.add(&WEIGHTS, &weights, 0);
        Ok(())
    }

    fn observe(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let n = self.n();
        if traced.moment == Moment::Before && !self.ran.contains(&traced.pass) {
            self.ran.push(traced.pass);
        }
        if self.sort.observe(traced, n, &mut self.table)? {
            return Ok(());
        }
        match traced.moment {
            Moment::Before => self.read_inputs(traced),
            Moment::After => self.compare(traced),
        }
    }

    fn read_inputs(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let n = self.n();
        if self.scene.has_movers() {
            self.read_work(traced)?;
        }
        if traced.writes("counters") {
            self.counters = traced.counters()?;
        }
        // A frame's measurement begins with a prediction of no length.
        if traced.pass == "pbf/predict" && self.ran.contains(&"pbf/update_velocity") {
            self.substep.time_step = 0.0;
            self.substep.wall_velocity = Default::default();
        }
        let pass = match traced.pass.split_once('/') {
            Some((room @ "effects", _)) => room,
            _ => traced.pass,
        };
        let found = READS.iter().find(|row| row.0 == pass);
        let Some((_, vectors, words)) = found else {
            self.floats = match traced.pass {
                "pbf/sum_error" => traced.read("density", n)?,
                _ => Vec::new(),
            };
            return Ok(());
        };
        let samples = self.plan.counts.boundary_samples;
        for &name in *vectors {
            let count = if name == "predicted" {
                2 * n + samples
            } else {
                n
            };
            self.vectors.insert(name, traced.read(name, count)?);
        }
        for &name in *words {
            self.words.insert(name, traced.read(name, n)?);
        }
        if self.is_adaptive() {
            self.control = traced.iteration_control()?;
            if traced.pass == "pbf/decide" {
                self.floats = traced.read("error_sums", n.div_ceil(256))?;
            }
        }
        Ok(())
    }

    fn is_adaptive(&self) -> bool {
        matches!(self.scene.solver.pbf().stop, Stop::DensityError { .. })
    }

    /// Whether an iteration that has ended empties the dispatch.
    fn is_idle(&self) -> bool {
        self.is_adaptive() && self.control.is_done == 1
    }

    fn compare(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        match traced.pass {
            "pbf/predict" => self.predict(traced),
            "pbf/assign_cells" => self.assign_cells(traced),
            "pbf/reorder" => self.reorder(traced),
            "pbf/build_neighbors" => self.build_neighbors(traced),
            "pbf/compute_lambda" if !self.is_idle() => self.compute_lambda(traced),
            "pbf/compute_delta" if !self.is_idle() => self.compute_delta(traced),
            "pbf/sum_error" => self.sum_error(traced),
            "pbf/decide" => self.decide(traced),
            "pbf/update_velocity" => self.update_velocity(traced),
            "pbf/measure_density" => self.measure_density(traced),
            "pbf/boundary_work" => self.boundary_work(traced),
            _ => effects::compare(self, traced),
        }
    }

    /// Adds the whole solve, and which passes have no twin.
    fn finish(mut self, boundary: &Boundary) -> Result<Table, SolveError> {
        self.add_whole(boundary);
        for pass in std::mem::take(&mut self.ran) {
            if !self.table.has(pass) {
                self.table.unchecked.push((pass, "no f64 twin"));
            }
        }
        Ok(self.table)
    }

    fn wide(&self, name: &str) -> Vec<DVec3> {
        self.vectors[name].iter().map(wide).collect()
    }

    /// The positions that a phase reads, then the samples; and the λ beside them.
    fn stored(&self, phase: &Phase) -> (Vec<DVec3>, Vec<f64>) {
        let n = self.n();
        let predicted = &self.vectors["predicted"];
        let half = |j: usize| {
            let half = [phase.read_even, phase.read_odd][j % 2];
            &predicted[j + half as usize]
        };
        let mut points: Vec<DVec3> = (0..n).map(|j| wide(half(j))).collect();
        points.extend(&self.model.samples);
        (points, (0..n).map(|j| f64::from(half(j)[3])).collect())
    }

    fn predict(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let n = self.n();
        let predicted = traced.read::<[f32; 4]>("predicted", 2 * n)?;
        let velocity = traced.read::<[f32; 4]>("velocity", n)?;
        let none = Neighbors::listed(0, |_, _| [0; 2]);
        let bounds = Bounds(self.inputs(&[], &none));
        let step = self.substep.time_step;
        let (position, before) = (&self.vectors["position"], &self.vectors["velocity"]);
        let all: Vec<_> = (0..n)
            .into_par_iter()
            .map(|i| {
                let (x, v) = (wide(&position[i]), wide(&before[i]));
                let pushed = v + self.model.gravity * step;
                let slowed = step * pushed.length() > 0.99 * self.model.max_displacement();
                let speed = v.length() + self.model.gravity.length() * step;
                let mut v_error = U * (3.0 + if slowed { 16.0 } else { 0.0 }) * speed;
                let error = U * (x.length() + 4.0 * step * speed) + step * v_error;
                let cap =
                    (self.model.max_displacement() / (step * pushed.length()).max(1e-30)).min(1.0);
                let confined = bounds.confine(x + step * cap * pushed, error);
                if confined.is_touched && step > 0.0 {
                    v_error += (error + confined.error + U * x.length()) / step;
                }
                let (at, then) = passes::predict(&self.model, &self.substep, x, v);
                let v_tolerance = v_error + 4.0 * U * then.length();
                let pairs = (
                    pair(i, wide(&predicted[n + i]), at, confined.error),
                    pair(i, wide(&velocity[i]), then, v_tolerance),
                );
                (pairs, confined.push_error)
            })
            .collect();
        let (pairs, push_errors): (Vec<_>, Vec<f64>) = all.into_iter().unzip();
        let (positions, velocities): (Vec<_>, Vec<_>) = pairs.into_iter().unzip();
        self.table.add(&PREDICT_POSITION, &positions, 0);
        self.table.add(&PREDICT_VELOCITY, &velocities, 0);
        if self.scene.has_movers() {
            self.predict_work(traced, &push_errors)?;
        }
        Ok(())
    }

    fn assign_cells(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let n = self.n();
        let cell_of = traced.read::<u32>("cell_of", n)?;
        let slot = traced.read::<u32>("slot_in_cell", n)?;
        let cells = &self.model.cells;
        let start = traced.read::<u32>("cell_start", cells.dims.iter().product())?;
        let mut ties = 0;
        let mut pairs = Vec::with_capacity(n);
        for (i, value) in self.vectors["predicted"][n..2 * n].iter().enumerate() {
            let x = wide(value);
            let own = cells.index(x);
            let place = x / cells.edge;
            let near_face = (place - place.round()).abs().cmplt(4.0 * U * place.abs());
            if near_face.any() && cell_of[i] as usize != own {
                ties += 1;
            } else {
                pairs.push(pair_of(i, f64::from(cell_of[i]), own as f64, 0.0));
            }
        }
        self.table.add(&CELL, &pairs, ties);
        check_slots([&COUNTS, &SLOTS], &cell_of, &slot, &start, &mut self.table);
        Ok(())
    }

    fn reorder(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let n = self.n();
        let order = &self.words["order"];
        let copies = |values: &[[f32; 4]], from: &[[f32; 4]], first: usize| {
            let copy = |i: usize| {
                let source = wide(&from[first + order[i] as usize]);
                pair(i, wide(&values[i]), source, 0.0)
            };
            (0..n).map(copy).collect::<Vec<_>>()
        };
        let (predicted, velocity) = (&self.vectors["predicted"], &self.vectors["velocity"]);
        for name in ["predicted", "start_position"] {
            let values = traced.read::<[f32; 4]>(name, n)?;
            self.table
                .add(&REORDER_POSITION, &copies(&values, predicted, n), 0);
        }
        let values = traced.read::<[f32; 4]>("sorted_velocity", n)?;
        self.table
            .add(&REORDER_VELOCITY, &copies(&values, velocity, 0), 0);
        let ids = &self.words["id"];
        let expected: Vec<u32> = order.iter().map(|&k| ids[k as usize]).collect();
        self.table
            .add_exact(&REORDER_ID, &traced.read("sorted_id", n)?, &expected);
        Ok(())
    }

    fn compute_lambda(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let n = self.n();
        let phase = traced.uniform::<Phase>("phase")?;
        let (points, before) = self.stored(&phase);
        let neighbors = self.visited(traced, &points)?;
        if !self.whole.has_start() {
            let near = self.search(&points);
            self.whole.start(&points, n, near);
        }
        let after = traced.read::<[f32; 4]>("predicted", 2 * n)?;
        let density = match self.is_adaptive() {
            true => Some(traced.read::<f32>("density", n)?),
            false => None,
        };
        let inputs = self.inputs(&points, &neighbors);
        let (mut twin, mut dense) = (before, vec![0.0; n]);
        passes::compute_lambda(inputs, Colour::All, &mut twin, &mut dense);
        let bounds = Bounds(inputs);
        let all: Vec<_> = handled(&phase)
            .into_par_iter()
            .map(|i| {
                let row = passes::row(inputs, i);
                let stored = i + [phase.read_even, phase.read_odd][i % 2] as usize;
                let value = f64::from(after[stored][3]);
                let of_density = density.as_ref().map(|density| {
                    let value = f64::from(density[i]);
                    pair_of(i, value, dense[i], bounds.density(i, dense[i]))
                });
                let tolerance = bounds.lambda(i, &row, twin[i]);
                (pair_of(i, value, twin[i], tolerance), of_density)
            })
            .collect();
        let (lambdas, densities): (Vec<_>, Vec<_>) = all.into_iter().unzip();
        self.table.add(&LAMBDA, &lambdas, 0);
        if density.is_some() {
            let densities: Vec<_> = densities.into_iter().flatten().collect();
            self.table.add(&DENSITY_OF_LAMBDA, &densities, 0);
        }
        Ok(())
    }

    fn compute_delta(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let n = self.n();
        let phase = traced.uniform::<Phase>("phase")?;
        let (points, lambda) = self.stored(&phase);
        let neighbors = self.visited(traced, &points)?;
        let write = phase.write as usize;
        let before: Vec<DVec3> = self.vectors["predicted"][write..write + n]
            .iter()
            .map(wide)
            .collect();
        let factor = f64::from(phase.acceleration);
        let momentum =
            (self.scene.solver.pbf().iteration == Iteration::Chebyshev).then_some(Momentum {
                factor,
                before: &before,
            });
        let inputs = self.inputs(&points, &neighbors);
        let plain = passes::compute_delta(inputs, Colour::All, None, &lambda);
        let twin = match momentum {
            Some(_) => passes::compute_delta(inputs, Colour::All, momentum, &lambda),
            None => plain.clone(),
        };
        let after = traced.read::<[f32; 4]>("predicted", 2 * n)?;
        let works = match self.scene.has_movers() {
            true => traced.read::<f32>("wall_work", n)?,
            false => Vec::new(),
        };
        let bounds = Bounds(inputs);
        let h = self.model.calibration.support_radius;
        let one = |i: usize| {
            let value = &after[write + i];
            let carried = pair_of(i, f64::from(value[3]), lambda[i], 0.0);
            // On one spot a hash decides where they part, by sines that WGSL leaves open.
            let is_coincident = (neighbors.all(i))
                .any(|j| points[i].distance_squared(points[j as usize]) < 2e-12 * h * h);
            // The bound follows the correction from before walls and solids push, as they bend what it errs by.
            let to = twin[i].free;
            let step = to - points[i];
            let mut error = bounds.delta(i, &lambda) + 16.0 * U * step.length();
            // A semi-iteration counts the walls' part of this step for that of the last one too.
            let work_error = (2.0 * factor - 1.0) * error;
            if momentum.is_some() {
                let last = points[i] - before[i];
                // Whether the semi-iteration goes on is decided before it adds to the step.
                let own = plain[i].free - points[i];
                let across = own.dot(last).abs() <= 2.0 * error * last.length();
                if is_coincident || (factor != 1.0 && across && last != DVec3::ZERO) {
                    return (None, carried);
                }
                error = factor * error + 4.0 * U * (factor - 1.0) * last.length();
            } else if is_coincident {
                return (None, carried);
            }
            let rounding = U * points[i].length();
            let confined = bounds.confine(to, error + rounding);
            let moved = pair(i, wide(value), twin[i].position, confined.error);
            let work_error = work_error + confined.push_error + rounding;
            let work =
                (works.get(i)).map(|&after| self.delta_work(i, after, twin[i].work, work_error));
            (Some((moved, work)), carried)
        };
        let all: Vec<_> = handled(&phase).into_par_iter().map(one).collect();
        let count = all.len();
        let (moved, carried): (Vec<_>, Vec<_>) = all.into_iter().unzip();
        let (moved, works): (Vec<_>, Vec<_>) = moved.into_iter().flatten().unzip();
        let ties = count - moved.len();
        self.table.add(&DELTA, &moved, ties);
        self.table.add(&CARRIED, &carried, 0);
        if self.scene.has_movers() {
            let works: Vec<_> = works.into_iter().flatten().collect();
            self.table.add(&DELTA_WORK, &works, ties);
        }
        Ok(())
    }

    fn update_velocity(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let n = self.n();
        let phase = traced.uniform::<Phase>("phase")?;
        let source = match self.is_adaptive() {
            true => n * (self.control.iterations % 2) as usize,
            false => phase.read_even as usize,
        };
        let ends: Vec<DVec3> = self.vectors["predicted"][source..source + n]
            .iter()
            .map(wide)
            .collect();
        let (starts, velocities) = (self.wide("start_position"), self.wide("sorted_velocity"));
        let position = traced.read::<[f32; 4]>("position", n)?;
        let velocity = traced.read::<[f32; 4]>("velocity", n)?;
        let (model, substep) = (&self.model, &self.substep);
        let cap = model.max_displacement();
        let (mut x_pairs, mut v_pairs) = (Vec::with_capacity(n), Vec::with_capacity(n));
        let (mut capped, mut near) = (0.0, 0.0);
        for i in 0..n {
            let (x, v, is_capped) =
                passes::update_velocity(model, substep, ends[i], starts[i], velocities[i]);
            let way = (ends[i] - starts[i]).length() / substep.time_step;
            let whole = velocities[i] + (ends[i] - starts[i]) / substep.time_step;
            let distance = whole.length() * substep.time_step;
            capped += f64::from(u8::from(is_capped));
            let is_near = (distance - cap).abs() <= 30.0 * U * cap;
            near += f64::from(u8::from(is_near));
            let mut v_error = U * (whole.length() + 4.0 * way);
            let mut x_error = 0.0;
            if is_capped || is_near {
                v_error += 20.0 * U * whole.length();
                x_error = U * x.length() + substep.time_step * v_error;
            }
            x_pairs.push(pair(i, wide(&position[i]), x, x_error));
            v_pairs.push(pair(i, wide(&velocity[i]), v, v_error));
        }
        self.whole.end(ends);
        self.table.add(&UPDATE_POSITION, &x_pairs, 0);
        self.table.add(&UPDATE_VELOCITY, &v_pairs, 0);
        let counted = f64::from(traced.counters()?.capped) - f64::from(self.counters.capped);
        self.table
            .add(&CAPPED, &[pair_of(0, counted, capped, near)], 0);
        let ids = &self.words["sorted_id"];
        self.table
            .add_exact(&UPDATE_ID, &traced.read("id", n)?, ids);
        Ok(())
    }

    fn measure_density(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let n = self.n();
        let mut points: Vec<DVec3> = self.vectors["predicted"][..n].iter().map(wide).collect();
        points.extend(&self.model.samples);
        let neighbors = self.search(&points);
        let inputs = self.inputs(&points, &neighbors);
        let twin = passes::measure_density(inputs);
        let density = traced.read::<f32>("density", n)?;
        let bounds = Bounds(inputs);
        let pairs: Vec<_> = (0..n)
            .into_par_iter()
            .map(|i| {
                let tolerance = bounds.density(i, twin[i]);
                pair_of(i, f64::from(density[i]), twin[i], tolerance)
            })
            .collect();
        self.table.add(&MEASURED, &pairs, 0);
        Ok(())
    }
}

/// Particles that a dispatch handles.
fn handled(phase: &Phase) -> Vec<usize> {
    let particle = |thread| phase.first + thread * phase.stride + phase.colour;
    (0..phase.count).map(|k| particle(k) as usize).collect()
}
