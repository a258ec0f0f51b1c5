//! Scene-independent measurements of particles for stability studies.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use swell_domain::bounds::Bounds;

/// Distance in spacings within which the nearest particle is searched.
const REACH: f64 = 2.0;

/// A position in f64.
pub fn point(p: &[f32; 3]) -> DVec3 {
    Vec3::from_array(*p).as_dvec3()
}

/// Least distance between two particles, in units of `spacing`; 2 if none are closer or there is
/// only one.
pub fn least_spacing(position: &[[f32; 3]], spacing: f64) -> f64 {
    let edge = REACH * spacing;
    let cell = |p: DVec3| (p / edge).floor().as_i64vec3().to_array();
    let mut cells: HashMap<[i64; 3], Vec<DVec3>> = HashMap::new();
    let mut least = edge;
    for p in position.iter().map(point).filter(|p| p.is_finite()) {
        let [x, y, z] = cell(p);
        for k in 0..27 {
            let near = cells.get(&[x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]);
            for other in near.into_iter().flatten() {
                least = least.min(p.distance(*other));
            }
        }
        cells.entry([x, y, z]).or_default().push(p);
    }
    least / spacing
}

/// Volume that the water takes up, relative to the rest volume of its particles; `None` if no cell
/// is full.
///
/// Counts the cells (two spacings wide) that hold water and whose 26 neighbours hold water or lie
/// outside the box, and divides by their total density: trilinear (hat) weights relative to a full
/// cell, mirrored at the walls. Positions are relative to the box's own origin.
pub fn filled_volume(position: &[[f32; 3]], spacing: f64, domain: &Bounds) -> Option<f64> {
    let edge = 2.0 * spacing;
    let dims = (domain.size() / edge).round().as_i64vec3().to_array();
    let mut cells: HashMap<[i64; 3], (bool, f64)> = HashMap::new();
    for p in position.iter().map(point) {
        let place = (p - domain.min) / edge;
        let own = place.floor().as_i64vec3().to_array();
        let held = [0, 1, 2].map(|axis| own[axis].clamp(0, dims[axis] - 1));
        cells.entry(held).or_default().0 = true;
        let low = (place - 0.5).floor();
        let part = place - 0.5 - low;
        for corner in 0..8u32 {
            let mut weight = 0.125;
            let cell = [0, 1, 2].map(|axis| {
                let is_high = corner >> axis & 1 == 1;
                weight *= if is_high {
                    part[axis]
                } else {
                    1.0 - part[axis]
                };
                (low[axis] as i64 + i64::from(is_high)).clamp(0, dims[axis] - 1)
            });
            cells.entry(cell).or_default().1 += weight;
        }
    }
    let holds_water = |c: [i64; 3]| {
        let is_out = (0..3).any(|axis| !(0..dims[axis]).contains(&c[axis]));
        is_out || cells.get(&c).is_some_and(|(has_water, _)| *has_water)
    };
    let is_filled = |[x, y, z]: [i64; 3]| {
        (0..27).all(|k| holds_water([x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]))
    };
    // Sorted by cell, because sums of f64 depend on the order.
    let mut filled: Vec<_> = cells.iter().filter(|(cell, _)| is_filled(**cell)).collect();
    filled.sort_by_key(|(cell, _)| **cell);
    let sum: f64 = filled.iter().map(|(_, (_, density))| density).sum();
    (!filled.is_empty()).then(|| filled.len() as f64 / sum)
}

/// Number of particles outside of a box.
pub fn outside(position: &[[f32; 3]], bounds: &Bounds) -> usize {
    position
        .iter()
        .filter(|p| !bounds.contains(point(p)))
        .count()
}

/// Finds for each particle of `ours` the one of `theirs` that starts at the same position, where
/// `of` maps their positions to ours; `None` if there is none within a quarter of `spacing`. If
/// several share a position, each is used once, in order.
pub fn matched(
    ours: &[[f32; 3]],
    theirs: &[[f32; 3]],
    of: impl Fn(DVec3) -> DVec3,
    spacing: f64,
) -> Vec<Option<usize>> {
    let near = 0.25 * spacing;
    let cell = |p: DVec3| (p / near).floor().as_i64vec3().to_array();
    let mut cells: HashMap<[i64; 3], Vec<(DVec3, usize)>> = HashMap::new();
    for (k, p) in theirs.iter().enumerate().rev() {
        let p = of(point(p));
        cells.entry(cell(p)).or_default().push((p, k));
    }
    let find = |p: &[f32; 3]| {
        let p = point(p);
        let [x, y, z] = cell(p);
        let around = (0..27).map(|k| [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1]);
        let mut best: Option<(f64, [i64; 3], usize)> = None;
        for key in around {
            for (place, (other, _)) in cells.get(&key).into_iter().flatten().enumerate() {
                let distance = p.distance(*other);
                // Among equally close ones take the later, because the cell lists are in reverse
                // order.
                if distance <= near && best.is_none_or(|(least, ..)| distance <= least) {
                    best = Some((distance, key, place));
                }
            }
        }
        let (_, key, place) = best?;
        Some(cells.get_mut(&key)?.remove(place).1)
    };
    ours.iter().map(find).collect()
}

/// Ballistic particle paths by symplectic Euler: in n equal substeps of a frame of T seconds x += v
/// T + g T² (n + 1) / 2n, and v += g T.
#[derive(Clone, Debug)]
pub struct Flight {
    position: Vec<DVec3>,
    velocity: Vec<DVec3>,
    way: Vec<f64>,
}

impl Flight {
    /// Starts from these positions (metres) and velocities (m/s).
    pub fn new(position: &[[f32; 3]], velocity: &[[f32; 3]]) -> Self {
        Self {
            position: position.iter().map(point).collect(),
            velocity: velocity.iter().map(point).collect(),
            way: vec![0.0; position.len()],
        }
    }

    /// Advances by one frame.
    pub fn advance(&mut self, gravity: DVec3, seconds: f64, substeps: u32) {
        let n = f64::from(substeps.max(1));
        let fall = gravity * seconds * seconds * (n + 1.0) / (2.0 * n);
        let all = self.position.iter_mut().zip(&mut self.velocity);
        for ((x, v), way) in all.zip(&mut self.way) {
            let step = *v * seconds + fall;
            *x += step;
            *way += step.length();
            *v += gravity * seconds;
        }
    }

    /// Largest distance of a particle from its parabola, relative to the length of the path.
    pub fn error(&self, position: &[[f32; 3]]) -> f64 {
        let all = self.position.iter().zip(&self.way).zip(position);
        all.map(|((x, way), p)| x.distance(point(p)) / way)
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_two_are_found_across_cells() {
        let mut points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
        assert_eq!(least_spacing(&points, 1.0), 1.0);
        assert_eq!(least_spacing(&points[..1], 1.0), 2.0);
        points.push([1.0, 0.0, -0.25]);
        assert_eq!(least_spacing(&points, 1.0), 0.25);
        points.push([0.0, 0.0, 0.0]);
        assert_eq!(least_spacing(&points, 1.0), 0.0);
    }

    #[test]
    fn a_lattice_fills_its_volume_and_a_compressed_one_less() {
        let domain = Bounds {
            min: DVec3::ZERO,
            max: DVec3::new(8.0, 12.0, 8.0),
        };
        let lattice = |height: f32| -> Vec<[f32; 3]> {
            let layer = |y: u16| (0..64u16).map(move |k| (k % 8, y, k / 8));
            let at = |(x, y, z): (u16, u16, u16)| {
                let [x, y, z] = [x, y, z].map(|n| f32::from(n) + 0.5);
                [x, height * y, z]
            };
            (0..8).flat_map(layer).map(at).collect()
        };
        assert_eq!(filled_volume(&lattice(1.0), 1.0, &domain), Some(1.0));
        // By hand: the cells below the topmost hold 1.1, 1.1125 and 1.1375 of a full cell's
        // density: half of the hat weights at 1, 3 and 5 of layers at 0.45, 1.35, 2.25 and so on;
        // what the floor mirrors counts towards the first.
        let pressed = filled_volume(&lattice(0.9), 1.0, &domain).unwrap();
        assert!((pressed - 3.0 / 3.35).abs() < 1e-6, "{pressed}");
        assert_eq!(filled_volume(&[[0.5; 3]], 1.0, &domain), None);
    }

    #[test]
    fn particles_are_matched_by_where_they_start() {
        let ours = [
            [0.0f32, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [5.0, 0.0, 0.0],
        ];
        let theirs = [
            [12.0f32, 0.0, 0.0],
            [10.0, 0.02, 0.0],
            [12.0, 0.0, 0.0],
            [99.0, 0.0, 0.0],
        ];
        let map = |p: DVec3| (p - DVec3::new(10.0, 0.0, 0.0)) / 2.0;
        let found = matched(&ours, &theirs, map, 1.0);
        assert_eq!(found, [Some(1), Some(0), Some(2), None]);
    }

    #[test]
    fn a_flight_is_that_of_its_substeps() {
        let (x, v) = ([0.0f32, 10.0, 0.0], [1.0f32, 2.0, 0.0]);
        let gravity = DVec3::new(0.0, -10.0, 0.0);
        for substeps in [1, 4] {
            let mut flight = Flight::new(&[x], &[v]);
            let (mut place, mut speed) = (point(&x), point(&v));
            let dt = 0.5 / f64::from(substeps);
            for _ in 0..3 {
                for _ in 0..substeps {
                    speed += gravity * dt;
                    place += speed * dt;
                }
                flight.advance(gravity, 0.5, substeps);
            }
            assert!(flight.error(&[place.as_vec3().to_array()]) < 1e-6);
            // Negative control: explicit Euler is half a metre a second off.
            let other = place - gravity * dt * 1.5;
            assert!(flight.error(&[other.as_vec3().to_array()]) > 1e-2);
        }
    }
}
