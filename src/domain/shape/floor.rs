//! A floor that moves as the water of waves does at its height.
//!
//! Little moves deep below the surface, but a floor at rest there makes waves of a given length
//! slower, by 1.8 % at a depth of two over the wave number (c² = g/k tanh kd). A floor that moves
//! with the water does not change the flow above it, because no water crosses it.
//!
//! The material surface of mean height y is at y + ∫ v dt, with v of linear theory at y (Dean and
//! Dalrymple 1991, §4); the error is the floor's motion times the steepness.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::{
    super::{
        bounds::Bounds, mesh::TriangleMesh, open_waves::OpenWaves, parallel,
        signed_distance::SignedDistance,
    },
    field::{Key, Keys, Nodes},
    samples::{SurfacePoint, SurfaceSamples},
};

/// Thickness at least of what is below the floor, particle spacings: two cells, so that the
/// distance has both signs at nodes around any point of it.
const LAYERS: f64 = 4.0;

/// Waves that move the floor by less than this are left out, particle spacings.
const NOTHING: f64 = 1e-4;

/// Keys per period of the waves that move the floor. Between keys it moves evenly, so that it is at
/// most (2π / 24)² / 8 = 0.9 % of its motion off.
const KEYS_PER_PERIOD: f64 = 24.0;

/// A floor that moves with the water.
#[derive(Clone, Debug, PartialEq)]
pub struct WaveFloor {
    /// Waves whose elevation is that of the floor above its mean height.
    waves: Vec<OpenWaves>,
    /// Box of the water.
    domain: Bounds,
    /// Mean height above the least corner of the domain, metres.
    mean: f64,
    /// Bound on how far it moves either way, metres.
    most: f64,
    /// Bound on its speed, m/s.
    speed: f64,
    /// Particle spacing, metres.
    spacing: f64,
    /// Keys a second.
    rate: f64,
}

impl WaveFloor {
    /// Lays a floor below waves, as low in `domain` as its motion permits.
    pub fn new(waves: &[OpenWaves], domain: &Bounds, spacing: f64) -> Self {
        let most = |y: f64| waves.iter().map(|it| it.most_displacement(y)).sum::<f64>();
        // Its motion grows with its height, by less than the height because waves are not so steep.
        let mut mean = LAYERS * spacing;
        for _ in 0..64 {
            mean = LAYERS * spacing + most(mean);
        }
        let least = NOTHING * spacing;
        let waves: Vec<_> = waves.iter().map(|it| it.layer(mean, least)).collect();
        let lines = waves.iter().flat_map(|it| {
            // A ramp rises no faster than 2 / its length.
            let grows = if it.ramp() > 0.0 {
                2.0 / it.ramp()
            } else {
                0.0
            };
            let lines = it.lines.iter();
            lines.map(move |line| (line.elevation.abs(), line.frequency + grows))
        });
        let (most, speed) = lines.fold((0.0, 0.0), |(most, speed), (a, rate)| {
            (most + a, speed + a * rate)
        });
        let rate = match most > 0.0 {
            true => (KEYS_PER_PERIOD * speed / most / TAU).max(speed / spacing),
            false => 1.0,
        };
        Self {
            waves,
            domain: *domain,
            mean,
            most,
            speed,
            spacing,
            rate,
        }
    }

    /// Returns the mean height above the domain's least corner, and the bound on the distance that
    /// the floor moves from there, metres.
    pub fn heights(&self) -> [f64; 2] {
        [self.mean, self.most]
    }

    /// Bounds the floor's speed, m/s.
    pub fn peak_speed(&self) -> f64 {
        self.speed
    }

    /// Returns the floor in coordinates with another origin.
    #[must_use]
    pub fn moved(&self, way: DVec3) -> Self {
        Self {
            domain: self.domain.moved(way),
            ..self.clone()
        }
    }

    /// Returns the box that the floor and what is below it fill.
    pub fn bounds(&self) -> Bounds {
        let mut bounds = self.domain;
        bounds.max.y = bounds.min.y + self.mean + self.most;
        bounds
    }

    /// Returns the height at x and z, metres, and its slopes along both.
    fn height(&self, at: DVec2, time: f64) -> (f64, DVec2) {
        let least = self.domain.min;
        let place = at - DVec2::new(least.x, least.z);
        let waves = self.waves.iter();
        let (rise, slope) = waves.fold((0.0, DVec2::ZERO), |(rise, slope), it| {
            (
                rise + it.elevation(place, time),
                slope + it.slope(place, time),
            )
        });
        (least.y + self.mean + rise, slope)
    }

    /// Returns the volume between the floor at the start and that of a box within the domain, m³,
    /// by the midpoint rule.
    pub fn volume(&self, room: &Bounds) -> f64 {
        let size = room.size();
        let [nx, nz] = [size.x, size.z].map(|edge| (edge / self.spacing).ceil().max(1.0) as usize);
        let step = DVec2::new(size.x / nx as f64, size.z / nz as f64);
        let heights = (0..nx * nz).map(|n| {
            let cell = DVec2::new((n % nx) as f64, (n / nx) as f64) + 0.5;
            let at = DVec2::new(room.min.x, room.min.z) + cell * step;
            self.height(at, 0.0).0 - room.min.y
        });
        step.x * step.y * heights.sum::<f64>()
    }

    /// Returns points of a lattice in the water below the floor that is not simulated, down to the
    /// domain's.
    pub fn water_below(&self, time: f64) -> Vec<[f32; 3]> {
        let (columns, bottom) = (self.samples(), self.domain.min.y);
        parallel::flat_map(0..columns.count(), |n| {
            let at = columns.position(n);
            let height = self.height(at, time).0;
            // Layers follow the floor, so that none appears at its surface.
            let layers = ((height - bottom) / self.spacing + 0.5).max(0.0);
            (0..layers as usize).map(move |layer| {
                let y = height - (layer as f64 + 0.5) * self.spacing;
                [at.x as f32, y as f32, at.y as f32]
            })
        })
    }

    /// Returns the closed mesh of what is below the floor at a time, seconds, down to `margin`
    /// metres below the domain and as far beyond its sides.
    pub fn mesh(&self, time: f64, margin: f64) -> TriangleMesh {
        let around = self.domain.grown(margin);
        let size = around.size();
        let step = LAYERS * self.spacing;
        let [nx, nz] = [size.x, size.z].map(|edge| (edge / step).ceil().max(1.0) as u32);
        let corner = DVec2::new(around.min.x, around.min.z);
        let counts = DVec2::new(f64::from(nx), f64::from(nz));
        let mut points = Vec::with_capacity((nx as usize + 1) * (nz as usize + 1));
        for k in 0..=nz {
            for i in 0..=nx {
                let part = DVec2::new(f64::from(i), f64::from(k)) / counts;
                let at = corner + part * DVec2::new(size.x, size.z);
                points.push(DVec3::new(at.x, self.height(at, time).0, at.y));
            }
        }
        let mut mesh = TriangleMesh::between_sheets(points, [nx, nz], around.min.y);
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        mesh
    }

    /// Returns samples of the floor within the domain, a particle spacing apart.
    pub fn samples(&self) -> FloorSamples {
        let size = self.domain.size();
        let counts = [size.x, size.z].map(|edge| (edge / self.spacing).round().max(1.0) as usize);
        FloorSamples {
            floor: self.clone(),
            counts,
        }
    }
}

impl Keys for WaveFloor {
    fn place(&self, time: f64) -> (Key, f64) {
        let at = time.max(0.0) * self.rate;
        let index = at.floor();
        let key = Key {
            index: index as usize,
            part: 0,
        };
        (key, at - index)
    }

    fn after(&self, key: Key) -> Key {
        Key {
            index: key.index + 1,
            ..key
        }
    }

    fn duration(&self, _key: Key) -> f64 {
        1.0 / self.rate
    }

    fn sampled(&self, grid: &SignedDistance, key: Key) -> Nodes {
        let [nx, ny, nz] = grid.dims;
        let [before, now] = [key.index.saturating_sub(1), key.index].map(|k| k as f64 / self.rate);
        // Height, cosine of the slope's angle, vertical velocity.
        let columns = parallel::map(0..nx * nz, |n| {
            let at = DVec2::new((n % nx) as f64, (n / nx) as f64) * grid.spacing
                + DVec2::new(grid.origin.x, grid.origin.z);
            let ((height, slope), (earlier, _)) = (self.height(at, now), self.height(at, before));
            let cosine = 1.0 / (1.0 + slope.length_squared()).sqrt();
            [height, cosine, (height - earlier) * self.rate]
        });
        let column = |n: usize| &columns[n % nx + nx * (n / (nx * ny))];
        let y = |n: usize| grid.origin.y + grid.spacing * (n / nx % ny) as f64;
        let nodes = 0..nx * ny * nz;
        Nodes {
            distance: parallel::map(nodes.clone(), |n| {
                let [height, cosine, _] = *column(n);
                ((y(n) - height) * cosine) as f32
            }),
            velocity: parallel::map(nodes, |n| [0.0, column(n)[2] as f32, 0.0]),
        }
    }
}

/// Samples of a floor that stay where they are along x and z.
#[derive(Clone, Debug)]
pub struct FloorSamples {
    floor: WaveFloor,
    /// Samples along x and z.
    counts: [usize; 2],
}

impl FloorSamples {
    /// Lengths that a sample stands for along x and z, metres.
    fn edge(&self) -> DVec2 {
        let (size, [nx, nz]) = (self.floor.domain.size(), self.counts);
        DVec2::new(size.x / nx as f64, size.z / nz as f64)
    }

    /// x and z of a sample, metres.
    fn position(&self, n: usize) -> DVec2 {
        let (least, [nx, _]) = (self.floor.domain.min, self.counts);
        let cell = DVec2::new((n % nx) as f64, (n / nx) as f64) + 0.5;
        DVec2::new(least.x, least.z) + cell * self.edge()
    }
}

impl SurfaceSamples for FloorSamples {
    fn count(&self) -> usize {
        self.counts[0] * self.counts[1]
    }

    fn at(&self, time: f64, step: f64) -> Vec<SurfacePoint> {
        let (floor, edge) = (&self.floor, self.edge());
        parallel::map(0..self.count(), |n| {
            let at = self.position(n);
            let (height, slope) = floor.height(at, time);
            let rise = match step {
                0.0 => 0.0,
                step => (height - floor.height(at, time - step).0) / step,
            };
            SurfacePoint {
                position: DVec3::new(at.x, height, at.y),
                area: edge.x * edge.y * (1.0 + slope.length_squared()).sqrt(),
                velocity: DVec3::new(0.0, rise, 0.0),
            }
        })
    }
}

#[cfg(test)]
mod tests;
