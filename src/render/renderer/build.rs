//! Builds a plan from a look and a scene.

use super::{
    shade::{plan_carried, plan_cast, plan_shade, wants_spray_aovs},
    splats::{
        plan_body, plan_owner, plan_owner_before_rays, plan_particles, plan_shapes, plan_spray,
        plan_threads,
    },
};
use crate::{
    RenderError, RenderScene,
    buffers::{
        CAMERA, CLOUD, CLOUD_WORDS, DEPTHS, FIRST_DEPTH, MOMENTS, NEXT_CAMERA, SHADING, SOLID_DEPTH,
    },
    camera::longest_focal_px,
    caustics::{map_values, plan_caustics},
    closed::Closed,
    frame::{Extent, bands},
    lighting::{plan_details, plan_light, shading},
    materials::plan_materials,
    moving::MovingSet,
    opaque::Opaque,
    plan::{Limits, Plan},
    rays::{first, plan_rays},
    samples,
    sea::plan_sea,
    set::{Set, plan_palette, plan_shadow, plan_solids, shadow_from_world},
    shapes::RADIUS,
    sky::Sky,
    surface::{FlowSettings, Smoothing, curvature_flow, narrow_range},
    wet::plan_wet,
};
use swell_scene::look::{AovSpec, FilterSpec, Look, MethodSpec, SplatSpec};

/// Largest number of pixels per ray-casting dispatch, so that none runs long enough to lose the
/// device.
const CAST: u32 = 1 << 17;
/// Default smoothing width over particle spacing. Spheres need enough to hide their bumps;
/// ellipsoids are smooth except for the particles' noise, and wider smoothing would remove waves
/// (`docs/studies.md`, the drawn surface).
const fn smoothing_of(splat: SplatSpec) -> f64 {
    match splat {
        SplatSpec::Ellipsoid => 0.5,
        SplatSpec::Sphere => 1.6,
    }
}

impl Plan {
    /// Plans exactly the resources that the look needs, with the initial capacity for particles.
    ///
    /// # Errors
    /// A damaged panorama, an invalid domain or particle spacing, or a mesh that refers to missing
    /// vertices.
    pub fn new(look: &Look, scene: &RenderScene, limits: &Limits) -> Result<Self, RenderError> {
        check(scene)?;
        let spec = look.spec();
        let has_aovs = !spec.output.aovs.is_empty();
        let extent = Extent::of(look);
        let stride = 1 + look.lights().len();
        let radius = (spec.surface.radius_m).unwrap_or(RADIUS * scene.particle_spacing);
        let rows = match spec.renderer.method {
            MethodSpec::Ssfr => limits.tile,
            MethodSpec::Ray => limits.tile.min((CAST / extent.picture[0]).max(1)),
        };
        let mut plan = Self {
            extent,
            bands: bands(&extent, (stride, has_aovs), limits.storage, rows),
            stride,
            radius,
            ..Self::default()
        };
        plan.buffer(&CAMERA, 1);
        if has_aovs {
            plan.buffer(&NEXT_CAMERA, 1);
        }
        let mut opaque = Opaque::new(look, scene)?;
        if spec.renderer.method == MethodSpec::Ssfr {
            plan.closed = Closed::put_first(&mut opaque.triangles, &mut opaque.movers);
        }
        let places = opaque.placed();
        let Opaque {
            triangles,
            palette,
            painted,
            movers,
            place_movers,
            codes,
        } = opaque;
        plan.moving = (!movers.is_empty()).then(|| {
            let (triangles, places) = ((&*triangles, &*movers), (&*places, &*place_movers));
            MovingSet::new((look, scene), triangles, places)
        });
        let set = Set {
            triangles: &triangles,
            places: &places,
            is_indexed: look.materials().is_some() || spec.wet.is_some(),
        };
        // One projection for all samples, so that shadows of what rests stay where they are.
        let swept = plan.moving.iter().flat_map(MovingSet::swept);
        let cast = triangles.iter().copied().chain(swept);
        let matrix = shadow_from_world(cast, scene.domain.size(), look.sun_direction());
        let sky = Sky::new(look, limits.texture)?;
        plan_light(&mut plan, &sky);
        let light = shading(look, scene, &sky, matrix.to_cols_array_2d());
        plan.values(&SHADING, &[light]);
        let shaded = match spec.renderer.method {
            MethodSpec::Ssfr => &[
                "ssfr/shade",
                "ssfr/shade_dry",
                "ssfr/shade_bare",
                "ssfr/shade_aovs",
                "ssfr/shade_objects",
            ][..],
            MethodSpec::Ray => &[
                "rays/cast",
                "rays/aovs",
                "rays/first",
                "rays/objects",
                "rays/caustics_enter",
                "rays/caustics_follow",
            ],
        };
        plan_details(&mut plan, look, shaded);
        plan_palette(&mut plan, &palette, shaded);
        let painting = match spec.renderer.method {
            MethodSpec::Ssfr => shaded,
            MethodSpec::Ray => &["rays/cast"],
        };
        plan_materials(&mut plan, look, &painted, painting, limits)?;
        // Rays have the triangles anyway.
        let indexed = match spec.renderer.method {
            MethodSpec::Ssfr => shaded,
            MethodSpec::Ray => &[],
        };
        plan_wet(&mut plan, look, indexed, painting);
        plan_sea(&mut plan, look, scene, shaded);
        let shadow = plan_shadow(&mut plan, &set, &matrix, limits);
        plan_carried(&mut plan, look, scene, &codes);
        match spec.renderer.method {
            MethodSpec::Ssfr => plan_ssfr(&mut plan, look, scene, &set, limits),
            MethodSpec::Ray => plan_ray(&mut plan, look, scene, &set),
        }
        match plan.moving {
            Some(_) => plan.sample.insert(0, shadow),
            None => plan.once.push(shadow),
        }
        plan_threads(&mut plan, limits);
        plan.end_fills();
        Ok(plan)
    }
}

/// Plans screen-space rendering.
fn plan_ssfr(plan: &mut Plan, look: &Look, scene: &RenderScene, set: &Set<'_>, limits: &Limits) {
    for depth in &DEPTHS {
        plan.buffer(depth, plan.extent.pixels());
    }
    let solids = plan_solids(plan, set, limits);
    let mut moving = vec!["ssfr/splat_depth", "ssfr/splat_thickness"];
    if look.spec().water.spray.is_some() {
        moving.push("ssfr/splat_spray");
    }
    plan_particles(plan, look, &moving);
    if look.spec().surface.splat == SplatSpec::Ellipsoid {
        plan_shapes(plan, look);
    }
    let body = plan_body(plan, scene.particle_spacing);
    let owner = match look.wants(AovSpec::Forward) {
        true => plan_owner(plan),
        false => Vec::new(),
    };
    let Smoothing { commands, surface } = smoothing(plan, look, scene);
    if look.spec().whitewater.is_some() {
        plan_cloud(plan);
    }
    let spray = plan_spray(plan, look, &surface, &SOLID_DEPTH);
    let shade = plan_shade(plan, look, &surface);
    if !shade.aovs.is_empty() {
        let before = [solids.clone(), body.clone(), owner];
        plan.aovs = [before.concat(), commands.clone(), spray.aovs, shade.aovs].concat();
    }
    plan.sample = [solids, body, commands, spray.sample, shade.picture].concat();
}

/// Plans ray-cast rendering.
fn plan_ray(plan: &mut Plan, look: &Look, scene: &RenderScene, set: &Set<'_>) {
    // The caustics map follows the lattice of sunlight in one buffer, because the pass has no
    // binding left.
    let behind = map_values(look, scene);
    let (rays, hierarchy) = plan_rays(plan, look, scene, set, behind);
    if let Some(moving) = &mut plan.moving {
        moving.cast(rays, hierarchy);
    }
    plan.water = plan_caustics(plan, look, scene);
    let has_drops = look.spec().water.spray.is_some();
    let has_spray = has_drops || look.spec().whitewater.is_some();
    let has_owner = look.wants(AovSpec::Forward);
    if has_spray || has_owner {
        for depth in &DEPTHS {
            plan.buffer(depth, plan.extent.pixels());
        }
    }
    if has_drops || has_owner {
        let moving: &[&str] = if has_drops {
            &["ssfr/splat_spray"]
        } else {
            &[]
        };
        plan_particles(plan, look, moving);
    }
    if has_spray {
        plan_cloud(plan);
        plan.buffer(&FIRST_DEPTH, plan.extent.pixels());
        plan.define("rays/first", "SPRAY");
    }
    let mut sample = Vec::new();
    let mut before = Vec::new();
    if has_owner || wants_spray_aovs(look) {
        before.push(first(plan));
    }
    if has_spray {
        let spray = plan_spray(plan, look, &DEPTHS[0], &DEPTHS[1]);
        sample.push(first(plan));
        sample.extend(spray.sample);
        before.extend(spray.aovs);
    }
    if has_owner {
        before.extend(plan_owner_before_rays(plan));
    }
    let shade = plan_cast(plan, look);
    if !shade.aovs.is_empty() {
        plan.aovs = [before, shade.aovs].concat();
    }
    if look.spec().image.shutter > 0.0 {
        plan_shutter(plan);
    }
    plan.sample = [sample, shade.picture].concat();
}

/// Plans the grid of drops and bubbles, and the foam.
fn plan_cloud(plan: &mut Plan) {
    plan.buffer(&CLOUD, 1);
    plan.buffer(&CLOUD_WORDS, 1);
}

/// Passes that draw samples of moving water, and those whose rays have an instant each.
const OPEN: [&str; 8] = [
    "rays/cast",
    "rays/aovs",
    "rays/first",
    "rays/objects",
    "rays/caustics_enter",
    "rays/caustics_follow",
    "ssfr/splat_spray",
    "ssfr/splat_whitewater",
];

/// Plans the moments of the rays of a sample.
fn plan_shutter(plan: &mut Plan) {
    plan.buffer(&MOMENTS, samples::MOMENTS);
    for pass in OPEN {
        plan.define(pass, "SHUTTER");
    }
}

/// Capacity for a number of particles, rounded up to a power of two, so that few frames cause a
/// reallocation.
pub(super) fn capacity_for(particles: usize) -> usize {
    particles.next_power_of_two()
}

fn smoothing(plan: &mut Plan, look: &Look, scene: &RenderScene) -> Smoothing {
    let surface = &look.spec().surface;
    let width = surface
        .smoothing_width_m
        .unwrap_or(smoothing_of(surface.splat) * scene.particle_spacing);
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
