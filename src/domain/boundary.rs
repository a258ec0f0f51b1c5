//! Solids as a solver sees them: surface samples that contribute to the density, and a
//! signed distance.

use std::{borrow::Cow, sync::Arc};

use super::{
    sampling::BoundarySample,
    shape::{ShapeField, SurfaceSamples},
    signed_distance::SignedDistance,
};

/// All solids of a scene.
#[derive(Clone, Debug, Default)]
pub struct Boundary {
    /// Samples of the surfaces of all static solids, world space.
    pub samples: Vec<BoundarySample>,
    /// Signed distance to the union of the static solids; `None` if the scene has none.
    pub distance: Option<SignedDistance>,
    /// Signed distance to each moving solid, in its pose at the start.
    pub moving: Vec<SignedDistance>,
    /// Distance by which the surface of each moving solid is moved outward where its volume is cut
    /// by cells, metres ([`volume_offset`](super::cut_cell::volume_offset)); 0 of all but bodies.
    /// Shorter where that is so of all later ones.
    pub offsets: Vec<f64>,
    /// Surface samples of each moving solid, in its pose at the start; empty where the solver takes
    /// no samples.
    pub moving_samples: Vec<Vec<BoundarySample>>,
    /// The moving solids whose shape changes, by the index of the moving solid; the distance in
    /// `moving` is that at the start. Shorter where none of the later ones does.
    pub shapes: Vec<Option<Shape>>,
}

/// A solid whose shape changes.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Distances and velocities of its surface.
    pub field: ShapeField,
    /// Samples of its surface; `None` where the solver takes no samples.
    pub samples: Option<Arc<dyn SurfaceSamples>>,
}

impl Boundary {
    /// Returns the number of samples on all solids.
    pub fn sample_count(&self) -> usize {
        let rigid = self.moving_samples.iter().map(Vec::len);
        let shapes = self.shapes.iter().flatten();
        let shapes = shapes.filter_map(|shape| Some(shape.samples.as_ref()?.count()));
        self.samples.len() + rigid.chain(shapes).sum::<usize>()
    }

    /// Returns the changing shape of a moving solid, if it has one.
    pub fn shape(&self, index: usize) -> Option<&Shape> {
        self.shapes.get(index)?.as_ref()
    }

    /// Returns the offset of a moving solid, metres.
    pub fn offset(&self, index: usize) -> f64 {
        self.offsets.get(index).copied().unwrap_or(0.0)
    }

    /// Returns the distance to a moving solid at `time`, seconds, in its pose at the start.
    pub fn moving_at(&self, index: usize, time: f64) -> Cow<'_, SignedDistance> {
        match self.shape(index) {
            Some(shape) => Cow::Owned(shape.field.at(time)),
            None => Cow::Borrowed(&self.moving[index]),
        }
    }

    /// Returns the number of nodes of the grids of solids whose shape changes.
    pub fn shape_nodes(&self) -> usize {
        let shapes = self.shapes.iter().flatten();
        shapes.map(|shape| shape.field.nodes()).sum()
    }

    /// Iterates over the distances to all solids, the static ones first.
    pub fn grids(&self) -> impl Iterator<Item = &SignedDistance> {
        self.distance.iter().chain(&self.moving)
    }
}
