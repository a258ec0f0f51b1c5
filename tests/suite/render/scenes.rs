//! Synthetic water and sets, so that pictures need no solver.

use glam::DVec3;
use swell::domain::bounds::Bounds;
use swell::domain::mesh::TriangleMesh;
use swell::domain::particles::Particles;
use swell::render::RenderScene;

/// A box of twelve triangles, counter-clockwise from outside.
pub(crate) fn box_mesh(low: DVec3, high: DVec3) -> TriangleMesh {
    let vertices = (0..8)
        .map(|i| {
            let pick = |axis: usize| {
                if i >> axis & 1 == 1 {
                    high[axis]
                } else {
                    low[axis]
                }
            };
            DVec3::new(pick(0), pick(1), pick(2))
        })
        .collect();
    let quads = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    TriangleMesh {
        vertices,
        triangles: quads
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect(),
    }
}

/// A lattice that fills a box from `low`.
pub(crate) fn slab(low: DVec3, size: DVec3, spacing: f64) -> Particles {
    let mut water = Particles::default();
    let count = (size / spacing).round().as_uvec3();
    for x in 0..count.x {
        for y in 0..count.y {
            for z in 0..count.z {
                let p = low + (DVec3::new(x.into(), y.into(), z.into()) + 0.5) * spacing;
                push(&mut water, p, DVec3::ZERO);
            }
        }
    }
    water
}

fn push(water: &mut Particles, p: DVec3, v: DVec3) {
    water.position.push(p.as_vec3().to_array());
    water.velocity.push(v.as_vec3().to_array());
    water.id.push(water.id.len() as u32);
}

struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }
}

/// Box buildings in streets, x 16 to 24.5 m, z 0.5 to 14.5 m.
pub(crate) fn city_scene() -> RenderScene {
    let mut random = Random(3);
    let mut solids = Vec::new();
    for i in 0..4 {
        for j in 0..6 {
            let x = 16.0 + 2.15 * f64::from(i);
            let z = 0.5 + 2.4 * f64::from(j);
            let height = 1.0 + 5.0 * random.next() * (0.45 + 0.18 * f64::from(i));
            let inset = 0.25 * random.next();
            solids.push(box_mesh(
                DVec3::new(x + inset, 0.0, z + inset),
                DVec3::new(x + 1.6, height, z + 1.85),
            ));
        }
    }
    RenderScene {
        origin: DVec3::ZERO,
        domain: Bounds {
            min: DVec3::ZERO,
            max: DVec3::new(25.0, 12.6, 15.0),
        },
        solids,
        wet: None,
        parts: Vec::new(),
        particle_spacing: 0.17,
        frames_per_second: 60.0,
        gravity: DVec3::new(0.0, -9.81, 0.0),
        wave_makers: Vec::new(),
        moving: Vec::new(),
        waves: None,
    }
}

/// A metre of water with a crest of 1.4 m at x = 11.5 m, jittered, and drops flung from the crest.
pub(crate) fn city_water() -> Particles {
    let spacing = 0.17;
    let mut random = Random(11);
    let mut water = Particles::default();
    let mut x = 1.2f64;
    while x < 14.8 {
        let mut z: f64 = 0.5 * spacing;
        while z < 15.0 {
            let bent = x - 0.35 * (0.9 * z).sin() - 0.25 * (2.3 * z + 1.0).sin();
            let crest = 1.4 / (0.85 * (bent - 11.5)).cosh().powi(2);
            let still = 1.0 + 0.05 * (1.7 * x + 0.8 * z).sin() + 0.03 * (3.1 * z - x).sin();
            let front = ((14.8 - bent) / 2.0).clamp(0.0, 1.0).sqrt();
            let depth = (still + crest) * front;
            let mut y = 0.5 * spacing;
            while y < depth {
                let mut jitter = || (random.next() - 0.5) * 0.35 * spacing;
                let p = DVec3::new(x + jitter(), (y + jitter()).max(0.05), z + jitter());
                let speed = 0.4 + 3.6 * crest / 1.4 * (y / depth);
                push(&mut water, p, DVec3::new(speed, 0.3 * crest, 0.0));
                y += spacing;
            }
            z += spacing;
        }
        x += spacing;
    }
    for _ in 0..900 {
        let z = 15.0 * random.next();
        let t = 0.5 * random.next();
        let v = DVec3::new(
            4.0 + 2.0 * random.next(),
            1.0 + 3.5 * random.next(),
            random.next() - 0.5,
        );
        let start = DVec3::new(11.7 + 0.35 * (0.9 * z).sin(), 2.2, z);
        let p = start + v * t + DVec3::new(0.0, -4.9 * t * t, 0.0);
        push(&mut water, p, v - DVec3::new(0.0, 9.81 * t, 0.0));
    }
    water
}
