//! FLIP's passes against their f64 twins, each from the inputs that the GPU had.

mod cycle;
mod effects;
mod fields;
mod grid;
mod iteration;
mod particles;
mod pressure;

use glam::{DMat3, DVec3};

use crate::{
    compare::{check::Table, rounding::U},
    domain::{
        boundary::Boundary,
        bricks::{Bricks, CELLS},
        particles::Particles,
        poisson::FLUID,
        solver::Solver,
        substep::Which,
    },
    gpu::{adapter::Context, recording::Moment},
    reference::flip::{Cloud, Faces, Given, Model, Room, Sorted, Step, assign_cells, survey},
    scene::{Scene, flip::Transfer, step::Substep},
    solve::{
        SolveError,
        flip::Flip,
        params::FlipParams,
        plan::Plan,
        trace::{Begun, Span, TraceFrame, Traced},
    },
};

use super::{
    Checked, pair, pair_of,
    sort::{SortCheck, check_slots},
    wide,
};
use fields::*;

/// Passes without a row of their own, and where they are checked.
const EXCEPTIONS: [(&str, &str); 5] = [
    (
        "flip/find_not_finite",
        "it counts what is not finite, which is nothing here",
    ),
    ("flip/spread_faces", BOTH_HALVES),
    ("flip/spread_centers", BOTH_HALVES),
    ("pressure/label_cells", LABELLED),
    ("pressure/merge_labels", LABELLED),
];

const BOTH_HALVES: &str = "the twin of flip/gather_faces and flip/gather_centers does both halves";
const LABELLED: &str = "what they make is held against its twin after pressure/count_pockets";

/// Traces a substep of the frame after `particles`, the state at the end of `frame`, and holds it against the reference.
///
/// # Errors
/// The device, the numbers of the solver, or a substep that the frame does not have.
pub fn check(
    context: &Context,
    scene: &Scene,
    plan: Plan,
    boundary: &Boundary,
    (frame, particles): (u32, &Particles),
    which: Which,
) -> Result<Checked, SolveError> {
    let mut solver = Flip::new(context, scene, plan, boundary, false)?;
    solver.load(frame, particles)?;
    let mut checker = Checker {
        scene,
        boundary,
        model: Model::new(scene, boundary),
        n: particles.len(),
        frame,
        begun: Begun::default(),
        capped: 0,
        table: Table::default(),
        sort: SortCheck::default(),
        ran: Vec::new(),
        layout: None,
        sorted: None,
        room: None,
        faces: None,
        old: Vec::new(),
        products: 0,
        system: None,
        given: None,
        is_done: false,
        iteration: iteration::Iteration::default(),
    };
    let traced = solver.trace_frame(Span::Only(which), &mut |begun, traced| {
        checker.begun = begun;
        checker.observe(traced)
    })?;
    Ok(Checked {
        table: checker.finish(),
        substep: Some(traced),
    })
}

/// Where the elements of a substep lie.
struct Layout {
    substep: Substep,
    bricks: Bricks,
    /// Elements of the active bricks, slot 0 included.
    cells: usize,
    /// Between planes of the device's arrays.
    stride: usize,
}

struct Checker<'a> {
    scene: &'a Scene,
    boundary: &'a Boundary,
    model: Model,
    n: usize,
    frame: u32,
    begun: Begun,
    /// Particles that substeps before have slowed.
    capped: u32,
    table: Table,
    sort: SortCheck,
    ran: Vec<&'static str>,
    layout: Option<Layout>,
    sorted: Option<Sorted>,
    room: Option<Room>,
    faces: Option<Faces>,
    /// Velocities at faces before the projection.
    old: Vec<DVec3>,
    /// Runs of pressure/multiply that were compared.
    products: usize,
    system: Option<pressure::Built>,
    given: Option<Given>,
    /// Whether the solve had ended before the pass that runs now.
    is_done: bool,
    iteration: iteration::Iteration,
}

impl Checker<'_> {
    fn observe(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        if traced.moment == Moment::Before && !self.ran.contains(&traced.pass) {
            self.ran.push(traced.pass);
        }
        if self.sort.observe(traced, self.n, &mut self.table)? {
            return Ok(());
        }
        match (traced.moment, traced.pass) {
            (Moment::After, "flip/survey") => self.survey(traced),
            (Moment::After, "flip/assign_cells") => self.assign_cells(traced),
            (Moment::After, "flip/reorder") => self.reorder(traced),
            (Moment::After, "flip/cut_cells") => self.cut_cells(traced),
            (Moment::After, "flip/gather_faces") => self.gather_faces(traced),
            (Moment::After, "flip/gather_centers") => self.gather_centers(traced),
            (Moment::Before, "flip/find_change" | "flip/extrapolate") => {
                self.faces = Some(self.read_faces(traced)?);
                Ok(())
            }
            (Moment::After, "flip/find_change") => self.find_change(traced),
            (Moment::After, "flip/extrapolate") => self.extrapolate(traced),
            (Moment::After, "flip/grid_to_particle") => self.grid_to_particle(traced),
            (Moment::Before, "flip/advect") => {
                self.capped = traced.counters()?.capped;
                Ok(())
            }
            (Moment::After, "flip/advect") => self.advect(traced),
            (Moment::After, "flip/boundary_work") => self.boundary_work(traced),
            (_, pass) if pass.starts_with("pressure/") => self.pressure(traced),
            _ => effects::compare(self, traced),
        }
    }

    /// From the pressure and the flux that the device has.
    fn boundary_work(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let pressure = self.scalars(traced, "pressure")?;
        let flux = self.scalars(traced, "solid_flux")?;
        let kind = self.cells::<u32>(traced, "cell_kind")?;
        let wet = (CELLS * self.layout().bricks.wet) as usize;
        let sums = traced.read::<f32>("boundary_work", wet / 64)?;
        let term = |e: usize| match kind[e] {
            FLUID => -pressure[e] * flux[e],
            _ => 0.0,
        };
        let pairs: Vec<_> = (sums.iter().enumerate())
            .map(|(group, &sum)| {
                let first = CELLS as usize + 64 * group;
                let terms = (first..first + 64).map(term);
                let sizes: f64 = terms.clone().map(f64::abs).sum();
                pair_of(group, f64::from(sum), terms.sum(), 66.0 * U * sizes)
            })
            .collect();
        self.table.add(&WORK, &pairs, 0);
        Ok(())
    }

    fn finish(mut self) -> Table {
        for pass in std::mem::take(&mut self.ran) {
            if !self.table.has(pass) {
                let known = EXCEPTIONS.iter().find(|(name, _)| *name == pass);
                let why = known.map_or("no f64 twin", |(_, why)| why);
                self.table.unchecked.push((pass, why));
            }
        }
        self.table
    }

    fn layout(&self) -> &Layout {
        self.layout.as_ref().expect("after flip/survey")
    }

    fn sorted(&self) -> &Sorted {
        self.sorted.as_ref().expect("after flip/reorder")
    }

    fn room(&self) -> &Room {
        self.room.as_ref().expect("after flip/cut_cells")
    }

    fn step(&self) -> Step<'_> {
        self.model.step(&self.layout().substep)
    }

    /// u N: the rounding of a place in cells.
    fn place(&self) -> f64 {
        let cells = self.model.cells.into_iter().max().unwrap_or(1);
        U * f64::from(cells)
    }

    fn vectors(&self, traced: Traced<'_>, name: &str) -> Result<Vec<DVec3>, SolveError> {
        let values = traced.read::<[f32; 4]>(name, self.n)?;
        Ok(values.iter().map(wide).collect())
    }

    /// An array of cells, as far as the active bricks go.
    fn cells<T: bytemuck::Pod>(
        &self,
        traced: Traced<'_>,
        name: &str,
    ) -> Result<Vec<T>, SolveError> {
        traced.read(name, self.layout().cells)
    }

    fn scalars(&self, traced: Traced<'_>, name: &str) -> Result<Vec<f64>, SolveError> {
        let values = self.cells::<f32>(traced, name)?;
        Ok(values.into_iter().map(f64::from).collect())
    }

    /// Three planes as one vector a cell.
    fn planes(&self, traced: Traced<'_>, name: &str) -> Result<Vec<DVec3>, SolveError> {
        let Layout { cells, stride, .. } = *self.layout();
        let values = traced.read::<f32>(name, 2 * stride + cells)?;
        let at = |k: usize| f64::from(values[k]);
        Ok((0..cells)
            .map(|e| DVec3::new(at(e), at(stride + e), at(2 * stride + e)))
            .collect())
    }

    /// Elements of the active bricks.
    fn active(&self) -> std::ops::Range<usize> {
        CELLS as usize..self.layout().cells
    }

    fn survey(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let cloud = self.read_cloud(traced, ["position", "velocity", "id", "affine"])?;
        let twin = survey(&self.model, &cloud);
        let words = traced.read::<u32>("survey", 4 + twin.is_wet.len())?;
        let fastest = f64::from(f32::from_bits(words[0]));
        let exact = twin.speed * twin.speed;
        self.table
            .add(&SPEED, &[pair_of(0, fastest, exact, 5.0 * U * exact)], 0);
        let is_wet: Vec<u32> = twin.is_wet.iter().map(|&wet| u32::from(wet)).collect();
        self.table.add_exact(&WET, &words[4..], &is_wet);
        // What the device found is what its substep follows.
        let Begun { number, elapsed } = self.begun;
        let length = self.scene.shot.frame_seconds();
        let start = f64::from(self.frame) * length + elapsed;
        let (frame, remaining, speed) = (self.frame + 1, length - elapsed, fastest.sqrt());
        let chosen = (self.scene).flip_substep(frame, start, remaining, speed, number - 1)?;
        let substep = chosen.1;
        let flags: Vec<bool> = words[4..].iter().map(|&flag| flag != 0).collect();
        let bricks = self.model.bricks(&flags, self.model.step(&substep).layers);
        self.layout = Some(Layout {
            cells: (CELLS * (bricks.active + 1)) as usize,
            stride: 0,
            substep,
            bricks,
        });
        Ok(())
    }

    fn read_cloud(
        &self,
        traced: Traced<'_>,
        [position, velocity, id, affine]: [&str; 4],
    ) -> Result<Cloud, SolveError> {
        let rows = match self.model.settings().transfer {
            Transfer::Flip => Vec::new(),
            Transfer::Apic => traced.read::<[f32; 9]>(affine, self.n)?,
        };
        let matrix = |row: &[f32; 9]| DMat3::from_cols_array(&row.map(f64::from)).transpose();
        Ok(Cloud {
            position: self.vectors(traced, position)?,
            velocity: self.vectors(traced, velocity)?,
            affine: rows.iter().map(matrix).collect(),
            id: traced.read(id, self.n)?,
        })
    }

    fn assign_cells(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let params = traced.uniform::<FlipParams>("params")?;
        if let Some(layout) = &mut self.layout {
            layout.stride = params.stride as usize;
        }
        let positions = self.vectors(traced, "position")?;
        let cell_of = traced.read::<u32>("cell_of", self.n)?;
        let twin = assign_cells(&self.model, &self.layout().bricks, &positions);
        let mut ties = 0;
        let mut pairs = Vec::with_capacity(self.n);
        for (i, (&found, &exact)) in cell_of.iter().zip(&twin).enumerate() {
            let place = positions[i] / self.model.cell_size();
            let is_near = (place - place.round()).abs().cmplt(4.0 * U * place.abs());
            if found != exact && is_near.any() {
                ties += 1;
            } else {
                pairs.push(pair_of(i, f64::from(found), f64::from(exact), 0.0));
            }
        }
        self.table.add(&CELL, &pairs, ties);
        let slot = traced.read::<u32>("slot_in_cell", self.n)?;
        let cells = (CELLS * (self.layout().bricks.wet + 1)) as usize;
        let counts = traced.read::<u32>("cell_start", cells)?;
        check_slots([&COUNTS, &SLOTS], &cell_of, &slot, &counts, &mut self.table);
        Ok(())
    }

    fn reorder(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let before = self.read_cloud(traced, ["position", "velocity", "id", "affine"])?;
        let names = [
            "sorted_position",
            "sorted_velocity",
            "sorted_id",
            "sorted_affine",
        ];
        let after = self.read_cloud(traced, names)?;
        let order = traced.read::<u32>("order", self.n)?;
        let copies = |after: &[DVec3], before: &[DVec3]| {
            let copy = |(i, &k): (usize, &u32)| pair(i, after[i], before[k as usize], 0.0);
            order.iter().enumerate().map(copy).collect::<Vec<_>>()
        };
        self.table
            .add(&POSITION, &copies(&after.position, &before.position), 0);
        self.table
            .add(&VELOCITY, &copies(&after.velocity, &before.velocity), 0);
        let ids: Vec<u32> = order.iter().map(|&k| before.id[k as usize]).collect();
        self.table.add_exact(&ID, &after.id, &ids);
        if !after.affine.is_empty() {
            for row in 0..3 {
                let rows = |of: &[DMat3]| of.iter().map(|c| c.row(row)).collect::<Vec<_>>();
                let pairs = copies(&rows(&after.affine), &rows(&before.affine));
                self.table.add(&AFFINE, &pairs, 0);
            }
        }
        let cell_of = traced.read::<u32>("cell_of", self.n)?;
        let wet = (CELLS * (self.layout().bricks.wet + 1)) as usize;
        self.sorted = Some(Sorted {
            cell: order.iter().map(|&k| cell_of[k as usize]).collect(),
            cloud: after,
            start: traced.read("cell_start", wet + 1)?,
        });
        Ok(())
    }
}
