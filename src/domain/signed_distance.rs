//! Signed distance to a mesh on a node-centred grid.
//!
//! Distance and sign both come from one tree over the triangles: every node gets the exact
//! distance, not only a band from which a sweep extrapolates. The previous node in the row bounds
//! the search, so that this costs no more than a sweep, and it runs on every core. Exact distances
//! also show where the sign cannot change: between two nodes whose distances add up to more than
//! their separation there is no surface. Only elsewhere, and everywhere around an open mesh, is the
//! winding number evaluated.

use glam::DVec3;

use super::{bounds::Bounds, bvh::Bvh, inside::NoInside, mesh::TriangleMesh, parallel};

/// Largest number of nodes in a grid: 4 GiB of values.
pub const MAX_NODES: usize = 1 << 30;

/// Distances at the nodes of a grid, metres; negative inside.
#[derive(Clone, Debug, PartialEq)]
pub struct SignedDistance {
    /// Position of the first node, metres.
    pub origin: DVec3,
    /// Distance between nodes, metres.
    pub spacing: f64,
    /// Nodes along x, y, z; at least two each.
    pub dims: [usize; 3],
    /// One value per node, x fastest.
    pub values: Vec<f32>,
}

/// Reason why there is no signed distance.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SignedDistanceError {
    /// The mesh has no inside.
    #[error(transparent)]
    NoInside(#[from] NoInside),
    /// The grid is too fine, or the box is invalid.
    #[error(
        "a grid over {size} m at a spacing of {spacing} m has about {nodes:.3e} nodes; allowed \
         are up to {MAX_NODES}"
    )]
    Grid {
        /// Edge lengths requested, metres.
        size: DVec3,
        /// Distance between nodes requested, metres.
        spacing: f64,
        /// Number of nodes that this would need.
        nodes: f64,
    },
    /// The grids do not coincide.
    #[error("cannot unite signed distances on different grids")]
    GridsDiffer,
}

impl SignedDistance {
    /// Samples the distance to `mesh` at the nodes of a grid that starts at `bounds.min`, covers
    /// `bounds`, and has a spacing of `spacing` metres.
    ///
    /// A node is inside if the absolute generalised winding number exceeds ½, so that a mesh with
    /// small holes, or one turned inside out, has its inside where one expects it.
    ///
    /// # Errors
    /// If the mesh has no inside, or the grid exceeds [`MAX_NODES`].
    pub fn from_mesh(
        mesh: &TriangleMesh,
        bounds: &Bounds,
        spacing: f64,
    ) -> Result<Self, SignedDistanceError> {
        mesh.check_inside()?;
        let (dims, origin) = (grid_dims(bounds, spacing)?, bounds.min);
        let nodes = sampled(mesh, (origin, spacing, dims), &|_, _| ());
        Ok(Self {
            origin,
            spacing,
            dims,
            values: nodes.into_iter().map(|(value, ())| value).collect(),
        })
    }

    /// Returns the distance from `x` to the farthest corner of the grid, metres.
    pub fn reach(&self, x: DVec3) -> f64 {
        let last = DVec3::from_array(self.dims.map(|n| (n - 1) as f64));
        let (low, high) = (self.origin - x, self.origin + self.spacing * last - x);
        low.abs().max(high.abs()).length()
    }

    /// Samples the distance to the union of several solids; `None` if there are none.
    ///
    /// # Errors
    /// Those of [`Self::from_mesh`].
    pub fn from_meshes<'a>(
        meshes: impl IntoIterator<Item = &'a TriangleMesh>,
        bounds: &Bounds,
        spacing: f64,
    ) -> Result<Option<Self>, SignedDistanceError> {
        let mut all: Option<Self> = None;
        for mesh in meshes {
            let one = Self::from_mesh(mesh, bounds, spacing)?;
            all = Some(match all {
                None => one,
                Some(all) => all.union(&one)?,
            });
        }
        Ok(all)
    }

    /// Returns the distance to the union of two solids, the smaller of both: exact outside, a
    /// bound inside.
    ///
    /// # Errors
    /// [`SignedDistanceError::GridsDiffer`] if the grids do not coincide.
    pub fn union(mut self, other: &Self) -> Result<Self, SignedDistanceError> {
        if (self.origin, self.spacing, self.dims) != (other.origin, other.spacing, other.dims) {
            return Err(SignedDistanceError::GridsDiffer);
        }
        for (value, other) in self.values.iter_mut().zip(&other.values) {
            *value = value.min(*other);
        }
        Ok(self)
    }

    /// Returns the value at node `(i, j, k)`, metres.
    pub fn node(&self, i: usize, j: usize, k: usize) -> f64 {
        f64::from(self.values[i + self.dims[0] * (j + self.dims[1] * k)])
    }

    /// Returns the trilinear interpolation at `p`, metres. Beyond the grid it is the value at the
    /// nearest point of the grid plus the distance to that point.
    #[inline]
    pub fn sample(&self, p: DVec3) -> f64 {
        let (cell, u, beyond) = self.locate(p);
        let c = self.corners(cell);
        let along_x = |j: usize, k: usize| {
            let at = 2 * j + 4 * k;
            c[at] + u.x * (c[at + 1] - c[at])
        };
        let along_y = |k: usize| along_x(0, k) + u.y * (along_x(1, k) - along_x(0, k));
        along_y(0) + u.z * (along_y(1) - along_y(0)) + beyond
    }

    /// Returns the gradient of the trilinear interpolation, which points away from the solid;
    /// its length is one up to the grid's error, and less near the medial axis. Constant beyond
    /// the grid.
    #[inline]
    pub fn gradient(&self, p: DVec3) -> DVec3 {
        let (cell, u, _) = self.locate(p);
        let c = self.corners(cell);
        let slope = |axis: usize| {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut sum = 0.0;
            for corner in 0..4 {
                let (ia, ib) = (corner & 1, corner >> 1);
                let weight = |i: usize, u: f64| if i == 0 { 1.0 - u } else { u };
                let low = (ia << a) | (ib << b);
                sum += weight(ia, u[a]) * weight(ib, u[b]) * (c[low | (1 << axis)] - c[low]);
            }
            sum / self.spacing
        };
        DVec3::new(slope(0), slope(1), slope(2))
    }

    /// Cell around `p` (clamped to the grid), position within it in `[0, 1]³`, and distance of `p`
    /// from the grid.
    fn locate(&self, p: DVec3) -> ([usize; 3], DVec3, f64) {
        let local = (p - self.origin) / self.spacing;
        let last = DVec3::from_array(self.dims.map(|n| (n - 1) as f64));
        let inside = local.clamp(DVec3::ZERO, last);
        let cell = [0, 1, 2].map(|a| (inside[a] as usize).min(self.dims[a] - 2));
        let u = inside - DVec3::from_array(cell.map(|c| c as f64));
        (cell, u, (local - inside).length() * self.spacing)
    }

    /// Returns the cell around `p`, clamped to the grid, and the position within it, 0 to 1 along
    /// each axis.
    pub(crate) fn cell_of(&self, p: DVec3) -> ([usize; 3], DVec3) {
        let (cell, u, _) = self.locate(p);
        (cell, u)
    }

    /// The eight values of a cell, x fastest.
    fn corners(&self, [i, j, k]: [usize; 3]) -> [f64; 8] {
        std::array::from_fn(|c| self.node(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)))
    }
}

/// Samples the distance to a mesh at the nodes of a grid, given by its first node, the distance
/// between nodes in metres, and the number of nodes along each axis. Beside each value is what `of`
/// gives for the node's position and the index of the nearest triangle.
pub(crate) fn sampled<T: Send + Clone + Default>(
    mesh: &TriangleMesh,
    (origin, spacing, dims): (DVec3, f64, [usize; 3]),
    of: &(impl Fn(DVec3, u32) -> T + Sync),
) -> Vec<(f32, T)> {
    let bvh = Bvh::new(mesh);
    let is_closed = mesh.open_edges().is_empty();
    let mut nodes = vec![(0.0f32, T::default()); dims[0] * dims[1] * dims[2]];
    parallel::for_chunks_mut(&mut nodes, dims[0], |row, nodes| {
        let (j, k) = (row % dims[1], row / dims[1]);
        let mut nearest = (f64::INFINITY, 0);
        let mut before: Option<(f64, bool)> = None;
        for (i, node) in nodes.iter_mut().enumerate() {
            let p = origin + spacing * DVec3::new(i as f64, j as f64, k as f64);
            nearest = bvh.nearest(p, nearest.0).unwrap_or(nearest);
            let (distance, triangle) = nearest;
            // The next node is one spacing away, and so at most that much farther from the
            // surface.
            nearest.0 = (distance + spacing) * (1.0 + 1e-9);
            let is_inside = match before {
                Some((d, is_inside)) if is_closed && d + distance > spacing * (1.0 + 1e-6) => {
                    is_inside
                }
                _ => bvh.winding_number(p).abs() > 0.5,
            };
            before = Some((distance, is_inside));
            let value = if is_inside { -distance } else { distance } as f32;
            *node = (value, of(p, triangle));
        }
    });
    nodes
}

/// Returns the smallest distance between nodes, metres, not below `spacing`, at which at most
/// `most` nodes cover `bounds`.
pub fn fitting_spacing(bounds: &Bounds, spacing: f64, most: usize) -> f64 {
    let nodes = |spacing: f64| {
        let counts = node_counts(bounds, spacing);
        counts.x * counts.y * counts.z
    };
    let mut fitting = spacing;
    // Counts are whole numbers, so that the cube root may fall slightly short.
    while spacing > 0.0 && nodes(fitting) > most as f64 {
        fitting *= (nodes(fitting) / most as f64).cbrt().max(1.001);
    }
    fitting
}

fn node_counts(bounds: &Bounds, spacing: f64) -> DVec3 {
    // A box that is a whole number of spacings up to round-off gets no additional node.
    (bounds.size() / spacing - DVec3::splat(1e-6))
        .ceil()
        .max(DVec3::ONE)
        + DVec3::ONE
}

/// Number of nodes that cover `bounds`.
pub(crate) fn grid_dims(bounds: &Bounds, spacing: f64) -> Result<[usize; 3], SignedDistanceError> {
    let size = bounds.size();
    let counts = node_counts(bounds, spacing);
    let nodes = counts.x * counts.y * counts.z;
    let is_sound = spacing > 0.0 && size.cmpge(DVec3::ZERO).all() && nodes <= MAX_NODES as f64;
    if !is_sound {
        return Err(SignedDistanceError::Grid {
            size,
            spacing,
            nodes,
        });
    }
    Ok(counts.to_array().map(|n| n as usize))
}

#[cfg(test)]
mod tests {
    use super::super::mesh::tests::{box_mesh, cube, sphere};
    use super::*;

    fn around(mesh: &TriangleMesh, margin: f64) -> Bounds {
        mesh.bounds().expect("not empty").grown(margin)
    }

    #[test]
    fn a_grid_is_as_fine_as_its_nodes_allow() {
        let bounds = around(&cube(), 0.5);
        assert_eq!(fitting_spacing(&bounds, 0.1, 1 << 20), 0.1);
        for most in [30, 1000, 5000] {
            let spacing = fitting_spacing(&bounds, 0.01, most);
            let nodes = |spacing| {
                grid_dims(&bounds, spacing)
                    .expect("few")
                    .into_iter()
                    .product::<usize>()
            };
            assert!(nodes(spacing) <= most && spacing > 0.01, "{most}");
            // Control: one more node along each axis would be too many.
            let along = grid_dims(&bounds, spacing).expect("few");
            let finer: usize = along.iter().map(|n| n + 1).product();
            assert!(finer > most, "{most}");
        }
    }

    fn nodes(field: &SignedDistance) -> impl Iterator<Item = (DVec3, f64)> {
        let [nx, ny, nz] = field.dims;
        (0..nx * ny * nz).map(move |n| {
            let (i, j, k) = (n % nx, n / nx % ny, n / (nx * ny));
            let p = field.origin + field.spacing * DVec3::new(i as f64, j as f64, k as f64);
            (p, field.node(i, j, k))
        })
    }

    fn box_distance(p: DVec3, bounds: &Bounds) -> f64 {
        let centre = 0.5 * (bounds.min + bounds.max);
        let q = (p - centre).abs() - 0.5 * bounds.size();
        q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
    }

    #[test]
    fn a_box_has_its_analytic_distance_at_every_node() {
        let bounds = Bounds {
            min: DVec3::new(-0.3, 0.0, 0.1),
            max: DVec3::new(0.9, 0.77, 2.0),
        };
        let mesh = box_mesh(bounds);
        let field = SignedDistance::from_mesh(&mesh, &around(&mesh, 0.6), 0.13).expect("closed");
        for (p, value) in nodes(&field) {
            // Stored as f32: 6e-8 of at most two metres.
            assert!(
                (value - box_distance(p, &bounds)).abs() < 2e-7,
                "{p} {value}"
            );
        }
    }

    #[test]
    fn a_sphere_is_as_good_as_its_mesh_and_its_gradient_points_outward() {
        let (centre, radius, rings) = (DVec3::new(0.1, 0.2, 0.3), 1.0, 40);
        let mesh = sphere(centre, radius, rings);
        let field = SignedDistance::from_mesh(&mesh, &around(&mesh, 0.5), 0.1).expect("closed");
        // Chords of π/40 rad stay within R(1 − cos(π/80)) ≈ 8e-4 R, twice that across a quad.
        let sagitta = 2.0 * radius * (1.0 - (std::f64::consts::PI / 80.0).cos());
        for (p, value) in nodes(&field) {
            let exact = (p - centre).length() - radius;
            assert!((value - exact).abs() < sagitta, "{p} {value} {exact}");
        }
        for p in [DVec3::new(1.3, 0.2, 0.3), DVec3::new(0.5, -0.4, 0.9)] {
            let outward = (p - centre).normalize();
            let gradient = field.gradient(p);
            assert!((gradient - outward).length() < 0.1, "{gradient} {outward}");
            // Trilinear interpolation: 3/8 · spacing² · curvature 1/R.
            let exact = (p - centre).length() - radius;
            assert!((field.sample(p) - exact).abs() < 4e-3 + sagitta);
        }
    }

    #[test]
    fn the_gradient_is_the_derivative_of_the_interpolation() {
        let mesh = sphere(DVec3::ZERO, 1.0, 8);
        let field = SignedDistance::from_mesh(&mesh, &around(&mesh, 0.5), 0.2).expect("closed");
        let step = 1e-6;
        for p in [DVec3::new(0.33, 0.41, -0.72), DVec3::new(-1.01, 0.07, 0.11)] {
            let gradient = field.gradient(p);
            for axis in 0..3 {
                let d = step * DVec3::AXES[axis];
                let difference = (field.sample(p + d) - field.sample(p - d)) / (2.0 * step);
                // The interpolation is linear along an axis within a cell: only round-off remains.
                assert!((difference - gradient[axis]).abs() < 1e-8, "{p} {axis}");
            }
        }
    }

    #[test]
    fn a_slightly_open_box_keeps_its_inside_and_a_turned_one_too() {
        let bounds = Bounds {
            min: DVec3::ZERO,
            max: DVec3::ONE,
        };
        // One of 1 520 triangles is missing: away from the hole the sign must be right.
        let mut open = sphere(DVec3::splat(0.5), 0.5, 20);
        open.triangles.remove(300);
        let grid = bounds.grown(0.2);
        let field = SignedDistance::from_mesh(&open, &grid, 0.05).expect("nearly closed");
        for (p, value) in nodes(&field) {
            let exact = (p - DVec3::splat(0.5)).length() - 0.5;
            if exact.abs() > 0.05 {
                assert_eq!(value < 0.0, exact < 0.0, "{p} {value} {exact}");
            }
        }

        let mut turned = cube();
        turned.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        let field = SignedDistance::from_mesh(&turned, &grid, 0.11).expect("closed");
        for (p, value) in nodes(&field) {
            assert!((value - box_distance(p, &bounds)).abs() < 1e-6);
        }
    }

    #[test]
    fn the_inside_of_a_house_without_its_floor_ends_where_the_floor_was() {
        let mut house = box_mesh(Bounds {
            min: DVec3::ZERO,
            max: DVec3::new(2.0, 4.0, 2.0),
        });
        house.triangles.drain(4..6);
        // Two nodes 5 mm to each side of the hole's centre. A square of half edge a subtends 4
        // asin(a²/(a² + h²)) as seen from h above it: there the winding number is 0.5 ± 0.002, and
        // a threshold 1 % off would move the floor.
        let middle = Bounds {
            min: DVec3::new(1.0, -0.005, 1.0),
            max: DVec3::new(1.01, 0.005, 1.01),
        };
        let field = SignedDistance::from_mesh(&house, &middle, 0.01).expect("nearly closed");
        for (p, value) in nodes(&field) {
            assert_eq!(value < 0.0, p.y > 0.0, "{p} {value}");
        }
    }

    #[test]
    fn halfway_between_two_near_surfaces_is_outside() {
        // Hard case 29: two boxes 0.04 apart on a grid of 0.1.
        let left = box_mesh(Bounds {
            min: DVec3::ZERO,
            max: DVec3::new(0.48, 1.0, 1.0),
        });
        let right = box_mesh(Bounds {
            min: DVec3::new(0.52, 0.0, 0.0),
            max: DVec3::ONE,
        });
        let grid = Bounds {
            min: DVec3::splat(-0.2),
            max: DVec3::splat(1.2),
        };
        let field = SignedDistance::from_meshes([&left, &right], &grid, 0.1)
            .expect("closed")
            .expect("two solids");
        assert!((field.sample(DVec3::new(0.5, 0.5, 0.5)) - 0.02).abs() < 1e-6);
        assert!(field.sample(DVec3::new(0.3, 0.5, 0.5)) < 0.0);
        // Control: without the gap the middle is inside.
        let joined = SignedDistance::from_mesh(&cube(), &grid, 0.1).expect("closed");
        assert!(joined.sample(DVec3::new(0.5, 0.5, 0.5)) < -0.4);
    }

    #[test]
    fn beyond_the_grid_the_way_there_counts() {
        let mesh = cube();
        let field = SignedDistance::from_mesh(&mesh, &around(&mesh, 0.5), 0.25).expect("closed");
        assert!((field.sample(DVec3::new(4.0, 0.5, 0.5)) - 3.0).abs() < 1e-6);
    }

    #[test]
    fn sheets_and_absurd_grids_are_refused() {
        let mut sheet = cube();
        sheet.triangles.truncate(2);
        let bounds = around(&sheet, 0.5);
        assert!(matches!(
            SignedDistance::from_mesh(&sheet, &bounds, 0.1),
            Err(SignedDistanceError::NoInside(NoInside::Open { .. }))
        ));
        for spacing in [1e-5, 0.0, -1.0, f64::NAN] {
            assert!(matches!(
                SignedDistance::from_mesh(&cube(), &bounds, spacing),
                Err(SignedDistanceError::Grid { .. })
            ));
        }
        let coarse = SignedDistance::from_mesh(&cube(), &bounds, 0.5).expect("closed");
        let fine = SignedDistance::from_mesh(&cube(), &bounds, 0.25).expect("closed");
        assert_eq!(coarse.union(&fine), Err(SignedDistanceError::GridsDiffer));
    }

    #[test]
    fn a_city_takes_seconds_at_most() {
        // 200 towers of 12 triangles on the grid of the city scene.
        let towers = (0..200u32).map(|t| {
            let (i, j) = (f64::from(t % 10), f64::from(t / 10));
            let min = DVec3::new(16.0 + 0.85 * i, 0.0, 0.5 + 0.7 * j);
            box_mesh(Bounds {
                min,
                max: min + DVec3::new(0.6, 1.0 + 0.5 * ((3 * t) % 11) as f64, 0.5),
            })
        });
        let mut city = TriangleMesh::default();
        for tower in towers {
            let base = city.vertices.len() as u32;
            city.vertices.extend(tower.vertices);
            city.triangles
                .extend(tower.triangles.iter().map(|t| t.map(|v| v + base)));
        }
        let domain = Bounds {
            min: DVec3::ZERO,
            max: DVec3::new(25.0, 12.6, 15.0),
        };
        let start = std::time::Instant::now();
        let field = SignedDistance::from_mesh(&city, &domain, 0.2).expect("closed");
        let seconds = start.elapsed().as_secs_f64();
        println!("{} nodes in {seconds:.2} s", field.values.len());
        // Takes 1.8 s on two cores; the bound only distinguishes a missing tree from a
        // busy machine.
        assert!(seconds < 20.0);
        let inside = field.values.iter().filter(|v| **v < -1e-6).count();
        assert!(inside > 1000, "{inside}");
    }
}
