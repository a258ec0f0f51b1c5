//! Measures a frame's wave and splash from its particles only, so that every solver is measured
//! alike. Height is along y.
//!
//! Space is divided into cubes two particle spacings wide, which hold 8 particles at rest. A cube
//! that is at least half full is water, and the largest face-connected body of such cubes is the
//! continuous water. The elevation η of a column is the top of that body, with the fill of its top
//! cubes as a fraction: the height function of volume-of-fluid methods (Torrey et al. 1985). It is
//! smoothed once by the binomial filter ¼ ½ ¼ along both axes, because single particles make steps
//! of half a cube.

use rayon::prelude::*;

use super::{median, percentile};
use swell_domain::{aggregates::Aggregates, bounds::Bounds, particles::Particles, probe::energies};

/// Most cubes; a larger domain is measured with larger cubes.
const MAX_CUBES: f64 = (1u64 << 27) as f64;

/// Edge of a cube in particle spacings.
const EDGE_SPACINGS: f64 = 2.0;

/// Fraction of a cube's particles at rest from which on it counts as water.
const HALF_FULL: f64 = 0.5;

/// Fractions of the crest's height between which its front face is measured.
const FACE: [f64; 2] = [0.9, 0.5];

/// Fraction of the particles that lies within the splash's height and reach.
const NEARLY_ALL: f64 = 0.999;

/// Direction in which the wave travels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Direction {
    /// 0 for x, 2 for z.
    pub axis: usize,
    /// Whether towards greater coordinates.
    pub is_forward: bool,
}

/// Measurements of one frame. Lengths are in metres, heights above the still level, distances along
/// the wave's direction from the domain's face behind it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measures {
    /// Height of the crest: highest η of each row along the wave's direction, median over the rows.
    pub crest_height: f64,
    /// Slope of the crest's front face, degrees, between the foremost points of a row that reach
    /// 0.9 and 0.5 of its crest's height; median over the rows.
    ///
    /// The crest front steepness of Kjeldsen and Myrhaug (1979) runs from the crest to the zero
    /// crossing instead; a bore has a plateau for a crest and may run over a dry bed, which has no
    /// crossing. `None` if fewer than half of the rows have a crest higher than a cube.
    pub crest_slope: Option<f64>,
    /// How far the wave has come: the foremost point of a row that reaches half of its crest's
    /// height, median over the rows. The thin tongue that runs ahead over a dry bed does not count.
    /// `None` as for the slope.
    pub front: Option<f64>,
    /// Height that 99.9 % of the particles do not exceed.
    pub splash_height: f64,
    /// Distance that 99.9 % of the particles do not exceed.
    pub splash_reach: f64,
    /// Fraction of the particles farther than a cube from the continuous water.
    pub airborne: f64,
    /// Ground area with any water above it, m².
    pub wet_area: f64,
    /// Volume of the continuous water, m³: its cubes, with the top ones of each column weighted by
    /// their fill.
    pub volume: f64,
}

/// Measures the frames of one scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Gauge {
    domain: Bounds,
    direction: Direction,
    edge: f64,
    /// Number of cubes along the wave's direction, upwards and across.
    dims: [usize; 3],
    still: f64,
}

impl Gauge {
    /// A gauge for particles `spacing` metres apart at rest. Of several lattices take the coarsest,
    /// so that all are measured with the same cubes. The still level is the domain's floor.
    pub fn new(domain: Bounds, direction: Direction, spacing: f64) -> Self {
        let mut edge = EDGE_SPACINGS * spacing;
        let size = domain.size();
        let cubes = |edge: f64| (size / edge).ceil().max(glam::DVec3::ONE);
        while cubes(edge).element_product() > MAX_CUBES {
            edge *= 2.0;
        }
        let across = 2 - direction.axis;
        let dims = [direction.axis, 1, across].map(|axis| cubes(edge)[axis] as usize);
        Self {
            domain,
            direction,
            edge,
            dims,
            still: 0.0,
        }
    }

    /// Sets the still level, metres above the domain's floor.
    pub fn with_still_level(self, still: f64) -> Self {
        Self { still, ..self }
    }

    /// Depth of water at rest, metres: the median over its columns. `spacing` is the particle
    /// spacing, metres.
    pub fn depth(&self, position: &[[f32; 3]], spacing: f64) -> f64 {
        let depths = self.water(position, spacing).elevation.into_iter();
        median(depths.flatten().collect()).unwrap_or(0.0)
    }

    /// Elevation above the domain's floor along the wave's direction, metres: the mean over each
    /// row across it, dry ground counting as 0. `spacing` is the particle spacing, metres.
    pub fn profile(&self, position: &[[f32; 3]], spacing: f64) -> Vec<f64> {
        let elevation = self.water(position, spacing).elevation;
        let [nx, _, nz] = self.dims;
        let mean = |s: usize| {
            let across = (0..nz).map(|t| elevation[t * nx + s].unwrap_or(0.0));
            across.sum::<f64>() / nz as f64
        };
        (0..nx).map(mean).collect()
    }

    /// Aggregates by which frames are compared. `spacing` is in metres, `rest_density` in kg/m³,
    /// `gravity` in m/s². Leaves out the density error, which only the solver knows.
    pub fn aggregates(
        &self,
        particles: &Particles,
        spacing: f64,
        rest_density: f64,
        gravity: glam::DVec3,
    ) -> Aggregates {
        let mass = rest_density * spacing.powi(3);
        let (kinetic_energy, potential_energy) =
            energies(particles, mass, gravity, self.domain.min);
        let measures = self.measure(&particles.position, spacing);
        Aggregates {
            kinetic_energy,
            potential_energy,
            volume: measures.volume,
            crest_height: measures.crest_height,
            front: measures.front,
            splash_height: measures.splash_height,
            airborne: measures.airborne,
            density_error: None,
        }
    }

    /// Edge of the cubes, metres: the resolution of lengths.
    pub fn resolution(&self) -> f64 {
        self.edge
    }

    /// Distance of a point along the wave's direction, metres.
    pub fn distance(&self, point: glam::DVec3) -> f64 {
        let axis = self.direction.axis;
        if self.direction.is_forward {
            point[axis] - self.domain.min[axis]
        } else {
            self.domain.max[axis] - point[axis]
        }
    }

    /// Measures particles that are `spacing` metres apart at rest.
    pub fn measure(&self, position: &[[f32; 3]], spacing: f64) -> Measures {
        if position.is_empty() {
            return Measures::default();
        }
        let water = self.water(position, spacing);
        let elevation = self.smoothed(&water.elevation);
        let rows: Vec<ColumnRow> = (0..self.dims[2])
            .filter_map(|t| self.row(&elevation, t))
            .collect();
        let faces: Vec<Face> = rows.iter().filter_map(|row| row.face).collect();
        let is_wave = 2 * faces.len() >= self.dims[2];
        let of_faces =
            |value: fn(&Face) -> f64| median(faces.iter().map(value).collect()).filter(|_| is_wave);
        let height = |p: &[f32; 3]| f64::from(p[1]) - self.domain.min.y - self.still;
        let heights = position.iter().map(height).collect();
        let reaches = position.iter().map(|&p| self.distance(point(p))).collect();
        let is_near = self.dilated(&water.body);
        let far = |p: &&[f32; 3]| !is_near[self.index(self.cube(**p))];
        Measures {
            crest_height: median(rows.iter().map(|row| row.crest).collect()).unwrap_or(0.0),
            crest_slope: of_faces(|face| face.slope),
            front: of_faces(|face| face.front),
            splash_height: percentile(heights, NEARLY_ALL).unwrap_or(0.0),
            splash_reach: percentile(reaches, NEARLY_ALL).unwrap_or(0.0),
            airborne: position.iter().filter(far).count() as f64 / position.len() as f64,
            wet_area: self.wet_columns(&water.counts) as f64 * self.edge * self.edge,
            volume: self.volume(&water),
        }
    }

    fn water(&self, position: &[[f32; 3]], spacing: f64) -> WaterBins {
        let rest = (self.edge / spacing).powi(3);
        let counts = self.counts(position);
        let body = self.body(&counts, rest);
        let tops = self.tops(&counts, &body, rest);
        let column = |(top, fill): (usize, f64)| (top as f64 + fill) * self.edge;
        WaterBins {
            elevation: tops.iter().map(|top| top.map(column)).collect(),
            counts,
            body,
            tops,
        }
    }

    fn index(&self, [s, y, t]: [usize; 3]) -> usize {
        (t * self.dims[1] + y) * self.dims[0] + s
    }

    fn cube(&self, p: [f32; 3]) -> [usize; 3] {
        let p = point(p);
        let across = 2 - self.direction.axis;
        let at = [
            self.distance(p),
            p.y - self.domain.min.y,
            p[across] - self.domain.min[across],
        ];
        // Points outside are clamped to the boundary cubes; `as` saturates negative numbers to 0.
        std::array::from_fn(|k| ((at[k] / self.edge) as usize).min(self.dims[k] - 1))
    }

    fn counts(&self, position: &[[f32; 3]]) -> Vec<u32> {
        let mut counts = vec![0; self.dims.iter().product()];
        for &p in position {
            counts[self.index(self.cube(p))] += 1;
        }
        counts
    }

    /// Whether each cube belongs to the continuous water.
    fn body(&self, counts: &[u32], rest: f64) -> Vec<bool> {
        let is_water = |index: usize| f64::from(counts[index]) >= HALF_FULL * rest;
        // 0: not visited; otherwise the number of the body.
        let mut label = vec![0u32; counts.len()];
        let (mut bodies, mut largest) = (0, (0, 0));
        for first in 0..counts.len() {
            if label[first] != 0 || !is_water(first) {
                continue;
            }
            bodies += 1;
            label[first] = bodies;
            let mut open = vec![first];
            let mut size = 0;
            while let Some(index) = open.pop() {
                size += 1;
                for next in self.faces(index) {
                    if label[next] == 0 && is_water(next) {
                        label[next] = bodies;
                        open.push(next);
                    }
                }
            }
            if size > largest.0 {
                largest = (size, bodies);
            }
        }
        let number = largest.1;
        label
            .iter()
            .map(|&label| number != 0 && label == number)
            .collect()
    }

    /// Cubes that share a face with this one.
    fn faces(&self, index: usize) -> impl Iterator<Item = usize> {
        let [nx, ny, nz] = self.dims;
        let at = [index % nx, index / nx % ny, index / (nx * ny)];
        let strides = [1, nx, nx * ny];
        let dims = [nx, ny, nz];
        (0..3).flat_map(move |axis| {
            let below = (at[axis] > 0).then(|| index - strides[axis]);
            let above = (at[axis] + 1 < dims[axis]).then(|| index + strides[axis]);
            below.into_iter().chain(above)
        })
    }

    /// Top cube of the continuous water in each column (wave direction fastest), and the fill of it
    /// plus the one above it, in cubes.
    fn tops(&self, counts: &[u32], body: &[bool], rest: f64) -> Vec<Option<(usize, f64)>> {
        let [nx, ny, nz] = self.dims;
        let fill = |index: usize| (f64::from(counts[index]) / rest).min(1.0);
        let column = |s: usize, t: usize| {
            let top = (0..ny).rev().find(|&y| body[self.index([s, y, t])])?;
            let above = (top + 1 < ny).then(|| fill(self.index([s, top + 1, t])));
            Some((top, fill(self.index([s, top, t])) + above.unwrap_or(0.0)))
        };
        (0..nx * nz).map(|k| column(k % nx, k / nx)).collect()
    }

    fn volume(&self, water: &WaterBins) -> f64 {
        let tops = water.tops.iter().flatten();
        let (columns, fills) = tops.fold((0, 0.0), |(n, sum), (_, fill)| (n + 1, sum + fill));
        // The cubes below the tops count as full.
        let full = water.body.iter().filter(|&&is_water| is_water).count() - columns;
        (full as f64 + fills) * self.edge.powi(3)
    }

    /// Applies the binomial filter over wet columns; dry ones are ignored.
    fn smoothed(&self, elevation: &[Option<f64>]) -> Vec<Option<f64>> {
        let [nx, _, nz] = self.dims;
        let weight = |step: i64| if step == 0 { 2.0 } else { 1.0 };
        let at = |s: i64, t: i64| {
            let is_inside = (0..nx as i64).contains(&s) && (0..nz as i64).contains(&t);
            let index = is_inside.then_some(t * nx as i64 + s)?;
            elevation[index as usize]
        };
        let column = |k: usize| {
            elevation[k]?;
            let (s, t) = ((k % nx) as i64, (k / nx) as i64);
            let (mut sum, mut weights) = (0.0, 0.0);
            for (ds, dt) in (-1..=1).flat_map(|ds| (-1..=1).map(move |dt| (ds, dt))) {
                if let Some(height) = at(s + ds, t + dt) {
                    sum += weight(ds) * weight(dt) * height;
                    weights += weight(ds) * weight(dt);
                }
            }
            Some(sum / weights)
        };
        (0..nx * nz).into_par_iter().map(column).collect()
    }

    fn row(&self, elevation: &[Option<f64>], t: usize) -> Option<ColumnRow> {
        let row = &elevation[t * self.dims[0]..][..self.dims[0]];
        let above = |s: usize| Some((*row.get(s)?)? - self.still);
        let last = (0..row.len()).rev().find(|&s| row[s].is_some())?;
        let crest = (0..=last)
            .filter_map(above)
            .fold(f64::NEG_INFINITY, f64::max);
        // Foremost position that reaches a level, interpolated between columns; dry ground is bed.
        let foremost = |level: f64| {
            let s = (0..=last).rev().find(|&s| above(s) >= Some(level))?;
            let (here, ahead) = (above(s)?, above(s + 1).unwrap_or(-self.still));
            Some(s as f64 + ((here - level) / (here - ahead)).clamp(0.0, 1.0))
        };
        let face = || {
            let [top, half] = FACE.map(|part| foremost(part * crest));
            let run = self.edge * (half? - top?);
            let rise = (FACE[0] - FACE[1]) * crest;
            Some(Face {
                slope: rise.atan2(run).to_degrees(),
                // A column is represented by its middle.
                front: self.edge * (half? + 0.5),
            })
        };
        Some(ColumnRow {
            crest,
            face: (crest > self.edge).then(face).flatten(),
        })
    }

    /// Cubes of the body and their 26 neighbours.
    fn dilated(&self, body: &[bool]) -> Vec<bool> {
        let mut near = body.to_vec();
        let [nx, ny, _] = self.dims;
        for (stride, length) in [(1, nx), (nx, ny), (nx * ny, self.dims[2])] {
            let before = near.clone();
            near.par_iter_mut().enumerate().for_each(|(index, flag)| {
                let at = index / stride % length;
                *flag |= (at > 0 && before[index - stride])
                    || (at + 1 < length && before[index + stride]);
            });
        }
        near
    }

    fn wet_columns(&self, counts: &[u32]) -> usize {
        let [nx, ny, nz] = self.dims;
        let is_wet = |k: &usize| (0..ny).any(|y| counts[self.index([k % nx, y, k / nx])] > 0);
        (0..nx * nz).filter(is_wet).count()
    }
}

/// Particles binned into cubes.
struct WaterBins {
    counts: Vec<u32>,
    /// Whether each cube belongs to the continuous water.
    body: Vec<bool>,
    /// For each column (wave direction fastest) the top cube of the continuous water, and the fill
    /// of it plus the one above it, in cubes.
    tops: Vec<Option<(usize, f64)>>,
    /// Depth of the continuous water in each column, metres; `None` where it is dry.
    elevation: Vec<Option<f64>>,
}

/// One row of columns along the wave's direction.
struct ColumnRow {
    crest: f64,
    face: Option<Face>,
}

/// The front face of a crest.
#[derive(Clone, Copy)]
struct Face {
    slope: f64,
    front: f64,
}

fn point(p: [f32; 3]) -> glam::DVec3 {
    glam::Vec3::from_array(p).as_dvec3()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    const D: f64 = 0.1;
    const FORWARD: Direction = Direction {
        axis: 0,
        is_forward: true,
    };

    fn domain() -> Bounds {
        Bounds {
            min: DVec3::new(-1.0, 2.0, 0.5),
            max: DVec3::new(9.0, 6.0, 2.5),
        }
    }

    /// A lattice below the surface `depth(x)`; x and depth are relative to the domain's corner.
    fn water(depth: impl Fn(f64) -> f64) -> Vec<[f32; 3]> {
        let mut position = Vec::new();
        for (i, j, k) in
            (0..100).flat_map(|i| (0..40).flat_map(move |j| (0..20).map(move |k| (i, j, k))))
        {
            let p = D * DVec3::new(f64::from(i) + 0.5, f64::from(j) + 0.5, f64::from(k) + 0.5);
            if p.y < depth(p.x) {
                position.push((domain().min + p).as_vec3().to_array());
            }
        }
        position
    }

    fn gauge(direction: Direction) -> Gauge {
        let gauge = Gauge::new(domain(), direction, D);
        let depth = gauge.depth(&water(|_| 1.0), D);
        gauge.with_still_level(depth)
    }

    #[test]
    fn still_water_is_still() {
        let gauge = gauge(FORWARD);
        assert!((gauge.still - 1.0).abs() < 1e-12);
        let measures = gauge.measure(&water(|_| 1.0), D);
        assert!(measures.crest_height.abs() < 1e-12);
        assert_eq!((measures.crest_slope, measures.front), (None, None));
        assert_eq!(measures.airborne, 0.0);
        assert!((measures.wet_area - 20.0).abs() < 1e-9);
        assert!((measures.volume - 20.0).abs() < 1e-9);
        let higher = gauge.measure(&water(|_| 1.1), D);
        assert!((higher.volume - 22.0).abs() < 1e-9);
        // Centres of the top layer: half a spacing below the surface.
        assert!((measures.splash_height + 0.05).abs() < 1e-6);
        let profile = gauge.profile(&water(|x| if x < 4.0 { 2.0 } else { 0.4 }), D);
        assert_eq!(profile.len(), 50);
        assert!((profile[5] - 2.0).abs() < 1e-9 && (profile[45] - 0.4).abs() < 1e-9);
        // A surface between two layers of cubes is found from their fill.
        assert!((gauge.depth(&water(|_| 1.1), D) - 1.1).abs() < 1e-12);
    }

    #[test]
    fn nothing_measures_nothing() {
        let gauge = Gauge::new(domain(), FORWARD, D);
        assert_eq!(gauge.depth(&[], D), 0.0);
        assert_eq!(gauge.measure(&[], D), Measures::default());
    }

    /// A ramp from 2.5 m down to 1 m with a known slope. It starts at 3.01 m, so that no particle
    /// lies on it and is in the water in only one of two mirror images.
    #[test]
    fn a_ramp_has_its_slope_height_and_mirror_image() {
        let gauge = gauge(FORWARD);
        for slope in [0.5, 1.0, 2.0] {
            let ramp = |x: f64| (2.5 - slope * (x - 3.01)).clamp(1.0, 2.5);
            let measures = gauge.measure(&water(ramp), D);
            // The plateau is 15 columns long, so smoothing leaves its height unchanged.
            assert!((measures.crest_height - 1.5).abs() < 1e-9);
            let found = measures.crest_slope.expect("a crest");
            // 0.4 of the crest is 0.6 m of height; each end is accurate to about a quarter of a
            // cube.
            let run = 0.6 / slope;
            let (most, least) = (0.6 / (run - 0.1), 0.6 / (run + 0.1));
            let bounds = [least.atan().to_degrees(), most.atan().to_degrees()];
            assert!(
                bounds[0] < found && found < bounds[1],
                "{slope}: {found} {bounds:?}"
            );
            // The same wave in the opposite direction.
            let back = self::gauge(Direction {
                axis: 0,
                is_forward: false,
            });
            let mirrored = back.measure(&water(|x| ramp(10.0 - x)), D);
            assert!((mirrored.crest_slope.expect("a crest") - found).abs() < 1e-3);
        }
        // Negative control: a step is steeper than all of them.
        let step = gauge.measure(&water(|x| if x < 3.0 { 2.5 } else { 1.0 }), D);
        assert!(step.crest_slope.expect("a crest") > 66.0);
    }

    #[test]
    fn a_front_over_a_dry_bed_is_behind_the_tongue_that_runs_ahead() {
        let gauge = gauge(FORWARD);
        let depth = |x: f64| match x {
            x if x < 4.0 => 2.0,
            x if x < 6.0 => 0.4,
            _ => 0.0,
        };
        let measures = gauge.measure(&water(depth), D);
        // Smoothing widens a step to two cubes of 0.2 m.
        assert!((measures.front.expect("a wave") - 4.0).abs() < 0.2);
        assert!((measures.wet_area - 12.0).abs() < 1e-9);
        assert!(measures.crest_slope.expect("a crest") > 66.0);
    }

    #[test]
    fn drops_in_the_air_are_counted_and_do_not_raise_the_crest() {
        let gauge = gauge(FORWARD);
        let mut position = water(|_| 1.0);
        let calm = gauge.measure(&position, D);
        let full = position.len();
        for k in 0..100 {
            position.push([3.0 + 0.05 * k as f32, 5.0, 1.0]);
        }
        // Nor does a dense blob in the air belong to the continuous water.
        for k in 0..64 {
            let [x, y, z] = [k % 4, k / 4 % 4, k / 16].map(|c| 0.1 * c as f32 + 0.05);
            position.push([3.0 + x, 4.0 + y, 1.1 + z]);
        }
        let measures = gauge.measure(&position, D);
        assert!((measures.airborne - 164.0 / (full + 164) as f64).abs() < 1e-12);
        assert_eq!(measures.crest_height, calm.crest_height);
        assert!((measures.splash_height - 2.0).abs() < 1e-6);
    }

    /// By hand: on a slope of 1 the lattice's columns are 5.55 − x high, half a spacing's rounding
    /// above the ramp. The binomial filter changes only the columns beside the bend at 3 m: at 3.1
    /// m it gives (2.5 + 2 · 2.45 + 2.25) / 4, and at 3.3 m 2.25. The level 0.9 of the crest, which
    /// is 1.5 m above the still level, is met 5/13 of the distance between these, and half of the
    /// crest at 3.8 m.
    #[test]
    fn a_ramp_s_face_is_where_a_hand_finds_it() {
        let ramp = |x: f64| (2.5 - (x - 3.01)).clamp(1.0, 2.5);
        let measures = gauge(FORWARD).measure(&water(ramp), D);
        let run = 3.8 - (3.1 + 0.2 * 5.0 / 13.0);
        let slope = f64::atan2(0.4 * 1.5, run).to_degrees();
        assert!((measures.crest_slope.expect("a crest") - slope).abs() < 1e-9);
        assert!((measures.front.expect("a crest") - 3.8).abs() < 1e-9);
        // Columns of 2.5 m up to 3 m, then falling to 1 m at 4.55 m: the volume of the lattice's
        // particles.
        let volume = water(ramp).len() as f64 * D.powi(3);
        assert!(
            (measures.volume - volume).abs() < 1e-9,
            "{}",
            measures.volume
        );
    }

    /// Of 2000 particles with distinct heights and reaches, 1998 do not exceed the 1998th.
    #[test]
    fn splashes_are_what_nearly_all_keep_below() {
        let gauge = gauge(FORWARD);
        let at = |k: u16| [-1.0 + 0.004 * f32::from(k), 2.0 + 0.001 * f32::from(k), 1.0];
        let position: Vec<_> = (1..=2000).map(|k| at(k * 7 % 2003)).collect();
        let heights = |axis: usize, from: f64| {
            let mut all: Vec<f64> = position.iter().map(|p| f64::from(p[axis]) - from).collect();
            all.sort_by(f64::total_cmp);
            all[1997]
        };
        let measures = gauge.measure(&position, D);
        assert!((measures.splash_height - (heights(1, 2.0) - 1.0)).abs() < 1e-12);
        assert!((measures.splash_reach - heights(0, -1.0)).abs() < 1e-12);
        // From the domain's far side at 9 m if the wave travels the other way.
        let back = self::gauge(Direction {
            axis: 0,
            is_forward: false,
        });
        let least = position.iter().map(|p| f64::from(p[0]));
        let mut least: Vec<f64> = least.collect();
        least.sort_by(f64::total_cmp);
        let measures = back.measure(&position, D);
        assert!((measures.splash_reach - (9.0 - least[2])).abs() < 1e-12);
    }

    #[test]
    fn a_huge_domain_takes_larger_cubes() {
        let bounds = Bounds {
            min: DVec3::ZERO,
            max: DVec3::splat(1000.0),
        };
        let gauge = Gauge::new(bounds, FORWARD, 0.1);
        assert!(gauge.dims.iter().product::<usize>() as f64 <= MAX_CUBES);
    }
}
