//! Draws particles as balls on the CPU within milliseconds: a look at a frame's content, not a
//! render.
//!
//! The projection is parallel, so that lengths are comparable across the picture, and a depth
//! buffer resolves visibility. Light comes from the eye; the space between the balls is empty.

use glam::{DVec2, DVec3};

use swell_domain::{bounds::Bounds, mesh::TriangleMesh, particles::Particles};
use swell_study::rgb::Rgb;

/// Viewing direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Aspect {
    /// Along -z: x points right and y up.
    #[default]
    Side,
    /// Along -y: x points right and -z up.
    Top,
    /// From above the corner with least x and greatest z.
    Corner,
}

/// A parallel projection of a box to a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Projection {
    right: DVec3,
    up: DVec3,
    /// Unit vector towards the eye.
    toward: DVec3,
    /// World position at the middle of the picture, metres.
    centre: DVec3,
    /// Pixels per metre.
    scale: f64,
    /// Columns and rows.
    size: [usize; 2],
}

/// What is drawn besides the particles; metres, relative to the particles' origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scenery<'a> {
    /// Drawn as its edges.
    pub(super) domain: Bounds,
    /// The box that the walls currently leave to the water, drawn as its edges if it differs from
    /// the domain.
    pub(super) walls: Bounds,
    /// Drawn in grey.
    pub(super) solids: &'a [TriangleMesh],
}

const GROUND: [f32; 3] = [15.0, 18.0, 23.0];
const DOMAIN: [f32; 3] = [70.0, 78.0, 88.0];
const WALLS: [f32; 3] = [214.0, 110.0, 40.0];
const SOLID: [f32; 3] = [150.0, 146.0, 138.0];
/// Colours of rising speeds, evenly spaced up to the top speed.
const SPEEDS: [[f32; 3]; 4] = [
    [18.0, 52.0, 120.0],
    [24.0, 130.0, 196.0],
    [118.0, 208.0, 226.0],
    [255.0, 255.0, 255.0],
];
/// Margin around the domain, as a fraction of the picture's width.
const MARGIN: f64 = 0.03;
/// Least and greatest number of rows, as fractions of the number of columns.
const SHAPE: [f64; 2] = [0.25, 0.75];
/// Supersampling factor along each axis.
const FINER: usize = 2;

impl Projection {
    /// Projects a domain onto a picture of `width` columns.
    pub(super) fn of(from: Aspect, domain: &Bounds, width: usize) -> Self {
        let (right, up) = match from {
            Aspect::Side => (DVec3::X, DVec3::Y),
            Aspect::Top => (DVec3::X, DVec3::NEG_Z),
            Aspect::Corner => {
                let toward = DVec3::new(-0.5, 0.55, 0.9).normalize();
                let right = DVec3::Y.cross(toward).normalize();
                (right, toward.cross(right))
            }
        };
        let span = |axis: DVec3| {
            let places = corners(domain).map(|corner| corner.dot(axis));
            places
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], &x| {
                    [a.min(x), b.max(x)]
                })
        };
        let [across, upward] = [span(right), span(up)].map(|[a, b]| b - a);
        let columns = width as f64;
        let inner = columns * (1.0 - 2.0 * MARGIN);
        let tall = upward / across * inner + 2.0 * MARGIN * columns;
        let rows = tall.clamp(SHAPE[0] * columns, SHAPE[1] * columns).round();
        let fit = (rows - 2.0 * MARGIN * columns) / upward;
        Self {
            right,
            up,
            toward: right.cross(up),
            centre: 0.5 * (domain.min + domain.max),
            scale: (inner / across).min(fit),
            size: [width, rows as usize],
        }
    }

    /// The same view for positions that are larger by `way`, metres.
    #[must_use]
    pub(super) fn moved(self, way: DVec3) -> Self {
        Self {
            centre: self.centre + way,
            ..self
        }
    }

    /// Columns and rows of a picture.
    pub(super) fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Column and row of a position in a picture that is `finer` times as fine, and its nearness,
    /// metres.
    fn place(&self, place: DVec3, finer: f64) -> (DVec2, f64) {
        let from = place - self.centre;
        let [columns, rows] = self.size.map(|side| 0.5 * side as f64);
        let x = columns + self.scale * from.dot(self.right);
        let y = rows - self.scale * from.dot(self.up);
        (finer * DVec2::new(x, y), from.dot(self.toward))
    }

    /// Draws a frame: balls with the particle spacing (metres) as diameter, coloured by speed up to
    /// `top` m/s.
    pub(super) fn draw(
        &self,
        water: &Particles,
        spacing: f64,
        top: f64,
        around: &Scenery<'_>,
    ) -> Rgb {
        let size = self.size.map(|side| side * FINER);
        let mut canvas = Canvas {
            projection: self,
            size,
            colour: vec![GROUND; size[0] * size[1]],
            depth: vec![f64::NEG_INFINITY; size[0] * size[1]],
        };
        canvas.edges(&around.domain, DOMAIN);
        for solid in around.solids {
            for index in 0..solid.triangles.len() {
                canvas.triangle(solid.corners(index));
            }
        }
        let radius = 0.5 * spacing;
        for (position, velocity) in water.position.iter().zip(&water.velocity) {
            let [place, velocity] = [position, velocity].map(|v| DVec3::from(v.map(f64::from)));
            let part = (velocity.length() / top.max(f64::MIN_POSITIVE)).min(1.0);
            canvas.ball(place, radius, ramp(part as f32));
        }
        if around.walls != around.domain {
            canvas.edges(&around.walls, WALLS);
        }
        let byte = |colour: &[f32; 3]| colour.map(|x| x.round() as u8);
        let fine = Rgb {
            size,
            pixels: canvas.colour.iter().map(byte).collect(),
        };
        fine.resized(self.size)
    }
}

/// Colour of a fraction of the top speed.
fn ramp(part: f32) -> [f32; 3] {
    let at = part * (SPEEDS.len() - 1) as f32;
    let below = (at as usize).min(SPEEDS.len() - 2);
    let rest = at - below as f32;
    std::array::from_fn(|k| SPEEDS[below][k] + rest * (SPEEDS[below + 1][k] - SPEEDS[below][k]))
}

/// The eight corners; two whose indices differ in one bit share an edge.
fn corners(bounds: &Bounds) -> [DVec3; 8] {
    std::array::from_fn(|k| {
        let pick = |axis: usize| match k >> axis & 1 {
            0 => bounds.min[axis],
            _ => bounds.max[axis],
        };
        DVec3::new(pick(0), pick(1), pick(2))
    })
}

struct Canvas<'a> {
    projection: &'a Projection,
    size: [usize; 2],
    colour: Vec<[f32; 3]>,
    /// Nearness of the nearest surface, metres.
    depth: Vec<f64>,
}

impl Canvas<'_> {
    fn place(&self, place: DVec3) -> (DVec2, f64) {
        self.projection.place(place, FINER as f64)
    }

    /// Pixels between two ends along an axis, clipped to the picture.
    fn between(&self, axis: usize, low: f64, high: f64) -> std::ops::Range<usize> {
        let most = self.size[axis] as f64;
        let [low, high] = [low.floor(), high.ceil() + 1.0].map(|x| x.clamp(0.0, most) as usize);
        low..high
    }

    fn put(&mut self, [x, y]: [usize; 2], depth: f64, colour: [f32; 3]) {
        let at = y * self.size[0] + x;
        if depth > self.depth[at] {
            self.depth[at] = depth;
            self.colour[at] = colour;
        }
    }

    /// Draws the twelve edges of a box over everything.
    fn edges(&mut self, bounds: &Bounds, colour: [f32; 3]) {
        let corners = corners(bounds).map(|corner| self.place(corner).0);
        for (a, b) in (0..8).flat_map(|a| (0..3).map(move |axis| (a, a | 1 << axis))) {
            let way = corners[b] - corners[a];
            let steps = way.abs().max_element().ceil().max(1.0);
            for k in 0..=steps as usize {
                let at = corners[a] + way * (k as f64 / steps);
                for offset in 0..FINER {
                    let [x, y] = [at.x, at.y + offset as f64].map(|v| v.max(-1.0) as isize);
                    let is_in = (0..self.size[0] as isize).contains(&x)
                        && (0..self.size[1] as isize).contains(&y);
                    if is_in {
                        self.colour[y as usize * self.size[0] + x as usize] = colour;
                    }
                }
            }
        }
    }

    /// Draws a ball, brighter where it faces the eye.
    fn ball(&mut self, place: DVec3, radius: f64, colour: [f32; 3]) {
        let (at, depth) = self.place(place);
        // A ball smaller than a pixel could fall between two pixel centres.
        let reach = (radius * self.projection.scale * FINER as f64).max(0.71);
        for y in self.between(1, at.y - reach, at.y + reach) {
            for x in self.between(0, at.x - reach, at.x + reach) {
                let off = (DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - at) / reach;
                let rest = 1.0 - off.length_squared();
                if rest > 0.0 {
                    let facing = rest.sqrt();
                    let light = (0.55 + 0.45 * facing) as f32;
                    self.put([x, y], depth + radius * facing, colour.map(|c| c * light));
                }
            }
        }
    }

    /// Draws a two-sided triangle, brighter where it faces up or the eye.
    fn triangle(&mut self, corners: [DVec3; 3]) {
        let normal = (corners[1] - corners[0])
            .cross(corners[2] - corners[0])
            .normalize_or_zero();
        let facing = normal.dot(self.projection.toward).abs();
        let light = (0.35 + 0.4 * facing + 0.25 * normal.y.abs()) as f32;
        let colour = SOLID.map(|c| c * light);
        let [(a, near_a), (b, near_b), (c, near_c)] = corners.map(|corner| self.place(corner));
        let area = (b - a).perp_dot(c - a);
        if area == 0.0 {
            return;
        }
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        for y in self.between(1, low.y, high.y) {
            for x in self.between(0, low.x, high.x) {
                let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let [u, v] = [
                    (c - p).perp_dot(a - p) / area,
                    (a - p).perp_dot(b - p) / area,
                ];
                let w = 1.0 - u - v;
                if u >= 0.0 && v >= 0.0 && w >= 0.0 {
                    self.put([x, y], w * near_a + u * near_b + v * near_c, colour);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TANK: Bounds = Bounds {
        min: DVec3::ZERO,
        max: DVec3::new(4.0, 2.0, 1.0),
    };

    fn around(solids: &[TriangleMesh]) -> Scenery<'_> {
        Scenery {
            domain: TANK,
            walls: TANK,
            solids,
        }
    }

    fn water(places: &[([f32; 3], f32)]) -> Particles {
        Particles {
            position: places.iter().map(|(place, _)| *place).collect(),
            velocity: places.iter().map(|(_, speed)| [0.0, *speed, 0.0]).collect(),
            id: (0..places.len() as u32).collect(),
            ..Particles::default()
        }
    }

    fn bright(picture: &Rgb, [x, y]: [usize; 2]) -> [u8; 3] {
        picture.pixels[y * picture.size[0] + x]
    }

    #[test]
    fn places_are_where_they_are_and_speeds_have_their_colours() {
        // 400 columns for 4 m and a margin of 12 on either side: 94 pixels per metre; 2 m and
        // margins are 212 rows.
        let side = Projection::of(Aspect::Side, &TANK, 400);
        assert_eq!((side.size(), side.scale), ([400, 212], 94.0));
        let still = ([1.0, 0.5, 0.5], 0.0);
        let fast = ([3.0, 1.5, 0.5], 9.0);
        let picture = side.draw(&water(&[still, fast]), 0.2, 3.0, &around(&[]));
        let [blue, white] = [[106, 153], [294, 59]].map(|at| bright(&picture, at));
        assert!(blue[2] > 100 && blue[0] < 25, "{blue:?}");
        assert!(white.iter().all(|&x| x > 240), "{white:?}");
        // Control: there is nothing beside them, and the middle of the domain is empty.
        assert_eq!(bright(&picture, [200, 106]), GROUND.map(|x| x as u8));
        let radius = 0.5 * 0.2 * 94.0;
        let seen = picture.pixels.iter().filter(|p| p[0] > 120).count() as f64;
        let disc = std::f64::consts::PI * radius * radius;
        // A ring one pixel wide is partly covered.
        assert!(
            (seen - disc).abs() < 2.0 * std::f64::consts::PI * radius,
            "{seen} {disc}"
        );
    }

    #[test]
    fn the_nearer_one_is_seen_from_each_side() {
        let low = ([2.0, 0.5, 0.9], 0.0);
        let high = ([2.0, 0.5, 0.1], 9.0);
        for places in [[low, high], [high, low]] {
            let side = Projection::of(Aspect::Side, &TANK, 400);
            let picture = side.draw(&water(&places), 0.2, 3.0, &around(&[]));
            assert!(
                bright(&picture, [200, 153])[0] < 25,
                "the slow one is nearer the eye"
            );
        }
        let top = Projection::of(Aspect::Top, &TANK, 400);
        let picture = top.draw(&water(&[low, high]), 0.2, 3.0, &around(&[]));
        // z grows towards the picture's bottom: 0.4 m from the middle is 37.6 pixels.
        let middle = top.size()[1] / 2;
        assert!(bright(&picture, [200, middle + 37])[0] < 25);
        assert!(bright(&picture, [200, middle - 38])[0] > 240);
    }

    #[test]
    fn a_solid_hides_what_is_behind_it() {
        let wall = TriangleMesh {
            vertices: [[1.0, 0.0], [3.0, 0.0], [3.0, 2.0], [1.0, 2.0]]
                .map(|[x, y]| DVec3::new(x, y, 0.5))
                .to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        let side = Projection::of(Aspect::Side, &TANK, 400);
        let colour = |z: f32| {
            let water = water(&[([2.0, 1.0, z], 9.0)]);
            bright(
                &side.draw(&water, 0.2, 3.0, &around(std::slice::from_ref(&wall))),
                [200, 106],
            )
        };
        assert!(colour(0.8)[2] > 240 && colour(0.2)[2] < 140);
        let corner = Projection::of(Aspect::Corner, &TANK, 400);
        assert!((corner.right.dot(corner.up)).abs() < 1e-12 && corner.toward.y > 0.0);
        let [width, height] = corner.size().map(|side| side as f64);
        for place in corners(&TANK) {
            let (at, _) = corner.place(place, 1.0);
            assert!(
                at.x > 0.0 && at.x < width && at.y > 0.0 && at.y < height,
                "{at}"
            );
        }
    }
}
