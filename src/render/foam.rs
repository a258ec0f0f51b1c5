//! Foam of a whitewater stream as a layer on the water's surface, in the device's layout: discs in
//! columns over the level axes.

use std::f64::consts::PI;

use glam::DVec3;
use half::f16;

use super::RenderScene;
use swell_domain::{
    bounds::Bounds,
    level_set::foam::{Disc, FoamBox, discs},
    parallel,
    particles::Particles,
    period::Period,
    whitewater::random_of,
};
use swell_scene::look::WhitewaterLook;

/// Seconds over which a disc, and the cell around it, grows, and over which it shrinks at its end,
/// so that none appears or goes at once.
const GROWING: f64 = 0.15;
/// Largest values of a disc's growth and of its random number, which have 5 and 8 bits.
const GROWN: f64 = 31.0;
const RANDOM: u32 = 255;
/// Number of discs in the kernel's circle from which on the circle is smaller: enough that those of
/// the coarse mosaic are among them.
const MANY: f64 = 96.0;
/// Columns along the kernel's largest radius, unless there would be too many columns.
const FINE: u32 = 4;
const MOST_COLUMNS: f64 = 2e6;

/// Discs of an instant by column: those of column (i, k), from `starts[i + k nx]` on, are in the
/// order of the particles.
pub(super) struct FoamColumns {
    /// Least corner, x and z, metres.
    pub(super) corner: [f32; 2],
    /// Number of columns along x and z; 0 without foam.
    pub(super) columns: [u32; 2],
    /// Edge of a column, metres.
    pub(super) edge: f32,
    /// Largest radius of the kernel, metres.
    pub(super) radius: f32,
    /// Fraction of light that foam reflects.
    pub(super) albedo: f32,
    /// Factor on the area of discs.
    amount: f64,
    starts: Vec<u32>,
    /// Radius of the kernel at the centre of each column, metres.
    radii: Vec<f32>,
    discs: Vec<Disc>,
}

impl FoamColumns {
    /// No foam.
    pub(super) fn none() -> Self {
        Self {
            corner: [0.0; 2],
            columns: [0; 2],
            edge: 1.0,
            radius: 1.0,
            albedo: 0.0,
            amount: 0.0,
            starts: Vec::new(),
            radii: Vec::new(),
            discs: Vec::new(),
        }
    }

    /// Sorts the foam of a stream, whose positions are those of an instant.
    pub(super) fn new(white: &Particles, scene: &RenderScene, look: &WhitewaterLook) -> Self {
        let (albedo, amount) = (look.foam_albedo as f32, look.foam_amount);
        let room = FoamBox {
            corner: scene.domain.min,
            walls: walls(scene),
            period: Period::default(),
            spacing: scene.particle_spacing,
        };
        let radius = room.radius();
        let all = discs(white, &room);
        let level = |disc: &Disc| [disc.place.x, disc.place.z];
        let ends = |pick: fn(f64, f64) -> f64, start: f64| {
            [0, 1].map(|axis| all.iter().map(|disc| level(disc)[axis]).fold(start, pick))
        };
        let (low, high) = (ends(f64::min, f64::MAX), ends(f64::max, f64::MIN));
        if all.is_empty() {
            return Self::none();
        }
        let area = (high[0] - low[0] + radius) * (high[1] - low[1] + radius);
        let room_for = |parts: u32| area * (f64::from(parts) / radius).powi(2) <= MOST_COLUMNS;
        let parts = (1..=FINE).rev().find(|&parts| room_for(parts)).unwrap_or(1);
        let edge = radius / f64::from(parts);
        let columns = [0, 1].map(|axis| ((high[axis] - low[axis]) / edge) as u32 + 1);
        let column = |disc: &Disc| {
            let [i, k] = [0, 1].map(|axis| ((level(disc)[axis] - low[axis]) / edge) as u32);
            (k.min(columns[1] - 1) * columns[0] + i.min(columns[0] - 1)) as usize
        };
        let (starts, order) = by_column(&all, (columns[0] * columns[1]) as usize, column);
        let discs = parallel::map_slice(&order, |&at| all[at as usize]);
        let heights = parallel::map_slice(&discs, |disc| (disc.place.y / edge).floor());
        let densities = parallel::map(0..starts.len() - 1, |at| {
            densest(&heights[starts[at] as usize..starts[at + 1] as usize]) / edge.powi(2)
        });
        let radius_of = |density: &f64| (MANY / (PI * density)).sqrt().min(radius) as f32;
        let smooth = averaged(&densities, columns.map(|n| n as usize), parts as usize / 2);
        Self {
            corner: low.map(|x| x as f32),
            columns,
            edge: edge as f32,
            radius: radius as f32,
            albedo,
            amount,
            starts,
            radii: smooth.iter().map(radius_of).collect(),
            discs,
        }
    }

    /// Returns the starts of the columns and the end, the kernel's radius in each column, then four
    /// words a disc: its position, and [`word`].
    pub(super) fn words(&self) -> Vec<u32> {
        let unit = self.amount * 3.0 / (PI * f64::from(self.radius).powi(2));
        let of_disc = |disc: &Disc| {
            let place = disc.place.as_vec3().to_array().map(f32::to_bits);
            [place[0], place[1], place[2], word(disc, unit)]
        };
        let mut words = self.starts.clone();
        words.extend(self.radii.iter().map(|radius| radius.to_bits()));
        words.extend(self.discs.iter().flat_map(of_disc));
        words
    }
}

/// A disc's area times `unit` in half precision, in the lower 16 bits; above them the axes that
/// mirror it, its growth from 0 to 1, and a random number that it keeps.
fn word(disc: &Disc, unit: f64) -> u32 {
    let growth = (disc.age.min(disc.life) / GROWING).clamp(0.0, 1.0);
    let growth = (growth * GROWN).round() as u32;
    let mirrored = disc.mirrored.to_array().map(|x| u32::from(x > 0.0));
    let axes = mirrored[0] | mirrored[1] << 1 | mirrored[2] << 2;
    let random = (f64::from(RANDOM) * random_of(disc.id)).round() as u32;
    let area = f16::from_f64(disc.area * unit).to_bits();
    u32::from(area) | axes << 16 | growth << 19 | random << 24
}

/// Counts discs by column and orders them.
fn by_column(
    all: &[Disc],
    columns: usize,
    column: impl Fn(&Disc) -> usize,
) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0_u32; columns + 1];
    for disc in all {
        starts[column(disc) + 1] += 1;
    }
    for at in 0..columns {
        starts[at + 1] += starts[at];
    }
    let mut next = starts.clone();
    let mut order = vec![0_u32; all.len()];
    for (index, disc) in (0..).zip(all) {
        let at = &mut next[column(disc)];
        order[*at as usize] = index;
        *at += 1;
    }
    (starts, order)
}

/// Number of discs in the fullest layer of a column, of those in which they are.
fn densest(layers: &[f64]) -> f64 {
    let mut layers = layers.to_vec();
    layers.sort_unstable_by(f64::total_cmp);
    let most = layers.chunk_by(|a, b| a == b).map(<[f64]>::len).max();
    most.unwrap_or(0) as f64
}

/// Means over the values up to `reach` columns away along both axes.
fn averaged(values: &[f64], [nx, nz]: [usize; 2], reach: usize) -> Vec<f64> {
    let around = |at: usize, count: usize| at.saturating_sub(reach)..(at + reach + 1).min(count);
    let rows = parallel::map(0..values.len(), |at| {
        let (i, k) = (at % nx, at / nx);
        around(i, nx).map(|i| values[k * nx + i]).sum::<f64>()
    });
    parallel::map(0..values.len(), |at| {
        let (i, k) = (at % nx, at / nx);
        let sum: f64 = around(k, nz).map(|k| rows[k * nx + i]).sum();
        sum / (around(i, nx).len() * around(k, nz).len()) as f64
    })
}

/// Faces of the box, relative to its least corner.
fn walls(scene: &RenderScene) -> Bounds {
    let (mut min, mut max) = (DVec3::ZERO, scene.domain.size());
    for &(wall, inward) in &scene.wave_makers {
        match wall.is_max {
            true => max[wall.axis] -= inward,
            false => min[wall.axis] += inward,
        }
    }
    Bounds { min, max }
}
