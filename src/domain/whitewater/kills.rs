//! Kill volumes: rooms in which whitewater ends, whatever its kind and life.

use std::{path::PathBuf, sync::Arc};

use glam::{DVec3, Vec3};

use crate::{
    bounds::Bounds, bvh::Bvh, mesh::TriangleMesh, parallel, particles::Particles, sources::Window,
};

/// Where whitewater ends.
#[derive(Clone, Debug, PartialEq)]
pub enum KillRoom {
    /// In a box; world coordinates, metres.
    Block(Bounds),
    /// In a closed mesh.
    Mesh(Arc<KillMesh>),
    /// Within this distance of the walls of the domain that face x or z, metres.
    Sides(f64),
}

/// A mesh as a kill volume.
#[derive(Clone, Debug, PartialEq)]
pub struct KillMesh {
    /// File that it was read from.
    pub file: PathBuf,
    /// BLAKE3 of the file's bytes, hexadecimal.
    pub file_hash: String,
    /// Translation, metres.
    pub translate: [f64; 3],
    /// Euler angles about x, y and z, degrees.
    pub rotate_degrees: [f64; 3],
    /// Metres per unit of the file, along each axis.
    pub scale: [f64; 3],
    /// The mesh in the world, metres.
    pub mesh: TriangleMesh,
}

/// A kill volume, which acts at frames that end in its window.
#[derive(Clone, Debug, PartialEq)]
pub struct Kill {
    /// Where it acts.
    pub room: KillRoom,
    /// When it acts.
    pub window: Window,
}

/// The domain as kill volumes see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KillDomain {
    /// Position of the particles' origin in the world, metres.
    pub origin: DVec3,
    /// Domain relative to the particles' origin, metres.
    pub bounds: Bounds,
    /// Axes along which it is periodic, where it has no walls.
    pub periodic: [bool; 3],
}

/// A room with what finds whether a position is in it.
struct Test<'a> {
    room: &'a KillRoom,
    /// Box and triangles of a mesh.
    mesh: Option<(Bounds, Bvh)>,
}

impl<'a> Test<'a> {
    fn of(room: &'a KillRoom) -> Self {
        let mesh = match room {
            KillRoom::Mesh(mesh) => {
                let bounds = mesh.mesh.bounds().unwrap_or_default();
                Some((bounds, Bvh::new(&mesh.mesh)))
            }
            KillRoom::Block(_) | KillRoom::Sides(_) => None,
        };
        Self { room, mesh }
    }

    fn contains(&self, domain: &KillDomain, x: DVec3) -> bool {
        match self.room {
            KillRoom::Block(block) => block.contains(domain.origin + x),
            KillRoom::Mesh(_) => self.mesh.as_ref().is_some_and(|(bounds, tree)| {
                let x = domain.origin + x;
                bounds.contains(x) && tree.winding_number(x).abs() > 0.5
            }),
            KillRoom::Sides(width) => {
                let Bounds { min, max } = domain.bounds;
                let is_near = |axis: usize| {
                    !domain.periodic[axis]
                        && (x[axis] - min[axis]).min(max[axis] - x[axis]) < *width
                };
                is_near(0) || is_near(2)
            }
        }
    }
}

/// Removes the particles in kill volumes at the end of a frame, `time` seconds from the start of
/// the shot, and returns how many.
pub fn kill(kills: &[Kill], domain: &KillDomain, time: f64, particles: &mut Particles) -> usize {
    let acting = kills.iter().filter(|kill| kill.window.holds(time));
    let acting: Vec<Test<'_>> = acting.map(|kill| Test::of(&kill.room)).collect();
    if acting.is_empty() {
        return 0;
    }
    let before = particles.len();
    let keep = parallel::map_slice(&particles.position, |x| {
        let x = Vec3::from_array(*x).as_dvec3();
        !acting.iter().any(|room| room.contains(domain, x))
    });
    particles.retain(&keep);
    before - particles.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::sphere;

    const DOMAIN: KillDomain = KillDomain {
        origin: DVec3::new(100.0, 0.0, 0.0),
        bounds: Bounds {
            min: DVec3::ZERO,
            max: DVec3::new(10.0, 4.0, 8.0),
        },
        periodic: [false; 3],
    };

    /// Ids of the particles that are left of a grid of one per cubic metre.
    fn left(
        room: &KillRoom,
        domain: &KillDomain,
        (from, until): (f64, Option<f64>),
    ) -> Vec<[i32; 3]> {
        let mut all = super::super::none();
        for k in 0..320 {
            let cell = [k % 10, k / 10 % 4, k / 40];
            all.position.push(cell.map(|c| c as f32 + 0.5));
            all.velocity.push([0.0; 3]);
            all.id.push(k as u32);
            for column in all.attributes.values_mut() {
                column.push(1.0);
            }
        }
        let window = Window { from, until };
        let gone = kill(
            &[Kill {
                room: room.clone(),
                window,
            }],
            domain,
            1.0,
            &mut all,
        );
        assert_eq!(gone + all.len(), 320);
        assert!(
            all.attributes
                .values()
                .all(|column| column.len() == all.len())
        );
        let cell = |x: &[f32; 3]| x.map(|x| x as i32);
        all.position.iter().map(cell).collect()
    }

    #[test]
    fn whitewater_ends_in_a_box_of_the_world() {
        let room = KillRoom::Block(Bounds {
            min: DVec3::new(102.0, 1.0, 0.0),
            max: DVec3::new(104.0, 2.0, 8.0),
        });
        let kept = left(&room, &DOMAIN, (0.0, None));
        let is_in = |[x, y, _]: &[i32; 3]| (2..4).contains(x) && *y == 1;
        assert_eq!(kept.len(), 320 - 16);
        assert!(!kept.iter().any(is_in));
        // Control: in the particles' own coordinates the box is elsewhere.
        let here = KillDomain {
            origin: DVec3::ZERO,
            ..DOMAIN
        };
        assert_eq!(left(&room, &here, (0.0, None)).len(), 320);
    }

    #[test]
    fn whitewater_ends_in_a_mesh_of_the_world() {
        let mesh = KillMesh {
            file: PathBuf::new(),
            file_hash: String::new(),
            translate: [0.0; 3],
            rotate_degrees: [0.0; 3],
            scale: [1.0; 3],
            mesh: sphere(DVec3::new(105.0, 2.0, 4.0), 1.75, 24),
        };
        let room = KillRoom::Mesh(Arc::new(mesh));
        let is_in = |[x, y, z]: &[i32; 3]| {
            let at = DVec3::from([*x, *y, *z].map(|c| f64::from(c) + 0.5));
            // No centre of a cell is as far from the middle as the sphere's surface, 1.75.
            at.distance(DVec3::new(5.0, 2.0, 4.0)) < 1.75
        };
        let kept = left(&room, &DOMAIN, (0.0, None));
        assert!(!kept.iter().any(is_in));
        // 8 at √0.75 and 24 at √2.75 from the middle.
        assert_eq!(kept.len(), 320 - 32);
    }

    #[test]
    fn whitewater_ends_at_the_sides_that_are_walls() {
        let sides = KillRoom::Sides(1.0);
        let kept = left(&sides, &DOMAIN, (0.0, None));
        let is_inside = |[x, _, z]: &[i32; 3]| (1..9).contains(x) && (1..7).contains(z);
        assert_eq!(kept.len(), 8 * 4 * 6);
        assert!(kept.iter().all(is_inside));
        let periodic = KillDomain {
            periodic: [true, false, false],
            ..DOMAIN
        };
        assert_eq!(left(&sides, &periodic, (0.0, None)).len(), 10 * 4 * 6);
    }

    #[test]
    fn a_kill_volume_acts_in_its_window_only() {
        let sides = KillRoom::Sides(20.0);
        for (window, count) in [
            ((0.0, None), 0),
            ((0.5, Some(1.0)), 0),
            ((1.0, None), 320),
            ((0.0, Some(0.9)), 320),
        ] {
            assert_eq!(left(&sides, &DOMAIN, window).len(), count, "{window:?}");
        }
    }
}
