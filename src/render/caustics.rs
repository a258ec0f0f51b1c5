//! Sunlight that water bends and bundles on what lies below it: a lattice of rays from the sun, followed through the level set, and a
//! map of the light where they land.
//!
//! The map lies on the plane of the domain's floor. A place belongs to the texel into which the sunlight of flat water would carry it,
//! so that flat water makes an even map at any depth, and what stands above the floor is as sharp as the floor. Light is relative to
//! that through flat water: what a look without caustics has under water is 1.

use glam::DVec2;

use super::{
    RenderScene,
    buffers::{CAUSTICS, LIGHT_SUMS, SUN_HITS, SUN_RAYS},
    plan::Plan,
    rays::{sun_in_water, voxel},
    uniform,
};
use swell_domain::level_set::sunlight::nodes_over;
use swell_gpu::{
    program::Program,
    recording::{Command, Groups},
};
use swell_scene::look::Look;

/// Texels between rays: light between four rays is spread over the quad where they land.
const TEXELS_A_RAY: f64 = 2.0;
/// Standard deviation with which normals are smoothed where the look leaves it out, particle spacings. What particles at rest leave in
/// a surface has lengths of some spacings; waves that they hold are longer.
const WIDTH: f64 = 1.5;
/// What the outermost rays are within the box's sides, voxels.
const HAIR: f64 = 0.01;
/// Layers of the map: what the sun in flat water would shine on, and what stands in shadow there.
const LAYERS: usize = 2;

/// Where rays and map lie.
#[derive(Clone, Debug)]
pub(super) struct Caustics {
    /// Of the box, x and z, metres.
    size: DVec2,
    /// Beyond the box's sides, metres; 0 where no sea lies there.
    margin: f64,
    /// Still level of the sea, metres; 0 without one.
    level: f64,
    texel: f64,
    /// Off the box's sides, metres, by which the outermost rays are within it.
    hair: f64,
    /// Horizontal way of light for a metre of height, in air and in flat water, towards the sun.
    slopes: [DVec2; 2],
    /// What does not change.
    fixed: uniform::Caustics,
    /// Rays and texels that there is room for, along x and z.
    room: [[u32; 2]; 2],
    /// Seconds from the frame, and since frame 0, at which the map stands.
    stands: Option<[f32; 2]>,
}

impl Caustics {
    /// `None` where the look has none.
    pub(super) fn of(look: &Look, scene: &RenderScene) -> Option<Self> {
        let spec = look.spec();
        let asked = spec.water.caustics.as_ref()?;
        let domain = scene.domain.size();
        let (sun, bent) = (look.sun_direction(), sun_in_water(look));
        let margin = spec.sea.as_ref().map_or(0.0, |sea| sea.band_m);
        let size = DVec2::new(domain.x, domain.z);
        let texel = (size.max_element() + 2.0 * margin) / f64::from(asked.resolution);
        let width = asked
            .smoothing_width_m
            .unwrap_or(WIDTH * scene.particle_spacing);
        let nodes = nodes_over(domain, voxel(look, scene)).0;
        let ripple = spec.surface.ripple.as_ref();
        let mut caustics = Self {
            size,
            margin,
            level: spec.sea.as_ref().map_or(0.0, |sea| sea.level_m),
            texel,
            hair: HAIR * voxel(look, scene),
            slopes: [sun, bent].map(|to| DVec2::new(to.x, to.z) / to.y),
            fixed: uniform::Caustics {
                towards: sun.as_vec3().to_array(),
                index: spec.water.index as f32,
                sun: bent.as_vec3().to_array(),
                texel: texel as f32,
                spacing: (TEXELS_A_RAY * texel) as f32,
                width: width as f32,
                fade: margin as f32,
                ripple: ripple.map_or([0.0; 2], |r| [r.wavelength_m as f32, r.slope as f32]),
                through: (1.0 - reflectance(sun.y, spec.water.index)) as f32,
                start: nodes.iter().product(),
                ..uniform::Caustics::default()
            },
            room: [[0; 2]; 2],
            stands: None,
        };
        let highest = caustics.standing(above(domain.y, look, scene));
        caustics.room = [highest.rays, highest.size];
        Some(caustics)
    }

    /// Values of the map.
    fn values(&self) -> usize {
        LAYERS * self.room[1].map(|n| n as usize).iter().product::<usize>()
    }

    /// Rays and map under water that ends below `top`.
    fn standing(&self, top: f64) -> uniform::Caustics {
        let [air, water] = self.slopes;
        let margin = DVec2::splat(self.margin);
        // Rays that come in through the box's sides towards the sun; of a low sun those near its top alone. Of the sea, those that come
        // down to it within the margin.
        let (first, last) = if self.margin > 0.0 {
            let shift = air * (top - self.level).max(0.0);
            (shift - margin, self.size + margin + shift)
        } else {
            let longest = DVec2::splat(self.size.max_element());
            let reach = (air * top).clamp(-longest, longest);
            (reach.min(DVec2::ZERO), self.size + reach.max(DVec2::ZERO))
        };
        let sunk = water * top;
        let corner = -margin - sunk.max(DVec2::ZERO);
        let end = self.size + margin - sunk.min(DVec2::ZERO);
        let count = |span: DVec2, edge: f64| {
            let [x, z] = (span / edge).ceil().to_array();
            [x as u32 + 1, z as u32 + 1]
        };
        let rays = count(last - first, TEXELS_A_RAY * self.texel);
        let steps = DVec2::new(f64::from(rays[0] - 1), f64::from(rays[1] - 1));
        let (first, span) = (first + self.hair, last - first - 2.0 * self.hair);
        uniform::Caustics {
            corner: corner.as_vec2().to_array(),
            size: count(end - corner, self.texel),
            first: first.as_vec2().to_array(),
            rays,
            step: (span / steps).as_vec2().to_array(),
            top: top as f32,
            ..self.fixed
        }
    }

    /// Has the device know of a sample whose water, of particles or of the sea, ends below `top` metres; whether the map has to be made
    /// anew.
    pub(super) fn stand_at(
        &mut self,
        camera: &uniform::Camera,
        top: f64,
        program: &Program,
    ) -> bool {
        let stands = [camera.seconds, camera.clock];
        if self.stands == Some(stands) {
            return false;
        }
        self.stands = Some(stands);
        let mut standing = self.standing(top);
        let [rays, size] = self.room;
        for axis in 0..2 {
            standing.rays[axis] = standing.rays[axis].min(rays[axis]);
            standing.size[axis] = standing.size[axis].min(size[axis]);
        }
        program.upload(CAUSTICS, 0, &[standing]);
        true
    }

    /// Says that the water is another.
    pub(super) fn forget(&mut self) {
        self.stands = None;
    }
}

/// A little above `height`: rays begin in air.
pub(super) fn above(height: f64, look: &Look, scene: &RenderScene) -> f64 {
    height + 2.0 * voxel(look, scene)
}

/// Fresnel's, of unpolarised light from air, over the cosine of incidence.
fn reflectance(cosine: f64, index: f64) -> f64 {
    let inside = (1.0 - (1.0 - cosine * cosine) / (index * index)).sqrt();
    let s = (cosine - index * inside) / (cosine + index * inside);
    let p = (index * cosine - inside) / (index * cosine + inside);
    0.5 * (s * s + p * p)
}

/// Values behind the lattice of the sun's ways through water.
pub(super) fn map_values(look: &Look, scene: &RenderScene) -> usize {
    Caustics::of(look, scene).map_or(0, |caustics| caustics.values())
}

/// Plans the map, and what makes it anew where the water has changed; nothing where the look has none.
pub(super) fn plan_caustics(plan: &mut Plan, look: &Look, scene: &RenderScene) -> Vec<Command> {
    let Some(caustics) = Caustics::of(look, scene) else {
        return Vec::new();
    };
    plan.define("rays/cast", "CAUSTICS");
    let [rays, [width, height]] = caustics.room;
    let count = rays.map(|n| n as usize).iter().product();
    plan.buffer(&CAUSTICS, 1);
    plan.buffer(&SUN_RAYS, count);
    plan.buffer(&SUN_HITS, count);
    plan.buffer(&LIGHT_SUMS, caustics.values());
    let over = |pass, size| Command::in_groups(pass, Groups::Pixels(size), Vec::new());
    vec![
        over("rays/caustics_enter", rays),
        over("rays/caustics_follow", rays),
        Command::clear(&LIGHT_SUMS),
        over("rays/caustics_splat", rays),
        over("rays/caustics_map", [width, LAYERS as u32 * height]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_water_throws_back_what_fresnel_says() {
        // Straight down ((n − 1) / (n + 1))²; along the surface everything.
        let straight = (0.333f64 / 2.333).powi(2);
        assert!((reflectance(1.0, 1.333) - straight).abs() < 1e-15);
        assert!((reflectance(0.0, 1.333) - 1.0).abs() < 1e-15);
        assert!(reflectance(0.3, 1.0) < 1e-15);
    }
}
