//! The water of a frame as a mesh with the volume of the particles, with velocities and normals.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{
    isosurface::{Isosurface, extract},
    level_set::{LevelSet, kernels::Kernels, velocity::Velocities},
    mesh::TriangleMesh,
    parallel,
};

/// Relative deviation from the particles' volume above which the surface is moved.
pub const VOLUME: f64 = 0.01;
/// Relative deviation that a moved surface aims at: well within [`VOLUME`], so that successive
/// frames agree.
const NEAR: f64 = 1e-3;
/// Largest isovalue of a moved surface, either side of 0.
const MARGIN: f32 = 0.5;
/// Largest number of extractions in the search for a volume; each halves the remaining interval.
const TRIES: usize = 8;

/// Particles and grid that a mesh is made from.
#[derive(Clone, Copy, Debug)]
pub struct Body<'a> {
    /// Positions of the particles, metres from the box's least corner.
    pub places: &'a [DVec3],
    /// Velocities of the particles, m/s.
    pub velocities: &'a [[f32; 3]],
    /// Size of the box, metres; its sides are mirrors, and closed where water touches them.
    pub size: DVec3,
    /// Distance between neighbours at rest, metres.
    pub spacing: f64,
    /// Voxels per particle spacing of the grid on which the surface is extracted.
    pub voxels: f64,
}

/// A mesh around the water.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WaterMesh {
    /// Triangles, with vertices in metres from the box's least corner; closed, counter-clockwise
    /// seen from the air.
    pub mesh: TriangleMesh,
    /// Unit normals of the vertices, outward.
    pub normals: Vec<[f32; 3]>,
    /// Velocities of the vertices, m/s.
    pub velocities: Vec<[f32; 3]>,
    /// Further values of the vertices, by name; only what an export asks for.
    pub attributes: BTreeMap<String, Vec<f32>>,
    /// Enclosed volume relative to the particles'; 1 without particles.
    pub volume: f64,
    /// Value of the field at the surface: 0, unless that surface had a different volume from
    /// the particles.
    pub iso: f32,
}

impl WaterMesh {
    /// Extracts the same surface that the renderer draws. If its volume differs from the particles'
    /// by more than [`VOLUME`], searches for the isovalue within ±0.5 whose surface has
    /// their volume; `volume` then holds the ratio that was reached.
    pub fn new(body: &Body<'_>) -> Self {
        let &Body { size, spacing, .. } = body;
        let kernels = Kernels::fit(body.places, size, spacing);
        let voxel = spacing / body.voxels;
        let mut level = LevelSet::of_kernels(&kernels, size, voxel);
        let mut found = (0.0, extract(&level, 0.0));
        let particles = body.places.len() as f64 * spacing.powi(3);
        let ratio = |surface: &Isosurface| match body.places.is_empty() {
            true => 1.0,
            false => surface.mesh.signed_volume() / particles,
        };
        if (ratio(&found.1) - 1.0).abs() > VOLUME {
            level = LevelSet::with_margin(&kernels, size, voxel, MARGIN);
            found = at_volume(&level, found.1, &ratio);
        }
        let (iso, surface) = found;
        Self {
            volume: ratio(&surface),
            iso,
            normals: normals(&surface, &level),
            velocities: Velocities::new(body.places, body.velocities, spacing)
                .at(&surface.mesh.vertices),
            attributes: BTreeMap::new(),
            mesh: surface.mesh,
        }
    }
}

/// Isosurface at which `ratio` is 1, by bisection between 0 and [`MARGIN`] on the side that
/// is needed.
fn at_volume(
    level: &LevelSet,
    own: Isosurface,
    ratio: &dyn Fn(&Isosurface) -> f64,
) -> (f32, Isosurface) {
    let is_too_much = ratio(&own) > 1.0;
    let (mut inner, mut outer) = match is_too_much {
        true => (MARGIN, 0.0),
        false => (0.0, -MARGIN),
    };
    let far = if is_too_much { MARGIN } else { -MARGIN };
    let mut best = (0.0, own);
    let mut next = far;
    for _ in 0..TRIES {
        let surface = extract(level, next);
        let volume = ratio(&surface);
        if (volume - 1.0).abs() < (ratio(&best.1) - 1.0).abs() {
            best = (next, surface);
        }
        let is_out_of_reach = next == far && (volume > 1.0) == is_too_much;
        if (volume - 1.0).abs() < NEAR || is_out_of_reach {
            break;
        }
        match volume > 1.0 {
            true => outer = next.max(outer),
            false => inner = next.min(inner),
        }
        next = 0.5 * (inner + outer);
    }
    best
}

/// Outward normals: against the field's gradient, and those of the box sides in a cap.
fn normals(surface: &Isosurface, level: &LevelSet) -> Vec<[f32; 3]> {
    let mesh = &surface.mesh;
    let mut areas = vec![DVec3::ZERO; mesh.vertices.len()];
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let area = mesh.area_vector(index);
        triangle.iter().for_each(|&v| areas[v as usize] += area);
    }
    let normal = |k: usize| {
        let field = -level.gradient(mesh.vertices[k]);
        // Where the field has no gradient, the triangles' normals are used.
        let choices = [surface.caps[k], field, areas[k]];
        let found = choices.into_iter().find_map(DVec3::try_normalize);
        found.unwrap_or(DVec3::Y).as_vec3().to_array()
    };
    parallel::map(0..areas.len(), normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    const D: f64 = 0.1;
    const SIZE: DVec3 = DVec3::splat(2.0);

    /// A ball of a lattice with neighbours `part` spacings apart.
    fn ball(part: f64) -> Vec<DVec3> {
        let step = part * D;
        let n = (0.7 / step).ceil() as i32;
        let axis = || (-n..=n).map(|k| f64::from(k) * step);
        let all =
            axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| DVec3::new(x, y, z))));
        all.filter(|p| p.length() < 0.7).map(|p| p + 1.0).collect()
    }

    fn mesh(places: &[DVec3]) -> WaterMesh {
        WaterMesh::new(&Body {
            places,
            velocities: &vec![[1.0, 0.0, 0.0]; places.len()],
            size: SIZE,
            spacing: D,
            voxels: 2.0,
        })
    }

    #[test]
    fn a_ball_at_rest_has_its_own_surface() {
        let found = mesh(&ball(1.0));
        assert_eq!(found.iso, 0.0);
        assert!((found.volume - 1.0).abs() <= VOLUME, "{}", found.volume);
        for (place, normal) in found.mesh.vertices.iter().zip(&found.normals) {
            let normal = DVec3::from(normal.map(f64::from));
            assert!((normal.length() - 1.0).abs() < 1e-6);
            // A ball of a lattice is rough, but its normals point outward.
            assert!(normal.dot((*place - 1.0).normalize()) > 0.5, "{place}");
        }
        assert!(
            found
                .velocities
                .iter()
                .all(|v| (v[0] - 1.0).abs() < 1e-6 && v[1].abs() < 1e-6)
        );
    }

    #[test]
    fn squeezed_and_stretched_water_has_its_particles_volume() {
        for part in [0.97, 1.03] {
            let places = ball(part);
            let own = extract(&LevelSet::new(&places, SIZE, D), 0.0);
            let volume = places.len() as f64 * D.powi(3);
            let of_own = own.mesh.signed_volume() / volume;
            assert!((of_own - 1.0).abs() > 2.0 * VOLUME, "the control: {of_own}");
            let found = mesh(&places);
            assert!(
                (found.volume - 1.0).abs() <= VOLUME,
                "{part}: {}",
                found.volume
            );
            assert!((found.mesh.signed_volume() / volume - found.volume).abs() < 1e-12);
            assert!(found.mesh.open_edges().is_empty());
            assert_eq!(found.iso > 0.0, of_own > 1.0);
        }
    }

    #[test]
    fn no_water_is_no_mesh() {
        let found = mesh(&[]);
        assert_eq!((found.mesh.vertices.len(), found.volume), (0, 1.0));
    }
}
