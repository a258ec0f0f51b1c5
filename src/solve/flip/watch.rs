//! Data of a substep for probes, and figures of a frame for its report.

use glam::DVec3;

use super::{
    super::{SolveError, pressure, trace::Run},
    CELL_KIND, FACE_CHANGE, Flip, FrameTotals, OPEN_VOLUME,
};
use swell_domain::{
    bricks::CELLS,
    flip::{HALF, open_extent, part_of_solids},
    gauge::Gauge,
    probe::Patch,
    solver::{Observed, Requested, Span, Watch},
};

impl Flip {
    /// Runs the substeps of one frame.
    pub(super) fn run_substeps(
        &mut self,
        watch: &mut dyn Watch,
        run: &mut Run<'_>,
    ) -> Result<FrameTotals, SolveError> {
        let begin = f64::from(self.frame) * self.scene.shot.frame_seconds();
        let mut totals = FrameTotals::default();
        loop {
            let start = begin + totals.elapsed;
            let is_last = self.go_on(&mut totals, run)?;
            let substep = Span {
                start,
                end: begin + totals.elapsed,
                is_last,
            };
            let wanted = watch.wants(substep);
            if wanted.is_any() {
                watch.look(substep, self.seen(&wanted)?);
            }
            if is_last {
                return Ok(totals);
            }
        }
    }

    fn seen(&self, wanted: &Requested) -> Result<Observed, SolveError> {
        let mut seen = Observed::default();
        if wanted.particles {
            let frame = self.frame + 1;
            seen.particles = self.state.look(&self.program, &self.scene, frame)?;
            seen.particles.deep = self.look_deep()?;
        }
        if wanted.pressures {
            seen.pressures = self.pressures_at(&self.scene.pressure_points())?;
        }
        if !wanted.patches.is_empty() {
            let on_face = |gauge: &Gauge<'_>, x, patch: &Patch| gauge.on_face(x, patch.normal());
            seen.patches = self.gauged(&wanted.patches, |patch| patch.at, on_face)?;
        }
        Ok(seen)
    }

    /// Returns the projection's pressures, interpolated between cell centres, Pa; `None` outside
    /// water.
    pub(super) fn pressures_at(&self, points: &[DVec3]) -> Result<Vec<Option<f64>>, SolveError> {
        self.gauged(points, |at| *at, |gauge, x, _| gauge.at(x))
    }

    /// Evaluates `look` on the last substep's pressure field for each item, at its position
    /// `place(item)` relative to the domain's minimum corner.
    fn gauged<T, V>(
        &self,
        all: &[T],
        place: impl Fn(&T) -> DVec3,
        look: impl Fn(&Gauge<'_>, DVec3, &T) -> V,
    ) -> Result<Vec<V>, SolveError> {
        let kind: Vec<u32> = self.field(CELL_KIND, self.elements())?;
        let pressure: Vec<f32> = self.field(pressure::buffers::PRESSURE, self.elements())?;
        let pressure: Vec<f64> = pressure.into_iter().map(f64::from).collect();
        let gauge = Gauge {
            bricks: &self.bricks,
            cells: self.plan.grid_dims,
            cell_size: self.scene.settings().cell_size,
            kind: &kind,
            is_buried: &self.find_buried()?,
            pressure: &pressure,
            taken: &self.taken()?,
            density: self.scene.water.rest_density,
            rise: self.scene.water.rise(),
        };
        let origin = self.scene.domain.min;
        Ok(all
            .iter()
            .map(|one| look(&gauge, place(one) - origin, one))
            .collect())
    }

    /// See [`Gauge::taken`].
    fn taken(&self) -> Result<Vec<[f32; 3]>, SolveError> {
        let stride = self.plan.counts.bricks.slots * CELLS as usize;
        let change: Vec<f32> = self.field(FACE_CHANGE, 3 * stride)?;
        let kick = self.kick as f32;
        let of = |element: usize| [0, 1, 2].map(|axis| -change[axis * stride + element] / kick);
        Ok((0..self.elements()).map(of).collect())
    }

    /// Returns for each element whether its centre was inside a wall or solid in the last substep.
    fn find_buried(&self) -> Result<Vec<bool>, SolveError> {
        let volume: Option<Vec<f32>> = match self.plan.has_solids() {
            true => Some(self.field(OPEN_VOLUME, self.elements())?),
            false => None,
        };
        let of_element = |element: u32| {
            let cell = DVec3::from_array(self.bricks.cell(element).map(f64::from));
            let extent = open_extent(cell, [self.cut.min, self.cut.max]);
            let volume = volume.as_ref().map(|all| f64::from(all[element as usize]));
            let part = volume.map_or(1.0, |volume| part_of_solids(extent, volume));
            extent.min_element() < HALF || part < HALF
        };
        let beyond = std::iter::repeat_n(false, CELLS as usize);
        let of_slots = (CELLS..self.elements() as u32).map(of_element);
        Ok(beyond.chain(of_slots).collect())
    }
}
