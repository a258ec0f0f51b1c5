//! Emitters and drains.

use glam::DVec3;

use super::{PlacedMesh, Scene, Shot};
use swell_domain::{
    bounds::Bounds,
    signed_distance::SignedDistanceError,
    sources::{Emitter, Shape, Sources, flow},
};

/// Volume of an emitter, a drain or a force.
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    /// A box, metres.
    Block(Bounds),
    /// A closed mesh.
    Mesh(PlacedMesh),
}

impl Region {
    /// Returns the bounding box, metres.
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Block(block) => *block,
            Self::Mesh(placed) => placed.mesh.bounds().unwrap_or_default(),
        }
    }

    /// Returns the largest rounding error of the file's coordinates along each axis, metres.
    pub fn rounding(&self) -> DVec3 {
        match self {
            Self::Block(_) => DVec3::ZERO,
            Self::Mesh(placed) => placed.rounding,
        }
    }

    fn shape(&self, spacing: f64) -> Result<Shape, SignedDistanceError> {
        match self {
            Self::Block(block) => Ok(Shape::from(*block)),
            Self::Mesh(placed) => Shape::of_mesh(&placed.mesh, spacing),
        }
    }
}

/// Volume of an inflow on FLIP's cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inlet {
    /// First cell whose centre lies in the inflow's bounding box; greater than `high`
    /// if there is none.
    pub low: [u32; 3],
    /// Last such cell.
    pub high: [u32; 3],
    /// Rate at which cells lose excess water, 1/s: by the end of the frame, when the
    /// next water enters.
    pub rate: f64,
}

impl Inlet {
    /// Whether a cell lies in the volume.
    pub fn contains(&self, cell: [u32; 3]) -> bool {
        (0..3).all(|axis| (self.low[axis]..=self.high[axis]).contains(&cell[axis]))
    }
}

/// Largest number of emitters without a level; a shader pass loops over all of them.
pub const MAX_INLETS: usize = 8;

impl Scene {
    /// Returns the emitters without a level, whose water enters at their velocity.
    fn flows(&self) -> impl Iterator<Item = &Emitter<Region>> {
        self.emitters.iter().filter(|it| it.level.is_none())
    }

    /// Whether there are emitters without a level.
    pub fn has_inlets(&self) -> bool {
        self.flows().next().is_some()
    }

    /// Returns the inflow volumes on FLIP's cells in a substep of `length` seconds from `start`.
    pub fn inlets(&self, start: f64, length: f64) -> Vec<Inlet> {
        let (corner, size) = (self.domain.min, self.solver.cell_size());
        let left = self.seconds_left(start, length);
        let inlet = |it: &Emitter<Region>| {
            let bounds = self.entered(it);
            // A cell centre on a face counts as inside.
            let low = ((bounds.min - corner) / size - 0.5 - 1e-6).ceil();
            let high = ((bounds.max - corner) / size - 0.5 + 1e-6).floor();
            let [low, high] = match low.cmple(high).all() {
                true => [low, high].map(|cell| cell.to_array().map(|c| c as u32)),
                false => [[1; 3], [0; 3]],
            };
            Inlet {
                low,
                high,
                rate: 1.0 / left,
            }
        };
        self.flows().map(inlet).collect()
    }

    /// Returns the box that a frame's water occupies when it enters. For a velocity oblique to the
    /// axes it extends beyond the emitter.
    fn entered(&self, flow: &Emitter<Region>) -> Bounds {
        let (bounds, velocity) = (flow.shape.bounds(), flow.velocity);
        let moving = velocity
            .to_array()
            .into_iter()
            .filter(|speed| *speed != 0.0);
        if moving.count() == 1 {
            return bounds;
        }
        let way = velocity * self.shot.frame_seconds();
        Bounds {
            min: (bounds.min + way.min(DVec3::ZERO)).max(self.domain.min),
            max: (bounds.max + way.max(DVec3::ZERO)).min(self.domain.max),
        }
    }

    /// Whether the scene has emitters or drains.
    pub fn has_sources(&self) -> bool {
        !self.emitters.is_empty() || !self.drains.is_empty()
    }

    /// Returns the emitters and drains, which act at the ends of frames.
    ///
    /// # Errors
    /// If the signed distance of a mesh cannot be computed.
    pub fn sources(&self) -> Result<Sources, SignedDistanceError> {
        let spacing = self.particle_spacing();
        let mut sources = Sources {
            emitters: Vec::new(),
            drains: Vec::new(),
            spacing,
            frames_per_second: self.shot.frames_per_second,
            domain: self.domain,
        };
        for it in &self.emitters {
            let shape = it.shape.shape(spacing)?;
            sources.emitters.push(it.clone().with_shape(shape));
        }
        for it in &self.drains {
            let shape = it.shape.shape(spacing)?;
            sources.drains.push(it.clone().with_shape(shape));
        }
        Ok(sources)
    }

    /// Moves emitters and drains by `way`, metres.
    pub(super) fn carry_sources(&mut self, way: DVec3, carry: &dyn Fn(&mut PlacedMesh, DVec3)) {
        let emitters = self
            .emitters
            .iter_mut()
            .map(|it| (&mut it.shape, &mut it.level));
        let drains = self
            .drains
            .iter_mut()
            .map(|it| (&mut it.shape, &mut it.level));
        for (shape, level) in emitters.chain(drains) {
            match shape {
                Region::Block(block) => *block = block.moved(way),
                Region::Mesh(placed) => carry(placed, way),
            }
            if let Some(level) = level {
                *level += way.y;
            }
        }
    }

    /// Returns the meshes of the rooms of emitters, drains and forces.
    pub(super) fn source_meshes(&self) -> impl Iterator<Item = &PlacedMesh> {
        let emitters = self.emitters.iter().map(|it| &it.shape);
        let shapes = emitters.chain(self.drains.iter().map(|it| &it.shape));
        let shapes = shapes.chain(self.forces.iter().filter_map(|it| it.region.as_ref()));
        shapes.filter_map(|shape| match shape {
            Region::Block(_) => None,
            Region::Mesh(placed) => Some(placed),
        })
    }
}

/// Estimates the number of particles that emitters without a level add during the shot. The number
/// from emitters with a level depends on the water.
pub fn most_entering(emitters: &[Emitter<Region>], spacing: f64, shot: &Shot) -> f64 {
    let flows = emitters.iter().filter(|it| it.level.is_none());
    let volumes = flows.map(|it| {
        let flow = flow(it.shape.bounds().size(), it.velocity, spacing);
        flow * it.window.length(shot.duration())
    });
    volumes.sum::<f64>() / spacing.powi(3)
}
