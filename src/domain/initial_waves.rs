//! Waves that are on the water when a shot begins.

use glam::{DVec2, DVec3};

use super::{
    bounds::Bounds, mesh::TriangleMesh, open_waves::OpenWaves, solitary_wave::SolitaryWave,
};

/// One of the waves on the water at the start. Positions are metres from the domain's least
/// corner, with x and z horizontal and y upward from the floor.
#[derive(Clone, Debug, PartialEq)]
pub enum InitialWave {
    /// A solitary wave.
    Solitary {
        /// Its shape and velocities.
        wave: SolitaryWave,
        /// Unit vector along x and z, to which it travels.
        direction: DVec2,
        /// Distance of the crest from the origin in that direction, metres.
        crest: f64,
    },
    /// Waves of linear or second-order theory, at time 0.
    Open(OpenWaves),
}

impl InitialWave {
    /// Returns the height of still water above the domain's floor, metres.
    pub fn level(&self) -> f64 {
        match self {
            Self::Solitary { wave, .. } => wave.depth,
            Self::Open(waves) => waves.level(),
        }
    }

    fn elevation(&self, at: DVec2) -> f64 {
        match self {
            Self::Solitary {
                wave,
                direction,
                crest,
            } => wave.elevation(direction.dot(at) - crest),
            Self::Open(waves) => waves.elevation(at, 0.0),
        }
    }

    fn velocity(&self, place: DVec3) -> DVec3 {
        match self {
            Self::Solitary {
                wave,
                direction,
                crest,
            } => {
                let distance = direction.dot(DVec2::new(place.x, place.z)) - crest;
                let [along, upward] = wave.velocity(distance, place.y);
                DVec3::new(along * direction.x, upward, along * direction.y)
            }
            Self::Open(waves) => waves.velocity(place, 0.0),
        }
    }
}

/// Waves on water of one level; elevations and velocities add up.
#[derive(Clone, Debug, PartialEq)]
pub struct InitialWaves {
    waves: Vec<InitialWave>,
    level: f64,
}

impl InitialWaves {
    /// The sum of some waves; `None` without any, or if their levels differ.
    pub fn new(waves: Vec<InitialWave>) -> Option<Self> {
        let level = waves.first()?.level();
        let is_one = waves.iter().all(|wave| wave.level() == level);
        is_one.then_some(Self { waves, level })
    }

    /// Returns the height of the surface above the floor, metres.
    pub fn surface(&self, at: DVec2) -> f64 {
        self.level
            + self
                .waves
                .iter()
                .map(|wave| wave.elevation(at))
                .sum::<f64>()
    }

    /// Returns the velocity of the water, m/s.
    pub fn velocity(&self, place: DVec3) -> DVec3 {
        self.waves.iter().map(|wave| wave.velocity(place)).sum()
    }

    /// Returns the surface over the whole of `room` and `margin` metres beyond its sides, sampled
    /// every `spacing` metres or less. `floor` is the domain's least corner, from which waves are
    /// measured.
    pub fn over(&self, room: &Bounds, floor: DVec3, margin: f64, spacing: f64) -> WaveSurface {
        let around = room.grown(margin);
        let count = |axis: usize| (around.size()[axis] / spacing).ceil().max(1.0) as u32;
        let counts = [count(0), count(2)];
        let step = DVec2::new(
            around.size().x / f64::from(counts[0]),
            around.size().z / f64::from(counts[1]),
        );
        let corner = DVec2::new(around.min.x, around.min.z);
        let mut points = Vec::with_capacity((counts[0] as usize + 1) * (counts[1] as usize + 1));
        for k in 0..=counts[1] {
            for i in 0..=counts[0] {
                let at = corner + step * DVec2::new(f64::from(i), f64::from(k));
                let height = self.surface(at - DVec2::new(floor.x, floor.z));
                points.push(DVec3::new(at.x, floor.y + height, at.y));
            }
        }
        WaveSurface { points, counts }
    }

    /// Returns the volume below the surface within `room`, m³, by the midpoint rule on squares of
    /// about `spacing` metres.
    pub fn volume(&self, room: &Bounds, floor: DVec3, spacing: f64) -> f64 {
        let size = room.size();
        let [nx, nz] = [size.x, size.z].map(|edge| (edge / spacing).ceil().max(1.0));
        let step = DVec2::new(size.x / nx, size.z / nz);
        let corner = DVec2::new(room.min.x - floor.x, room.min.z - floor.z);
        let height = |i: u32, k: u32| {
            let at = corner + step * (DVec2::new(f64::from(i), f64::from(k)) + 0.5);
            (floor.y + self.surface(at) - room.min.y).clamp(0.0, size.y)
        };
        let columns = (0..nz as u32).flat_map(|k| (0..nx as u32).map(move |i| (i, k)));
        step.x * step.y * columns.map(|(i, k)| height(i, k)).sum::<f64>()
    }
}

/// The surface of waves over a rectangle.
pub struct WaveSurface {
    /// Points, x fastest.
    points: Vec<DVec3>,
    /// Squares along x and z.
    counts: [u32; 2],
}

impl WaveSurface {
    /// Returns the height of the highest point, metres in the world.
    pub fn highest(&self) -> f64 {
        let heights = self.points.iter().map(|p| p.y);
        heights.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Returns the closed mesh of the air above the surface, up to `top` metres in the world, which
    /// lies above it.
    pub fn air(&self, top: f64) -> TriangleMesh {
        TriangleMesh::between_sheets(self.points.clone(), self.counts, top)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solitary(degrees: f64, crest: f64) -> InitialWave {
        InitialWave::Solitary {
            wave: SolitaryWave {
                height: 0.2,
                depth: 1.0,
                gravity: 9.81,
            },
            direction: DVec2::from_angle(f64::to_radians(degrees)),
            crest,
        }
    }

    fn room() -> Bounds {
        Bounds {
            min: DVec3::new(2.0, 1.0, -3.0),
            max: DVec3::new(22.0, 4.0, 1.0),
        }
    }

    #[test]
    fn the_air_is_closed_and_its_volume_is_what_the_water_leaves() {
        let waves = InitialWaves::new(vec![solitary(0.0, 8.0), solitary(60.0, 3.0)]);
        let (waves, room) = (waves.expect("one depth"), room());
        let surface = waves.over(&room, room.min, 0.0, 0.05);
        let air = surface.air(room.max.y);
        assert!(air.open_edges().is_empty());
        let (air, water) = (air.signed_volume(), waves.volume(&room, room.min, 0.05));
        // Trapezoids and midpoints err by h² / 12 and h² / 24 of the curvature, below 1 / m.
        let tolerance = room.size().x * room.size().z * 0.05f64.powi(2) / 8.0;
        assert!(
            (air + water - room.volume()).abs() < tolerance,
            "{air} {water}"
        );
        assert!(water > 1.01 * room.size().x * room.size().z, "{water}");
    }

    #[test]
    fn waves_add_up_and_share_one_depth() {
        let (one, other) = (solitary(0.0, 8.0), solitary(180.0, -8.0));
        let both = InitialWaves::new(vec![one.clone(), other.clone()]).expect("one depth");
        let (at, place) = (DVec2::new(7.0, 0.5), DVec3::new(7.0, 0.4, 0.5));
        let sum = 1.0 + one.elevation(at) + other.elevation(at);
        assert!((both.surface(at) - sum).abs() < 1e-15);
        // Mirror images: at the crest they rise as one, and their currents cancel.
        let there = DVec3::new(8.0, 0.4, 0.5);
        assert!(both.velocity(there).length() < 1e-15);
        assert!(both.velocity(place) == one.velocity(place) + other.velocity(place));
        let deeper = InitialWave::Solitary {
            wave: SolitaryWave {
                height: 0.2,
                depth: 1.1,
                gravity: 9.81,
            },
            direction: DVec2::X,
            crest: 0.0,
        };
        assert!(InitialWaves::new(vec![one, deeper]).is_none());
        assert!(InitialWaves::new(Vec::new()).is_none());
    }
}
