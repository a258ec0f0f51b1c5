//! Depth of the water at rest, from its boxes and meshes above the floor and the solids on it.

use glam::DVec3;

use super::super::{Scene, WaveMaker, words::shown};
use swell_domain::mesh::TriangleMesh;

/// Number of water columns sampled along a wall.
const COLUMNS: usize = 9;

/// Most columns that are looked at for any water at all.
const MOST_COLUMNS: usize = 4096;

/// Still water.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Still {
    /// Depth, metres.
    pub(super) depth: f64,
    /// Height of the solids below the water above the domain's floor, metres.
    pub(super) floor: f64,
}

impl Still {
    /// Creates still water of this depth on the domain's floor, metres.
    pub(super) fn on_the_floor(depth: f64) -> Self {
        Self { depth, floor: 0.0 }
    }
}

impl Scene {
    /// Returns the largest depth of the water on the floor at the start, metres; `None` without
    /// such water, or if gravity is not along -y.
    pub(super) fn still_depth(&self) -> Option<f64> {
        let floor = self.domain.min.y;
        let meshes = self.water.meshes.iter();
        let boxes = meshes.filter_map(|placed| placed.mesh.bounds());
        let all = self.water.blocks.iter().copied().chain(boxes);
        let standing = all.filter(|it| it.min.y <= floor + self.particle_spacing());
        let top = standing.map(|it| it.max.y - floor).chain(self.wave_depth());
        let deepest = top.fold(0.0, f64::max).min(self.domain.size().y);
        (self.is_down() && deepest > 0.0).then_some(deepest)
    }

    /// Returns the water beside the rest position of a wall, as the median of some columns along
    /// it; `None` without water there, for a floor or ceiling, or if gravity is not along -y.
    pub(super) fn still_beside(&self, maker: &WaveMaker) -> Option<Still> {
        self.still_in(maker, COLUMNS)
    }

    /// Same as [`Self::still_beside`], with this number of columns.
    fn still_in(&self, maker: &WaveMaker, columns: usize) -> Option<Still> {
        let wall = maker.wall;
        if wall.axis == 1 || !self.is_down() {
            return None;
        }
        let (min, size) = (self.domain.min, self.domain.size());
        // Offsets that avoid the planes of box faces and edges.
        let away = maker.room() + 0.613 * self.particle_spacing();
        let column = |k: usize| {
            let part = (k as f64 + 0.437) / columns as f64;
            let mut at = min + part * size;
            at[wall.axis] = match wall.is_max {
                true => self.domain.max[wall.axis] - away,
                false => min[wall.axis] + away,
            };
            self.column(at)
        };
        let mut found: Vec<Still> = (0..columns).filter_map(column).collect();
        found.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        found.get(found.len() / 2).copied()
    }

    /// A wall beside which no water is at rest, in a scene that has water on its floor and no
    /// emitter that could bring some.
    pub(super) fn lint_dry_wall(
        &self,
        index: usize,
        maker: &WaveMaker,
        level: Option<f64>,
    ) -> Option<String> {
        let level = level?;
        // A column per spacing, since water may be beside a part of the wall only.
        let side = self.domain.size()[2 - maker.wall.axis.min(2)];
        let columns =
            ((side / self.particle_spacing()).ceil() as usize).clamp(COLUMNS, MOST_COLUMNS);
        let is_dry = maker.wall.axis != 1 && self.still_in(maker, columns).is_none();
        (is_dry && self.emitters.is_empty()).then(|| {
            format!(
                "wave_maker[{index}]: no water is beside its wall at rest, though water {} m deep \
                 is on the floor: the water does not reach the wall, or a solid is in between",
                shown(level)
            )
        })
    }

    fn is_down(&self) -> bool {
        let gravity = self.water.gravity;
        gravity.x == 0.0 && gravity.z == 0.0 && gravity.y < 0.0
    }

    /// Returns the water above a position, on top of the static solids that rest on
    /// the floor there.
    fn column(&self, at: DVec3) -> Option<Still> {
        let bottom = self.domain.min.y;
        let near = self.particle_spacing();
        let solids = self.solids.iter();
        let solids = solids.flat_map(|solid| stretches(&solid.mesh, at));
        let floor = topmost(bottom, near, solids.collect());
        let blocks = self.water.blocks.iter().filter(|block| {
            let is_over = |axis: usize| (block.min[axis]..block.max[axis]).contains(&at[axis]);
            is_over(0) && is_over(2)
        });
        let blocks = blocks.map(|block| [block.min.y, block.max.y]);
        let meshes = self.water.meshes.iter();
        let meshes = meshes.flat_map(|placed| stretches(&placed.mesh, at));
        let below_waves = self.wave_depth().map(|depth| [bottom, bottom + depth]);
        let water = blocks.chain(meshes).chain(below_waves).collect();
        let top = topmost(floor, near, water).min(self.domain.max.y);
        let found = Still {
            depth: top - floor,
            floor: floor - bottom,
        };
        (found.depth > near).then_some(found)
    }
}

/// Returns the top of a stack of intervals, of which the lowest begins no higher than
/// `near` above `from`.
fn topmost(from: f64, near: f64, mut stretches: Vec<[f64; 2]>) -> f64 {
    stretches.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let onto = |top: f64, [low, high]: [f64; 2]| match low <= top + near {
        true => top.max(high),
        false => top,
    };
    stretches.into_iter().fold(from, onto)
}

/// Returns bottom and top of each interval of the vertical line through `at` that is inside a mesh,
/// metres. Below a surface without a bottom counts as inside.
fn stretches(mesh: &TriangleMesh, at: DVec3) -> Vec<[f64; 2]> {
    let outward = mesh.signed_volume().signum();
    let mut crossings: Vec<(f64, i32)> = (0..mesh.triangles.len())
        .filter_map(|index| crossing(mesh.corners(index), at))
        .map(|(y, side)| (y, if side * outward < 0.0 { 1 } else { -1 }))
        .collect();
    crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Number of shells around the lowest point.
    let sums = crossings.iter().scan(0, |sum, (_, step)| {
        *sum += step;
        Some(*sum)
    });
    let mut within = -sums.min().unwrap_or(0).min(0);
    let mut begun = (within > 0).then_some(f64::NEG_INFINITY);
    let mut found = Vec::new();
    for (y, step) in crossings {
        within += step;
        match begun {
            None if within > 0 => begun = Some(y),
            Some(low) if within == 0 => {
                found.push([low, y]);
                begun = None;
            }
            _ => {}
        }
    }
    found
}

/// Returns the height at which the vertical line through `at` meets a triangle, and a number with
/// the sign of the normal's y component.
fn crossing(corners: [DVec3; 3], at: DVec3) -> Option<(f64, f64)> {
    let [a, b, c] = corners;
    let side = |p: DVec3, q: DVec3| (q.z - p.z) * (at.x - p.x) - (q.x - p.x) * (at.z - p.z);
    let [of_c, of_a, of_b] = [side(a, b), side(b, c), side(c, a)];
    let is_in =
        (of_a > 0.0 && of_b > 0.0 && of_c > 0.0) || (of_a < 0.0 && of_b < 0.0 && of_c < 0.0);
    let all = of_a + of_b + of_c;
    is_in.then(|| ((of_a * a.y + of_b * b.y + of_c * c.y) / all, all))
}
