//! Data that does not change during a bake, and parameters of a substep.

use glam::{BVec3, DVec3};

use super::solids::Solid;
pub(super) use swell_domain::flip::ON_FACE;
use swell_domain::flip::open_extent;
use swell_domain::{
    absorber::AbsorberStates,
    body::BodyState,
    boundary::Boundary,
    bounds::Bounds,
    bricks::{Bricks, EDGE, table_dims},
    flip::{CAP, CONTACT, layers, stored_cells},
    period::Period,
    pose::{Passage, Pose},
    shape::ShapeField,
    shores::{self, Shores},
    signed_distance::SignedDistance,
};
use swell_scene::{
    FlipScene,
    flip::{Flip, Surface},
    step::Substep,
};

/// The scene, its grid and its solids; positions are relative to the domain's minimum corner.
#[derive(Clone, Debug)]
pub struct Model {
    /// The scene.
    pub scene: FlipScene<'static>,
    /// Cells of the domain along each axis; storage has one more for the upper faces.
    pub cells: [u32; 3],
    /// Signed distances of solids in their initial pose: all static solids as one grid, if there
    /// are any, then each moving solid.
    pub(super) solids: Vec<SignedDistance>,
    /// Offsets of moving solids, metres ([`Boundary::offset`]).
    offsets: Vec<f64>,
    /// Shapes of moving solids that change, by the index of the moving solid.
    shapes: Vec<Option<ShapeField>>,
    /// Finds bricks near solids that count as water.
    shores: Shores,
    /// Number of grids for static solids, 0 or 1.
    at_rest: usize,
}

/// Parameters of one substep.
#[derive(Clone, Debug)]
pub struct FlipSubstep<'a> {
    /// Start of the substep, seconds into the shot.
    pub start: f64,
    /// Length Δt, seconds.
    pub length: f64,
    /// See [`Substep::kick`], seconds.
    pub kick: f64,
    /// Gravity times `kick`, m/s.
    pub velocity_step: DVec3,
    /// Faces of the box at the substep's end, metres: they confine particles.
    pub walls: Bounds,
    /// Faces of the box at the substep's start, in cells: they cut cells.
    pub cut: Bounds,
    /// Velocities of the minimum and the maximum faces, each along its own axis, m/s.
    pub wall_velocity: [DVec3; 2],
    /// PIC fraction α of the substep.
    pub pic_blend: f64,
    /// Number of layers of faces that get a velocity.
    pub layers: usize,
    /// Solids in their poses at the substep's start.
    pub solids: Vec<Solid<'a>>,
}

impl Model {
    /// Creates the model of a scene, with its solids in world space.
    pub fn new(scene: &FlipScene, boundary: &Boundary) -> Self {
        let local = |grid: &SignedDistance| SignedDistance {
            origin: grid.origin - scene.domain.min,
            ..grid.clone()
        };
        let solids = boundary.distance.iter().chain(&boundary.moving);
        Self {
            cells: scene.domain.cells(scene.settings().cell_size),
            solids: solids.map(local).collect(),
            offsets: (0..boundary.moving.len())
                .map(|k| boundary.offset(k))
                .collect(),
            shapes: (boundary.shapes.iter())
                .map(|shape| Some(shape.as_ref()?.field.moved(-scene.domain.min)))
                .collect(),
            shores: Shores::new(boundary, scene.domain.min, scene.settings().cell_size)
                .joined(scene.periodic),
            at_rest: usize::from(boundary.distance.is_some()),
            scene: scene.to_owned_scene(),
        }
    }

    /// Returns FLIP's settings.
    pub fn settings(&self) -> &Flip {
        self.scene.settings()
    }

    /// Returns Δx, metres.
    pub fn cell_size(&self) -> f64 {
        self.settings().cell_size
    }

    /// Returns the offset of a body among `bodies`, metres: they are the last moving solids.
    pub(super) fn offset(&self, index: usize, bodies: usize) -> f64 {
        self.offsets[self.offsets.len() - bodies + index]
    }

    /// Returns the least distance of a particle from walls and solids, metres.
    pub(super) fn contact_distance(&self) -> f64 {
        CONTACT * self.settings().particle_spacing()
    }

    /// Returns the cap on a particle's displacement in a substep, metres.
    pub(super) fn max_displacement(&self) -> f64 {
        CAP * self.settings().cfl * self.cell_size()
    }

    /// Returns the lengths of the domain along its periodic axes.
    pub fn period(&self) -> Period {
        self.scene.period()
    }

    /// Returns whether the pressure solve uses the ghost-fluid surface.
    pub(super) fn has_ghost_fluid(&self) -> bool {
        self.settings().surface == Surface::GhostFluid
    }

    /// Returns the cell of a position in metres; positions on or beyond the domain's faces belong
    /// to the outermost cells.
    pub fn cell_of(&self, x: DVec3) -> [u32; 3] {
        let place = (x / self.cell_size()).floor().to_array();
        // A float-to-integer cast saturates: negative values become 0.
        std::array::from_fn(|axis| (place[axis] as u32).min(self.cells[axis] - 1))
    }

    /// Returns wetness flags of the domain's bricks, none set.
    pub(super) fn no_water(&self) -> Vec<bool> {
        let dims = table_dims(stored_cells(self.cells, self.scene.periodic));
        vec![false; dims.iter().map(|&n| n as usize).product()]
    }

    /// Returns the index of a cell's brick among the flags.
    pub(super) fn brick_index(&self, cell: [u32; 3]) -> usize {
        let dims = table_dims(stored_cells(self.cells, self.scene.periodic));
        let [x, y, z] = cell.map(|c| c / EDGE);
        ((z * dims[1] + y) * dims[0] + x) as usize
    }

    /// Lays out the bricks with particles (`is_wet`), those that count as water near walls and
    /// solids, and those within reach of the step's layers of faces. The elements are those of the
    /// GPU.
    pub fn bricks(&self, is_wet: &[bool], step: &FlipSubstep<'_>) -> Bricks {
        self.laden_bricks(is_wet, None, step)
    }

    /// Same as [`Self::bricks`] with the bricks of `is_laden` first, or all that count as water.
    pub fn laden_bricks(
        &self,
        is_wet: &[bool],
        is_laden: Option<&[bool]>,
        step: &FlipSubstep<'_>,
    ) -> Bricks {
        let periodic = self.scene.periodic;
        let cells = stored_cells(self.cells, periodic);
        let reach = (step.layers as u32).div_ceil(EDGE);
        let mut is_wet = is_wet.to_vec();
        let moving = step.solids.iter().zip(&self.solids).skip(self.at_rest);
        let size = self.cell_size();
        let poses = moving.map(|(now, _)| {
            let shape = now.shape.as_ref();
            let surface = shape.map(|it| shores::Surface::of(&it.before, DVec3::ZERO, size));
            (now.pose.scaled(1.0 / size), surface)
        });
        (self.shores).mark(&mut is_wet, table_dims(cells), &step.cut, poses);
        let is_laden = is_laden.unwrap_or(&is_wet);
        Bricks::laden_first(cells, periodic, &is_wet, is_laden, reach, 1)
    }

    /// Returns the parameters of `substep`, in which absorbing walls and bodies have these states.
    pub fn step(
        &self,
        substep: &Substep,
        absorbers: &AbsorberStates,
        bodies: &[BodyState],
    ) -> FlipSubstep<'_> {
        let Substep {
            start,
            length,
            kick,
            ..
        } = *substep;
        let [before, after] = [start, start + length].map(|time| self.scene.walls(absorbers, time));
        FlipSubstep {
            start,
            length,
            velocity_step: self.scene.water.gravity * kick,
            kick,
            walls: after,
            cut: Bounds {
                min: before.min / self.cell_size(),
                max: before.max / self.cell_size(),
            },
            wall_velocity: [
                (after.min - before.min) / length,
                (after.max - before.max) / length,
            ],
            pic_blend: self.scene.substep_pic_blend(length),
            layers: layers(substep.displacement),
            solids: self.solids_at(bodies, start, length),
        }
    }

    /// Returns the solids on their way through a substep.
    pub(super) fn solids_at(
        &self,
        bodies: &[BodyState],
        start: f64,
        length: f64,
    ) -> Vec<Solid<'_>> {
        let least = self.scene.domain.min;
        let moving = (self.scene.moving_solids.iter()).map(|solid| {
            let [before, after] =
                [start, start + length].map(|t| solid.pose(bodies, t).moved(-least));
            Passage::between(before, after, length)
        });
        let passages =
            std::iter::repeat_n(Passage::resting(Pose::START), self.at_rest).chain(moving);
        let shape = |index: usize| {
            let field = self.shapes.get(index.checked_sub(self.at_rest)?)?;
            Some(field.as_ref()?.step(start, length))
        };
        let solids = self.solids.iter().zip(passages).enumerate();
        solids
            .map(|(k, (grid, passage))| Solid::new(grid, passage).shaped(shape(k)))
            .collect()
    }
}

/// The six walls as half-spaces that cut cells. A cell is given by its minimum corner, in cells.
impl FlipSubstep<'_> {
    /// Returns the open part of a cell's extent along each axis.
    pub(super) fn open_extent(&self, cell: DVec3) -> DVec3 {
        open_extent(cell, [self.cut.min, self.cut.max])
    }

    /// Returns whether the planes of a cell's lower faces lie inside the box.
    pub(super) fn is_plane_open(&self, cell: DVec3) -> BVec3 {
        cell.cmpgt(self.cut.min + ON_FACE) & cell.cmplt(self.cut.max - ON_FACE)
    }

    /// Returns the velocity of the wall that closes each lower face's plane, along its own axis,
    /// m/s.
    pub(super) fn closing_velocity(&self, cell: DVec3) -> DVec3 {
        let [low, high] = self.wall_velocity;
        let high = DVec3::select(cell.cmpge(self.cut.max - ON_FACE), high, DVec3::ZERO);
        DVec3::select(cell.cmple(self.cut.min + ON_FACE), low, high)
    }
}
