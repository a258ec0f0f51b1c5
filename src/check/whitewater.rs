//! Compares the whitewater passes of a frame on the GPU with their f64 reference passes, from the
//! same water and the same whitewater.

use glam::{DVec3, Vec3};

use swell_compare::{
    rounding::{GRADIENT, KERNEL, Sums, U, WALL_DENSITY, WALL_GRADIENT, WALL_PLACE},
    tolerance::bounds,
};
use swell_domain::{
    boundary::Boundary,
    parallel,
    particles::Particles,
    whitewater::{CLOSING, CompleteSettings, KIND, OUTWARD, Potentials, SURFACE, WhitewaterKind},
};
use swell_gpu::adapter::Context;
use swell_reference::whitewater::{Moved, Neighbor, Pull, SortedWater, Surveyed, White};
use swell_scene::PbfScene;
use swell_solve::{
    SolveError,
    whitewater::{SHARE, SURFACE_AT, Whitewater},
};

use super::{
    CheckTable,
    forces::Bounded,
    table::{entries, pair},
};

bounds! {
    SHARE_ERROR = [scale: "the kernel's scale", fluid: "of the water " KERNEL,
        solid: "of the solids " KERNEL, walls: "" WALL_DENSITY, share: "the share of water",
        free: "what walls and solids leave free"]
        (scale * fluid + share * (walls + scale * solid)) / free + 12.0 * U * share, "a quotient";
    STEEPNESS = [scale: "the gradient's scale", sums: "" GRADIENT, walls: "over h " WALL_GRADIENT]
        scale * sums + walls, "";
    DIRECTION = [steepness: "|∇|", error: "" STEEPNESS]
        2.0 * error / steepness + 12.0 * U, "a vector over its own length";
    SURENESS = [error: "h times " STEEPNESS,
        span: "from where a surface begins to where it is full"]
        error / span + 12.0 * U, "";
    NO_SURFACE = [error: "h times " STEEPNESS, least: "where a surface begins"] least - error,
        "a gradient so small that there is surely no surface: its direction is noise";
    TRAPPED = [n: "candidates", speeds: "Σ |v_ij|", weighted: "Σ |v_ij| W",
        own: "by what the particle's own sureness errs"]
        CLOSING * (U * (12.0 * speeds + (n + 40.0) * weighted) + own * weighted),
        "W errs by 11 u, the cosine by 14 u, each term is at most |v_ij| W";
    CREST = [sums: "Σ W (what the normals and their sureness err by)", n: "candidates",
        weight: "Σ W", crest: "the sum itself",
        own: "by what the particle's own sureness and direction of motion err"]
        sums + U * (22.0 * n + 2.0 * (n + 20.0) * weight) + crest * own, "";
    PLACE = [place: "|x| + |way|",
        way: "of a drop: what air takes of it; else by what the water's velocity errs, times Δt"]
        8.0 * U * place + way, "";
    CARRIED = [sums: "with w = |v| " KERNEL, kernel: "Σ p³", speed: "the largest |v| about",
        spread: "|Δv| about over h, times " PLACE]
        2.0 * sums / kernel + 8.0 * U * speed + spread, "a weighted mean";
    FLOWN = [taken: "what air takes", pull: "|v| + |g| Δt"] 1e-5 * taken + 60.0 * U * pull,
        "eight steps; a power by way of exp2 and log2 errs by 4e-6";
    DECIDED = [place: "" PLACE, h: "", scale: "the kernel's scale", sums: "" KERNEL,
        free: "what walls and solids leave free"]
        (4.0 * place / h + 4.0 * scale * sums + 64.0 * U) / free,
        "what a share errs by on the way: both outcomes are right";
}

entries! {
    "whitewater/survey" {
        SHARE_OF = "share of water", "": [error: "" SHARE_ERROR] error, "";
        NORMAL = "normal", "": [error: "" DIRECTION] error, "", tie NO_SURFACE;
        SURE = "surface", "": [error: "" SURENESS] error, "";
    }
    "whitewater/potentials" {
        TRAPPED_AIR = "trapped air", "m/s": [error: "" TRAPPED] error, "";
        WAVE_CREST = "wave crest", "": [error: "" CREST] error, "";
        ENERGY = "energy", "J/kg": [energy: "v²/2"] 24.0 * U * energy, "";
    }
    "whitewater/advance" {
        POSITION = "position", "m": [error: "" PLACE] error, "", tie DECIDED;
        VELOCITY = "velocity", "m/s": [error: "of water " CARRIED] error, "", tie DECIDED;
        KIND_OF = "kind", "": [] 0.0, "whole numbers", tie DECIDED;
    }
}

/// Inputs of a frame of whitewater.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// [`of_whitewater`](swell_scene::Scene::of_whitewater) of the baked scene.
    pub scene: &'a PbfScene<'static>,
    /// Solids of the scene.
    pub boundary: &'a Boundary,
    /// Settings of the whitewater stream.
    pub settings: &'a CompleteSettings,
    /// Water at the frame's end.
    pub water: &'a Particles,
    /// Whitewater at the end of the previous frame.
    pub white: &'a Particles,
    /// Time of the frame's end, seconds.
    pub time: f64,
    /// Time since the previous frame, seconds.
    pub seconds: f64,
}

/// Compares the frame's passes with their reference passes.
///
/// # Errors Returns an error if the device fails or a value is not finite.
pub fn check(context: &Context, frame: Frame<'_>) -> Result<CheckTable, SolveError> {
    let Frame {
        scene,
        boundary,
        water,
        ..
    } = frame;
    let n = water.len();
    let mut device = Whitewater::new(context, scene, boundary, n, false)?;
    device.set(frame.settings)?;
    let potentials = device.survey(water, frame.time, frame.seconds)?;
    let mut table = CheckTable::default();
    let reference = Comparison::of(frame);
    reference.survey(
        &mut table,
        &device.field(SHARE, n)?,
        &device.field(SURFACE_AT, n)?,
    );
    reference.potentials(&mut table, &potentials);
    if !frame.white.is_empty() {
        let mut moved = frame.white.clone();
        device.advance(&mut moved, 0)?;
        reference.advance(&mut table, &moved);
    }
    let sorting = "its order is what the survey is read in";
    for pass in [
        "pbf/assign_cells",
        "sort/scan_blocks",
        "sort/add_block_sums",
    ] {
        table.unchecked.push((pass, sorting));
    }
    for pass in ["sort/place", "sort/stabilize", "pbf/reorder"] {
        table.unchecked.push((pass, sorting));
    }
    Ok(table)
}

/// The water in f64, with rounding bounds of each particle's sums.
struct Comparison<'a> {
    frame: Frame<'a>,
    water: SortedWater,
    surveyed: Vec<Surveyed>,
    errors: Vec<Errors>,
}

/// Rounding bounds of the sums around a position.
#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    share: f64,
    /// Bound on the error of |∇| h.
    steepness: f64,
    /// Bound on the error of the normal; 0 if there is surely no surface.
    direction: f64,
    /// Bound on the error of the surface confidence.
    sure: f64,
}

impl<'a> Comparison<'a> {
    fn of(frame: Frame<'a>) -> Self {
        let water = SortedWater::new(frame.scene, frame.boundary, frame.water, frame.time);
        let n = water.points.len();
        let surveyed: Vec<Surveyed> = parallel::map(0..n, |i| water.survey(i));
        let errors = parallel::map(0..n, |i| errors_of(&water, i, &surveyed[i]));
        Self {
            frame,
            water,
            surveyed,
            errors,
        }
    }

    fn survey(&self, table: &mut CheckTable, share: &[f32], surface: &[[f32; 4]]) {
        let n = self.surveyed.len();
        let [least, _] = SURFACE;
        table.each(&SHARE_OF, 0..n, |i| {
            pair(i, share[i], self.surveyed[i].share, [self.errors[i].share])
        });
        table.each(&NORMAL, 0..n, |i| {
            let (one, error) = (&self.surveyed[i], &self.errors[i]);
            let found = Vec3::from_slice(&surface[i]).as_dvec3();
            let is_noise = one.steepness < NO_SURFACE.of([error.steepness, least]);
            (!is_noise).then(|| pair(i, found, one.normal, [error.direction]))
        });
        table.each(&SURE, 0..n, |i| {
            pair(
                i,
                surface[i][3],
                self.surveyed[i].sure,
                [self.errors[i].sure],
            )
        });
    }

    /// Compares the potentials; `found` is in the order of the original water.
    fn potentials(&self, table: &mut CheckTable, found: &[Potentials]) {
        let n = self.surveyed.len();
        let rows: Vec<(Potentials, [f64; 4], [f64; 5])> = parallel::map(0..n, |i| {
            let exact = self.water.potentials(i, &self.surveyed);
            (exact, self.trapped(i), self.crest(i))
        });
        let found = |i: usize| &found[self.water.order[i]];
        table.each(&TRAPPED_AIR, 0..n, |i| {
            let (exact, trapped, _) = &rows[i];
            pair(
                i,
                found(i).trapped_air,
                exact.trapped_air,
                [TRAPPED.of(*trapped)],
            )
        });
        table.each(&WAVE_CREST, 0..n, |i| {
            let (exact, _, crest) = &rows[i];
            pair(i, found(i).wave_crest, exact.wave_crest, [CREST.of(*crest)])
        });
        table.each(&ENERGY, 0..n, |i| {
            let exact = rows[i].0.energy;
            pair(i, found(i).energy, exact, [exact])
        });
    }

    /// Returns the magnitudes of [`TRAPPED`].
    fn trapped(&self, i: usize) -> [f64; 4] {
        let h = self.water.model.calibration.support_radius;
        let (mut n, mut speeds, mut weighted) = (0.0, 0.0, 0.0);
        self.water.about(self.water.points[i], |neighbor, way| {
            if let Neighbor::Water(j) = neighbor {
                let speed = self.water.velocity[i].distance(self.water.velocity[j]);
                let w = (1.0 - way.length() / h).max(0.0);
                n += 1.0;
                // Particles beyond h have no weight, except by rounding.
                speeds += if way.length() < 1.001 * h { speed } else { 0.0 };
                weighted += speed * w;
            }
        });
        [n, speeds, weighted, self.errors[i].sure]
    }

    /// Returns the magnitudes of [`CREST`].
    fn crest(&self, i: usize) -> [f64; 5] {
        let h = self.water.model.calibration.support_radius;
        let (own, own_error) = (&self.surveyed[i], &self.errors[i]);
        if own_error.sure == 0.0 {
            return [0.0; 5];
        }
        let (mut sums, mut n, mut weight, mut crest) = (0.0, 0.0, 0.0, 0.0);
        self.water.about(self.water.points[i], |neighbor, way| {
            let Neighbor::Water(j) = neighbor else {
                return;
            };
            let w = (1.0 - way.length() / h).max(0.0);
            let (other, error) = (&self.surveyed[j], &self.errors[j]);
            n += 1.0;
            weight += w;
            let along = way.normalize_or_zero();
            let behind = (4.0 * along.dot(own.normal)).clamp(0.0, 1.0);
            crest += (1.0 - own.normal.dot(other.normal)) * other.sure * behind * w;
            let of_normals = (own_error.direction + error.direction) * other.sure;
            let of_behind = 8.0 * (own_error.direction + 12.0 * U) * other.sure;
            sums += w * (of_normals + 2.0 * error.sure + of_behind);
        });
        let [least, full] = OUTWARD;
        let outward = (own_error.direction + 16.0 * U) / (full - least);
        [sums, n, weight, crest, own_error.sure + outward]
    }

    fn advance(&self, table: &mut CheckTable, found: &Particles) {
        let Frame {
            scene,
            settings,
            seconds,
            white,
            ..
        } = self.frame;
        let corner = scene.domain.min;
        let pull = Pull::new(scene, self.frame.time, seconds);
        let bounded = Bounded::of(scene, pull.forces.clone());
        let wide = |v: [f32; 3]| Vec3::from_array(v).as_dvec3();
        let rows: Vec<(Moved, Option<[f64; 2]>)> = parallel::map(0..white.len(), |k| {
            let before = White {
                position: (wide(white.position[k]) - corner).as_vec3().as_dvec3(),
                velocity: wide(white.velocity[k]),
                kind: WhitewaterKind::of_number(white.attributes[KIND][k])
                    .unwrap_or(WhitewaterKind::Foam),
                rise: f64::from(settings.rise_of(white.id[k]) as f32),
            };
            let moved = self.water.advance(settings, &pull, seconds, before);
            (moved, self.moved_errors(&before, &moved, (&pull, &bounded)))
        });
        let n = rows.len();
        table.each(&POSITION, 0..n, |k| {
            let (moved, errors) = &rows[k];
            let [place, _] = (*errors)?;
            let position = wide(found.position[k]) - corner;
            let period = self.water.model.period();
            // Rounding by itself may put a position at the other end of a periodic axis.
            let near = period.image_by_rounding(position, moved.white.position);
            Some(pair(k, near, moved.white.position, [place]))
        });
        table.each(&VELOCITY, 0..n, |k| {
            let (moved, errors) = &rows[k];
            let [_, velocity] = (*errors)?;
            Some(pair(
                k,
                wide(found.velocity[k]),
                moved.white.velocity,
                [velocity],
            ))
        });
        table.each(&KIND_OF, 0..n, |k| {
            let (moved, errors) = &rows[k];
            let kind = f64::from(moved.white.kind.number());
            errors.map(|_| pair(k, f64::from(found.attributes[KIND][k]), kind, []))
        });
    }

    /// Returns error bounds for the position and the velocity of a particle; `None` if rounding
    /// decides its path, or whether a force acts on it, or if a solid pushed it, which the solvers'
    /// own comparisons cover.
    fn moved_errors(
        &self,
        before: &White,
        moved: &Moved,
        (pull, bounded): (&Pull<'_>, &Bounded<'_>),
    ) -> Option<[f64; 2]> {
        if moved.is_pushed {
            return None;
        }
        let (settings, seconds) = (self.frame.settings, self.frame.seconds);
        let model = &self.water.model;
        let h = model.calibration.support_radius;
        let now = &moved.white;
        let about = self.about(now.position);
        let gravity = pull.gravity;
        let most = gravity.length() + bounded.most();
        let pulled = before.velocity.length().max(now.velocity.length()) + most * seconds;
        let wind = DVec3::from_array(settings.wind);
        let taken = (before.velocity + seconds * gravity - now.velocity).length();
        let flown = FLOWN.of([
            taken.min((before.velocity - wind).length() + pulled),
            pulled,
        ]);
        let way = now.position.length() + seconds * pulled;
        let flown = flown + self.pushed(before, bounded, PLACE.of([way, seconds * flown]))?;
        let flight = PLACE.of([way, seconds * flown]);
        // A position in the water is reached by a path that errs as a flight does; a carried
        // particle also errs by the velocity there.
        let spread = about.spread / h * flight;
        let carried = CARRIED.of([about.speeds, about.kernel.max(1e-3), about.fastest, spread]);
        let place = PLACE.of([way, seconds * (flown + carried)]);
        let scale = model.calibration.density_scale;
        let decided = DECIDED.of([place, h, scale, about.sums.kernel(), about.free]);
        (moved.margin > decided).then_some([place, flown + carried])
    }

    /// Returns by how much forces err on the velocity of a drop whose path errs by `off`, m/s;
    /// `None` if its path comes to the edge of a room.
    fn pushed(&self, before: &White, bounded: &Bounded<'_>, off: f64) -> Option<f64> {
        let seconds = self.frame.seconds;
        // The path keeps within this distance from its start.
        let reach = seconds * (before.velocity.length() + seconds * (bounded.most()))
            + self.frame.seconds.powi(2) * self.frame.scene.water.gravity.length();
        Some(seconds * bounded.error_about(before.position, off, reach)?)
    }

    /// Collects magnitudes around a position.
    fn about(&self, x: DVec3) -> ParticleSurroundings {
        let h = self.water.model.calibration.support_radius;
        let mut about = ParticleSurroundings::default();
        let (mut weighted, mut solid) = (Sums::default(), 0.0);
        let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        self.water.about(x, |neighbor, way| {
            let q = way.length() / h;
            match neighbor {
                Neighbor::Water(j) => {
                    let v = self.water.velocity[j];
                    about.sums.add(q, 1.0);
                    weighted.add(q, v.length());
                    if q < 1.001 {
                        (least, most) = (least.min(v), most.max(v));
                        about.fastest = about.fastest.max(v.length());
                    }
                    about.kernel += (1.0 - q * q).max(0.0).powi(3);
                }
                Neighbor::Sample(weight) => {
                    about.sums.add(q, weight);
                    solid += weight * (1.0 - q * q).max(0.0).powi(3);
                }
            }
        });
        about.speeds = weighted.kernel() + about.fastest * about.sums.kernel();
        // Gradients of the weights are at most 4/h times them, so a mean moves by at most that part
        // of the spread.
        about.spread = match most.cmpge(least).all() {
            true => 8.0 * (most - least).length(),
            false => 0.0,
        };
        let (wall, _) = self.water.model.wall_term(x, &self.water.walls);
        let scale = self.water.model.calibration.density_scale;
        about.free = (1.0 - wall - scale * solid).max(0.1);
        about
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct ParticleSurroundings {
    sums: Sums,
    /// Σ p³ over the water.
    kernel: f64,
    /// [`KERNEL`] with speeds as weights.
    speeds: f64,
    fastest: f64,
    spread: f64,
    free: f64,
}

fn errors_of(water: &SortedWater, i: usize, surveyed: &Surveyed) -> Errors {
    let (x, h) = (water.points[i], water.model.calibration.support_radius);
    let (mut fluid, mut solids, mut all) = (Sums::default(), Sums::default(), Sums::default());
    let mut solid = 0.0;
    water.about(x, |neighbor, way| {
        let q = way.length() / h;
        match neighbor {
            Neighbor::Water(_) => {
                fluid.add(q, 1.0);
                all.add(q, 1.0);
            }
            Neighbor::Sample(weight) => {
                solids.add(q, weight);
                all.add(q, weight);
                solid += weight * (1.0 - q * q).max(0.0).powi(3);
            }
        }
    });
    let gaps = [
        (x - water.walls.min).to_array(),
        (water.walls.max - x).to_array(),
    ];
    let faces = gaps
        .iter()
        .flatten()
        .filter(|&&gap| gap < h * 1.001)
        .count() as f64;
    let off = |x: DVec3| (x - x.as_vec3().as_dvec3()).abs().max_element();
    let misplaced = off(water.walls.min).max(off(water.walls.max));
    let q = WALL_PLACE.of([misplaced / h]);
    let walls = WALL_DENSITY.of([faces, q]);
    let wall_gradient = WALL_GRADIENT.of([faces, q, walls]);
    let calibration = &water.model.calibration;
    let (wall, _) = water.model.wall_term(x, &water.walls);
    let free = (1.0 - wall - calibration.density_scale * solid).max(0.1);
    let share = SHARE_ERROR.of([
        calibration.density_scale,
        fluid.kernel(),
        solids.kernel(),
        walls,
        surveyed.share,
        free,
    ]);
    let steepness = h * STEEPNESS.of([
        calibration.gradient_scale,
        all.gradient(),
        wall_gradient / h,
    ]);
    let [least, full] = SURFACE;
    if surveyed.steepness < NO_SURFACE.of([steepness, least]) {
        return Errors {
            share,
            steepness,
            ..Errors::default()
        };
    }
    Errors {
        share,
        steepness,
        direction: DIRECTION.of([surveyed.steepness, steepness]),
        sure: SURENESS.of([steepness, full - least]),
    }
}
