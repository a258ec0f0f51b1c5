//! Caustics: sunlight that the water refracts onto what is below it. A lattice of rays from the sun
//! is traced through the level set and accumulated into a map of the light where the rays land.
//!
//! The map lies in the plane of the domain's floor. A point belongs to the texel into which
//! sunlight through flat water would carry it, so that flat water gives an even map at any depth
//! and objects above the floor receive light as sharp as the floor does. Light is relative to that
//! through flat water: 1 is the light under water of a look without caustics.

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

/// Texels between rays. Light between four rays is spread over the quad at which they land.
const TEXELS_A_RAY: f64 = 2.0;
/// Default standard deviation with which normals are smoothed, particle spacings. The
/// irregularities that particles at rest leave in a surface are some spacings long; the waves that
/// particles carry are longer.
const WIDTH: f64 = 1.5;
/// Distance of the outermost rays inside the box's sides, voxels.
const HAIR: f64 = 0.01;
/// Layers of the map: surfaces that the sun reaches through flat water, and surfaces in shadow
/// there.
const LAYERS: usize = 2;

/// Layout of the rays and the map.
#[derive(Clone, Debug)]
pub(super) struct Caustics {
    /// Size of the box along x and z, metres.
    size: DVec2,
    /// Extent of the map beyond the box's sides, metres; 0 without a sea.
    margin: f64,
    /// Still-water level of the sea, metres; 0 without a sea.
    level: f64,
    texel: f64,
    /// Distance of the outermost rays inside the box's sides, metres.
    hair: f64,
    /// Horizontal displacement of light per metre of height, in air and in flat water, towards the
    /// sun.
    slopes: [DVec2; 2],
    /// Members of the uniform that stay constant.
    fixed: uniform::Caustics,
    /// Allocated numbers of rays and of texels, along x and z.
    room: [[u32; 2]; 2],
    /// Seconds from the frame and since frame 0 for which the map is current.
    stands: Option<[f32; 2]>,
}

impl Caustics {
    /// Returns `None` where the look has no caustics.
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

    /// Number of values of the map.
    fn values(&self) -> usize {
        LAYERS * self.room[1].map(|n| n as usize).iter().product::<usize>()
    }

    /// Computes the layout of rays and map under water whose highest point is below `top`.
    fn standing(&self, top: f64) -> uniform::Caustics {
        let [air, water] = self.slopes;
        let margin = DVec2::splat(self.margin);
        // Rays that enter through the box's top or through its sides towards the sun; when the sun
        // is low, only those near the top. With a sea, the rays that reach its level within the
        // margin.
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

    /// Uploads the layout for a sample whose water, of particles or of the sea, ends below `top`
    /// metres. Returns whether the map must be rebuilt.
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

    /// Marks the map as outdated because the water has changed.
    pub(super) fn forget(&mut self) {
        self.stands = None;
    }
}

/// Adds two voxels to `height`, so that rays begin in air.
pub(super) fn above(height: f64, look: &Look, scene: &RenderScene) -> f64 {
    height + 2.0 * voxel(look, scene)
}

/// Fresnel reflectance of unpolarised light from air, by the cosine of incidence.
fn reflectance(cosine: f64, index: f64) -> f64 {
    let inside = (1.0 - (1.0 - cosine * cosine) / (index * index)).sqrt();
    let s = (cosine - index * inside) / (cosine + index * inside);
    let p = (index * cosine - inside) / (index * cosine + inside);
    0.5 * (s * s + p * p)
}

/// Number of the map's values, which follow the lattice of sun paths through water in one buffer.
pub(super) fn map_values(look: &Look, scene: &RenderScene) -> usize {
    Caustics::of(look, scene).map_or(0, |caustics| caustics.values())
}

/// Plans the buffers of the map and returns the commands that rebuild it; none where the look has
/// no caustics.
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
        // ((n − 1) / (n + 1))² at normal incidence; total reflection at grazing incidence.
        let straight = (0.333f64 / 2.333).powi(2);
        assert!((reflectance(1.0, 1.333) - straight).abs() < 1e-15);
        assert!((reflectance(0.0, 1.333) - 1.0).abs() < 1e-15);
        assert!(reflectance(0.3, 1.0) < 1e-15);
    }
}
