//! A renderer from a look and a scene.

use wgpu::Buffer;

use super::{
    Renderer,
    buffers::{Buffers, camera_buffer},
    shade::Shade,
    splats::Splats,
};
use crate::{
    gpu::adapter::Context,
    render::{
        RenderError, RenderScene,
        camera::longest_focal_px,
        frame::{Extent, FAR, Filler, bands},
        pass::Timer,
        set::{Set, shadow_from_world, shadow_map, triangles, upload},
        surface::{CurvatureFlow, Filter, FlowSettings, NarrowRange},
    },
    scene::look::{FilterSpec, Look},
};

/// Splat radius over particle spacing where the look leaves it out: 0.5 √3 closes a lattice seen along its
/// diagonal.
const RADIUS: f64 = 0.87;
/// Smoothing width over particle spacing where the look leaves it out.
const SMOOTHING: f64 = 1.6;

impl Renderer {
    /// Builds what the look calls for and nothing more.
    ///
    /// # Errors
    /// A frame larger than the adapter's buffers, a damaged panorama, a mesh that names vertices it lacks.
    pub fn new(context: &Context, look: &Look, scene: &RenderScene) -> Result<Self, RenderError> {
        let most = context.limits.max_texture_dimension_2d;
        Self::with_tile_limit(context, look, scene, most)
    }

    /// As [`Renderer::new`], with textures and bands of the picture no larger than `tile_limit` pixels along a
    /// side. The picture is the same at any limit.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn with_tile_limit(
        context: &Context,
        look: &Look,
        scene: &RenderScene,
        tile_limit: u32,
    ) -> Result<Self, RenderError> {
        check(scene)?;
        let spec = look.spec();
        let tile_limit = tile_limit.clamp(16, context.limits.max_texture_dimension_2d);
        let extent = Extent::new(spec.image.width, spec.image.height);
        let radius = spec
            .surface
            .radius_m
            .unwrap_or(RADIUS * scene.particle_spacing);
        let mut timer = Timer::new(context);
        let camera = camera_buffer(context);
        let buffers = Buffers::new(context, look, &extent)?;
        let filler = Filler::new(context)?;
        let fill = |buffer: &Buffer, word| filler.prepare(context, buffer, word, extent.pixels());

        let opaque = triangles(look, scene)?;
        let has_solids = !opaque.is_empty();
        let matrix = shadow_from_world(&opaque, scene.domain.size(), look.sun_direction());
        let uploaded = has_solids.then(|| upload(context, &opaque));
        let drawn = uploaded.as_ref().map(|buffer| (buffer, opaque.len()));
        let shadow = shadow_map(context, &mut timer, &matrix, drawn)?;
        let set = match drawn {
            Some((buffer, count)) => Some(Set::new(
                context, &extent, tile_limit, &camera, buffer, count,
            )?),
            None => None,
        };

        let filter = filter(context, look, scene, radius, &camera, &buffers, &extent)?;
        let shade = Shade::new(context, look, camera, shadow, matrix.to_cols_array_2d())?;
        let bands = bands(context, &extent, shade.aovs.is_some(), tile_limit)?;
        let mut renderer = Self {
            context: context.clone(),
            look: look.clone(),
            scene: scene.clone(),
            radius,
            splats: Splats::new(context, look, scene.particle_spacing, radius)?,
            clear_depth: fill(&buffers.depth[0], FAR.to_bits()),
            clear_owner: buffers.owner.as_ref().map(|owner| fill(owner, u32::MAX)),
            clear_solid: fill(&buffers.solid_depth, FAR.to_bits()),
            extent,
            buffers,
            bands,
            filler,
            set,
            filter,
            shade,
            shade_groups: Vec::new(),
            bound: None,
            has_solids,
            timer,
        };
        let surface = renderer.surface();
        renderer.shade_groups =
            renderer
                .shade
                .bind(context, &renderer.bands, &renderer.buffers, surface);
        context.wait()?;
        Ok(renderer)
    }
}

fn filter(
    context: &Context,
    look: &Look,
    scene: &RenderScene,
    radius: f64,
    camera: &Buffer,
    buffers: &Buffers,
    extent: &Extent,
) -> Result<Filter, RenderError> {
    let surface = &look.spec().surface;
    let width = surface
        .smoothing_width_m
        .unwrap_or(SMOOTHING * scene.particle_spacing);
    let depths = [&buffers.depth[0], &buffers.depth[1]];
    let size = extent.size;
    Ok(match surface.filter {
        FilterSpec::CurvatureFlow => {
            let settings = FlowSettings::for_width(width, radius, longest_focal_px(look));
            let flow = CurvatureFlow::new(context, &settings, camera, depths, size)?;
            Filter::Flow(Box::new(flow))
        }
        FilterSpec::NarrowRange => Filter::Narrow(NarrowRange::new(
            context, width, radius, camera, depths, size,
        )?),
    })
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
