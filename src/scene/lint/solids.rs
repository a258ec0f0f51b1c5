//! Solids that do not hold water.

use std::borrow::Cow;

use swell_domain::{mesh::TriangleMesh, thin::thin_parts};

use crate::{PlacedMesh, Scene};

/// Particle spacings below which water passes through a solid: distances are known at points one spacing apart, so that a thinner one can
/// stand between two of them. A half is for those that stand aslant, or move.
const LEAST_THICKNESS: f64 = 1.5;

impl Scene {
    /// Solids that are thinner somewhere, with water or air on both sides.
    pub(super) fn lint_thin(&self, lints: &mut Vec<String>) {
        let spacing = self.particle_spacing();
        let solids = self.solids.iter().map(|solid| Cow::Borrowed(&solid.mesh));
        let nodes = self.solid_grid(&solids.collect::<Vec<_>>());
        let least = LEAST_THICKNESS * nodes.map_or(spacing, |(_, spacing)| spacing);
        let at_rest = (self.solids.iter().enumerate()).map(|it| ("solid", it));
        let moving = self.moving_solids.iter().map(|solid| &solid.placed);
        let moving = moving.enumerate().map(|it| ("moving_solid", it));
        let all: Vec<(&str, (usize, &PlacedMesh))> = at_rest.chain(moving).collect();
        let meshes: Vec<&TriangleMesh> = all.iter().map(|(_, (_, it))| &it.mesh).collect();
        let found = thin_parts(&meshes, &self.domain, spacing, least);
        for ((key, (index, placed)), thin) in all.into_iter().zip(found) {
            let Some(thin) = thin else {
                continue;
            };
            lints.push(format!(
                "{key}[{index}]: {} is {:.4} m thick at ({:.3}, {:.3}, {:.3}); water passes through what is thinner than {least:.4} m, \
                 {LEAST_THICKNESS} times what distances to solids are apart",
                placed.name(),
                thin.thickness,
                thin.place.x,
                thin.place.y,
                thin.place.z,
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// The wall of hard case 16, and the same as thick as it has to be.
    #[test]
    fn a_thin_wall_is_told_with_its_place_and_the_thickness_it_needs() {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/hard_cases/16-thin-wall.toml");
        let lints = |set: &[&str]| {
            let set: Vec<String> = set.iter().map(|&it| it.to_owned()).collect();
            Scene::load(&file, &set).expect("valid").lints()
        };
        let found = lints(&[]);
        assert_eq!(found.len(), 1, "{found:?}");
        for part in [
            "solid[0]: box is 0.0500 m thick at (0.825, ",
            "0.1500 m, 1.5 times",
        ] {
            assert!(found[0].contains(part), "{part} of {found:?}");
        }
        assert_eq!(lints(&["solid[0].scale=[0.151,1.6,1.0]"]), [] as [&str; 0]);
    }
}
