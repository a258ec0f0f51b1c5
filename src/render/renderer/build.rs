//! A plan from a look and a scene.

use super::{shade::plan_shade, splats::plan_splats};
use crate::{
    render::{
        RenderError, RenderScene,
        buffers::{CAMERA, DEPTHS, NEXT_CAMERA, SHADING},
        camera::longest_focal_px,
        frame::{Extent, bands},
        lighting::{plan_light, shading},
        plan::{Limits, Plan},
        set::{plan_solids, shadow_from_world, triangles},
        sky::Sky,
        surface::{FlowSettings, Smoothing, curvature_flow, narrow_range},
    },
    scene::look::{FilterSpec, Look},
};

/// Splat radius over particle spacing where the look leaves it out: 0.5 √3 closes a lattice seen along its
/// diagonal.
const RADIUS: f64 = 0.87;
/// Smoothing width over particle spacing where the look leaves it out.
const SMOOTHING: f64 = 1.6;

impl Plan {
    /// Plans what the look calls for and nothing more, with room for `particles` particles.
    ///
    /// # Errors
    /// A damaged panorama, a domain or spacing that is none, a mesh that names vertices it lacks.
    pub fn new(
        look: &Look,
        scene: &RenderScene,
        particles: usize,
        limits: &Limits,
    ) -> Result<Self, RenderError> {
        check(scene)?;
        let spec = look.spec();
        let has_aovs = !spec.output.aovs.is_empty();
        let extent = Extent::new(spec.image.width, spec.image.height);
        let radius = (spec.surface.radius_m).unwrap_or(RADIUS * scene.particle_spacing);
        let mut plan = Self {
            extent,
            bands: bands(&extent, has_aovs, limits.storage, limits.tile),
            radius,
            ..Self::default()
        };
        plan.buffer(&CAMERA, 1);
        if has_aovs {
            plan.buffer(&NEXT_CAMERA, 1);
        }
        for depth in &DEPTHS {
            plan.buffer(depth, extent.pixels());
        }
        let opaque = triangles(look, scene)?;
        let matrix = shadow_from_world(&opaque, scene.domain.size(), look.sun_direction());
        let sky = Sky::new(look, limits.texture)?;
        plan_light(&mut plan, &sky);
        let light = shading(look, &sky, matrix.to_cols_array_2d());
        plan.values(&SHADING, &[light]);
        let solids = plan_solids(&mut plan, &opaque, &matrix, limits);
        let Smoothing { commands, surface } = smoothing(&mut plan, look, scene);
        let spacing = scene.particle_spacing;
        let splats = plan_splats(&mut plan, look, room(particles), spacing, radius, &surface);
        let shade = plan_shade(&mut plan, look, &surface);
        plan.end_fills();
        if has_aovs {
            let splats = [splats.body.clone(), splats.owner];
            let all = [
                solids.clone(),
                splats.concat(),
                commands.clone(),
                shade.aovs,
            ];
            plan.aovs = all.concat();
        }
        plan.sample = [solids, splats.body, commands, splats.spray, shade.picture].concat();
        Ok(plan)
    }
}

/// How many particles there is room for where so many are asked for: frames differ, and few of them then need more.
pub(super) fn room(particles: usize) -> usize {
    particles.next_power_of_two()
}

fn smoothing(plan: &mut Plan, look: &Look, scene: &RenderScene) -> Smoothing {
    let surface = &look.spec().surface;
    let width = surface
        .smoothing_width_m
        .unwrap_or(SMOOTHING * scene.particle_spacing);
    let (radius, size) = (plan.radius, plan.extent.size);
    match surface.filter {
        FilterSpec::CurvatureFlow => {
            let settings = FlowSettings::for_width(width, radius, longest_focal_px(look));
            curvature_flow(plan, &settings, size)
        }
        FilterSpec::NarrowRange => narrow_range(plan, width, radius, size),
    }
}

fn check(scene: &RenderScene) -> Result<(), RenderError> {
    let size = scene.domain.size();
    if !(size.is_finite() && size.cmpgt(glam::DVec3::ZERO).all()) {
        return Err(RenderError::Scene(format!("the domain's size is {size}")));
    }
    for (name, value) in [
        ("particle_spacing", scene.particle_spacing),
        ("frames_per_second", scene.frames_per_second),
    ] {
        if !(value.is_finite() && value > 0.0) {
            return Err(RenderError::Scene(format!(
                "{name} is {value}; allowed is > 0"
            )));
        }
    }
    Ok(())
}
