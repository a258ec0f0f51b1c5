//! Surfaces on which force probes integrate the pressure.

use std::borrow::Cow;

use glam::DVec3;

use super::{Scene, Wall, probe::Bearer};
use swell_domain::{
    absorber::AbsorberStates,
    mesh::TriangleMesh,
    pose::Pose,
    probe::{Patch, patches},
};

impl Scene {
    /// Returns the wetted surface of `bearer` at `time` as patches no longer than a cell, relative
    /// to the scene's origin, metres. Patches that face a wall of the domain less than half a cell
    /// away are left out: no water fits between.
    pub fn patches(&self, bearer: Bearer, absorbers: &AbsorberStates, time: f64) -> Vec<Patch> {
        let edge = self.solver.cell_size();
        let (mesh, pose) = match bearer {
            Bearer::Solid(index) => (Cow::Borrowed(&self.solids[index].mesh), Pose::START),
            Bearer::MovingSolid(index) => {
                let solid = &self.moving_solids[index];
                match &solid.sequence {
                    Some(it) => (Cow::Owned(it.shape.mesh(time)), Pose::START),
                    None => (Cow::Borrowed(&solid.placed.mesh), solid.pose(&[], time)),
                }
            }
            Bearer::Wall(wall) => return patches(&self.face(wall, absorbers, time), edge),
        };
        let meets_water = |patch: &Patch| {
            let outside = patch.at + 0.5 * edge * patch.normal();
            self.domain.contains(outside)
        };
        let all = patches(&mesh, edge)
            .into_iter()
            .map(|patch| patch.posed(&pose));
        all.filter(meets_water).collect()
    }

    /// Returns a wall of the domain at `time`, counter-clockwise as seen from inside.
    fn face(&self, wall: Wall, absorbers: &AbsorberStates, time: f64) -> TriangleMesh {
        let walls = self.walls(absorbers, time);
        let at = if wall.is_max { walls.max } else { walls.min }[wall.axis];
        let (u, v) = ((wall.axis + 1) % 3, (wall.axis + 2) % 3);
        let corner = |end_u: usize, end_v: usize| {
            let ends = [DVec3::ZERO, self.domain.size()];
            let mut corner = DVec3::ZERO;
            corner[wall.axis] = at;
            (corner[u], corner[v]) = (ends[end_u][u], ends[end_v][v]);
            self.domain.min + corner
        };
        let inward = [[0, 1, 2], [0, 2, 3]];
        let turned = [[0, 2, 1], [0, 3, 2]];
        TriangleMesh {
            vertices: vec![corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)],
            triangles: if wall.is_max { turned } else { inward }.to_vec(),
        }
    }
}
