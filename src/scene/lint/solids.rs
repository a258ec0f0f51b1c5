//! Warnings for solids too thin to hold water, and for bodies too small to float as they should.

use swell_domain::{mesh::TriangleMesh, thin::thin_parts};

use crate::{PlacedMesh, Scene};

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

    /// Warns about solids that are too thin somewhere, with water or air on both sides.
    pub(super) fn lint_thin(&self, lints: &mut Vec<String>) {
        let spacing = self.particle_spacing();
        let at_rest = self.solids.iter();
        let images = at_rest.flat_map(|it| self.with_images(&it.mesh, self.solid_margin()));
        let nodes = self.solid_grid(&images.collect::<Vec<_>>());
        let least = LEAST_THICKNESS * nodes.map_or(spacing, |(_, spacing)| spacing);
        let moving = self.moving_solids.iter().map(|solid| &solid.placed);
        let all: Vec<&PlacedMesh> = self.solids.iter().chain(moving).collect();
        let meshes: Vec<&TriangleMesh> = all.iter().map(|placed| &placed.mesh).collect();
        let found = thin_parts(&meshes, &self.domain, spacing, least);
        for (placed, thin) in all.into_iter().zip(found) {
            let Some(thin) = thin else {
                continue;
            };
            // World coordinates, as in the scene file.
            let place = self.origin + thin.place;
            lints.push(format!(
                "solid.mesh of {}: it is {:.4} m thick at ({:.3}, {:.3}, {:.3}); water passes \
                 through what is thinner than {least:.4} m, {LEAST_THICKNESS} times the spacing of \
                 the grid of distances to solids",
                placed.name(),
                thin.thickness,
                place.x,
                place.y,
                place.z,
            ));
        }
    }
}
