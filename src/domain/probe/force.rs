//! Force and moment of the water's pressure on a solid or a wall.

use glam::DVec3;

use crate::{mesh::TriangleMesh, pose::Pose};

/// A piece of a surface on which water may press.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Centroid, metres.
    pub at: DVec3,
    /// Area times unit normal, which points into the water, m².
    pub area: DVec3,
}

impl Patch {
    /// Returns the unit normal; zero for a patch without area.
    pub fn normal(&self) -> DVec3 {
        self.area.normalize_or_zero()
    }

    /// Returns the patch of a body in `pose`; `self` is in the pose at the start.
    pub fn posed(self, pose: &Pose) -> Self {
        Self {
            at: pose.place(self.at),
            area: pose.turn * self.area,
        }
    }
}

/// Cuts a mesh into pieces no longer than `edge`, metres: each triangle into n² congruent ones.
pub fn patches(mesh: &TriangleMesh, edge: f64) -> Vec<Patch> {
    let mut all = Vec::new();
    for index in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(index);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let n = (longest / edge).ceil().max(1.0) as u32;
        let (u, v) = ((b - a) / f64::from(n), (c - a) / f64::from(n));
        let area = mesh.area_vector(index) / f64::from(n).powi(2);
        let at = |i: f64, j: f64| a + i * u + j * v;
        for i in 0..n {
            for j in 0..n - i {
                let (x, y) = (f64::from(i), f64::from(j));
                let third = 1.0 / 3.0;
                all.push(Patch {
                    at: at(x + third, y + third),
                    area,
                });
                if i + j + 1 < n {
                    all.push(Patch {
                        at: at(x + 2.0 * third, y + 2.0 * third),
                        area,
                    });
                }
            }
        }
    }
    all
}

/// Returns the force, N, and the moment about `about`, N m, of these pressures (Pa, one per patch):
/// −Σ p A and −Σ (x − about) × p A, exact for closed meshes if the pressure is linear.
pub fn load(patches: &[Patch], pressures: &[f64], about: DVec3) -> [DVec3; 2] {
    let pushes = patches.iter().zip(pressures);
    pushes.fold([DVec3::ZERO; 2], |[force, moment], (patch, pressure)| {
        let push = -*pressure * patch.area;
        [force + push, moment + (patch.at - about).cross(push)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{bounds::Bounds, mesh::tests::box_mesh};

    fn bounds() -> Bounds {
        Bounds {
            min: DVec3::new(0.2, -1.0, 0.4),
            max: DVec3::new(0.9, 0.3, 1.2),
        }
    }

    /// Archimedes: under p = ρ g (2 − y) a closed body is lifted by ρ g V at the centre of its
    /// volume, however it is cut. Without the top face, the force is larger by the load on
    /// that face.
    #[test]
    fn a_submerged_box_bears_what_it_displaces() {
        let (mesh, bounds) = (box_mesh(bounds()), bounds());
        let middle = 0.5 * (bounds.min + bounds.max);
        let pressure = |y: f64| 9810.0 * (2.0 - y);
        for edge in [10.0, 0.31, 0.1] {
            let patches = patches(&mesh, edge);
            let area: DVec3 = patches.iter().map(|patch| patch.area).sum();
            assert!(area.length() < 1e-12, "{area}");
            let pressures: Vec<f64> = patches.iter().map(|patch| pressure(patch.at.y)).collect();
            let lift = 9810.0 * bounds.volume();
            let [force, moment] = load(&patches, &pressures, middle + DVec3::X);
            assert!((force - lift * DVec3::Y).length() < 1e-9 * lift, "{force}");
            // A metre beside the centre: −x × y is −z.
            assert!(
                (moment + lift * DVec3::Z).length() < 1e-9 * lift,
                "{moment}"
            );
            let sides: Vec<_> = patches.into_iter().filter(|p| p.normal().y < 0.5).collect();
            let pressures: Vec<f64> = sides.iter().map(|patch| pressure(patch.at.y)).collect();
            let open = load(&sides, &pressures, middle)[0].y;
            let top = pressure(0.3) * 0.7 * 0.8;
            assert!((open - lift - top).abs() < 1e-9 * lift, "{open}");
        }
    }

    /// A wall of height 1.5 and width 0.4 under water to its top bears ½ ρ g H² B, at a third of
    /// its height. The moment's integrand is quadratic, so that it is exact to (edge / H)².
    #[test]
    fn a_wall_bears_half_its_square() {
        let corners = [[0.0, 0.0], [0.0, 1.5], [0.4, 1.5], [0.4, 0.0]];
        let wall = TriangleMesh {
            vertices: corners.map(|[z, y]| DVec3::new(0.0, y, z)).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let patches = patches(&wall, 0.05);
        assert!((patches[0].normal() - DVec3::X).length() < 1e-12);
        let pressures: Vec<f64> = patches.iter().map(|p| 9810.0 * (1.5 - p.at.y)).collect();
        let [force, moment] = load(&patches, &pressures, DVec3::ZERO);
        let expected = 0.5 * 9810.0 * 1.5f64.powi(2) * 0.4;
        assert!(
            (force + expected * DVec3::X).length() < 1e-9 * expected,
            "{force}"
        );
        let lever = moment.z / expected;
        assert!(
            (lever - 0.5).abs() < 0.5 * (0.05f64 / 1.5).powi(2),
            "{lever}"
        );
    }
}
