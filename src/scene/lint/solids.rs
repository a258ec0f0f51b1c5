//! Warnings for solids too thin to hold water, and for bodies too small to float as they should.

use glam::DVec3;

use swell_domain::{
    bounds::Bounds,
    mesh::TriangleMesh,
    thin::{Needed, ThinPart, thin_parts},
};

use crate::{ByMethod, PlacedMesh, Scene};

/// Least thickness of a solid, in spacings of the distance grid. A solid thinner than one spacing
/// can lie between two nodes; the additional half is for oblique and moving solids.
const LEAST_THICKNESS: f64 = 1.5;

/// Least size of a body, cells of the projection's grid: edge of a cube with its volume. Cells cut
/// by planes make smaller ones float a tenth of that too high or too low.
const LEAST_BODY: f64 = 2.0;

impl Scene {
    /// Warns about bodies that are small beside cells.
    pub(super) fn lint_bodies(&self, lints: &mut Vec<String>) {
        let cell = self.solver.cell_size();
        let bodies = self.moving_solids.iter().filter(|it| it.body.is_some());
        let sized = bodies.map(|it| (it.placed.mesh.signed_volume().abs().cbrt(), it));
        let mut small: Vec<_> = sized
            .filter(|(size, _)| *size < LEAST_BODY * cell)
            .collect();
        small.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let Some((size, smallest)) = small.first() else {
            return;
        };
        let more = match small.len() - 1 {
            0 => String::new(),
            more => format!(" (the smallest of {})", more + 1),
        };
        lints.push(format!(
            "body.mesh of {}{more}: it is as large as a cube of {size:.3} m, {:.1} cells of {cell} \
             m; below {LEAST_BODY} cells a body may float far from its draft",
            smallest.placed.name(),
            size / cell,
        ));
    }

    /// Returns the thickness that a wall needs to hold water back: the extent of a cell of the
    /// projection's grid along its normal, and not less than what the grid of distances resolves.
    pub fn needed_thickness(&self) -> Needed {
        let at_rest = self.solids.iter();
        let images = at_rest.flat_map(|it| self.with_images(&it.mesh, self.solid_margin()));
        let nodes = self.solid_grid(&images.collect::<Vec<_>>());
        let spacing = nodes.map_or(self.particle_spacing(), |(_, spacing)| spacing);
        let least = LEAST_THICKNESS * spacing;
        match self.by_method() {
            ByMethod::Pbf(scene) if scene.of_projection().is_none() => Needed::Everywhere(least),
            _ => Needed::OfCells {
                cell: self.solver.cell_size(),
                least,
            },
        }
    }

    /// Returns the domain, without ends along its periodic axes.
    pub fn walled(&self) -> Bounds {
        let mut room = self.domain;
        for axis in (0..3).filter(|&axis| self.periodic[axis]) {
            (room.min[axis], room.max[axis]) = (f64::NEG_INFINITY, f64::INFINITY);
        }
        room
    }

    /// Returns the thinnest part of each solid, first those at rest, then those that move, that is
    /// thinner than [needed](Self::needed_thickness), with water or air on both sides. The floor
    /// that moves with waves is not among them.
    pub fn thin_solids(&self) -> Vec<Option<ThinPart>> {
        let (spacing, needed) = (self.particle_spacing(), self.needed_thickness());
        let room = self.walled();
        let meshes: Vec<&TriangleMesh> = self.placed().map(|(placed, _)| &placed.mesh).collect();
        let mut found = thin_parts(&meshes, &room, spacing, needed);
        // What moves may begin at a wall or in another solid.
        for (mesh, part) in meshes.iter().zip(&mut found).skip(self.solids.len()) {
            *part = part.or_else(|| thin_parts(&[mesh], &Bounds::EVERYWHERE, spacing, needed)[0]);
        }
        found
    }

    /// Returns the solids that are thickened, each with its thinnest part.
    pub fn thickened_solids(&self) -> impl Iterator<Item = (&PlacedMesh, ThinPart)> {
        let thin = self.placed().zip(self.thin_solids());
        thin.filter_map(|((placed, is_thickened), part)| {
            Some((placed, part.filter(|_| is_thickened)?))
        })
    }

    /// All solids, and whether they are thickened where they are thin: bodies displace the water of
    /// their volume.
    fn placed(&self) -> impl Iterator<Item = (&PlacedMesh, bool)> {
        let moving = self.drawn_movers();
        let moving = moving.map(|solid| (&solid.placed, solid.body.is_none()));
        self.solids
            .iter()
            .map(|placed| (placed, true))
            .chain(moving)
    }

    /// Warns about solids that are too thin somewhere, with water or air on both sides.
    pub(super) fn lint_thin(&self, lints: &mut Vec<String>) {
        let needed = self.needed_thickness();
        let [least, most] = [needed.along(DVec3::X), needed.most()];
        for ((placed, is_thickened), thin) in self.placed().zip(self.thin_solids()) {
            let Some(thin) = thin else {
                continue;
            };
            // World coordinates, as in the scene file.
            let place = self.origin + thin.place;
            let what = match is_thickened {
                true => "for the water it is thickened",
                false => "water passes through it",
            };
            lints.push(format!(
                "solid.mesh of {}: it is {:.4} m thick at ({:.3}, {:.3}, {:.3}); {what}: to hold \
                 water back a wall must be {least:.4} m thick, and up to {most:.4} m at an angle \
                 to the grid",
                placed.name(),
                thin.thickness,
                place.x,
                place.y,
                place.z,
            ));
        }
    }
}
