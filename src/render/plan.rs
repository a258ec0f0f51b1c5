//! Buffers, textures and commands of a look's frames, planned without a device.
//!
//! The renderer builds exactly this plan. Its passes are those of the commands; there is no
//! separate list of them.

use std::collections::BTreeMap;

use super::{
    RenderError, buffers::FILLS, closed::Closed, frame::Extent, moving::MovingSet, uniform::Fill,
};
use swell_gpu::{
    adapter::{Context, GpuError},
    bindings::check_bindings,
    buffer::{Buf, BufferSpec, Element, Windows},
    program::{PassSpec, Program, check_sizes},
    raster::RasterSpec,
    recording::{Bind, Command},
    texture::{SamplerSpec, TextureSpec},
};
use swell_scene::look::Look;

/// Device properties that determine how a frame is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Largest storage buffer binding, bytes.
    pub storage: u64,
    /// Largest texture size along a side, texels.
    pub texture: u32,
    /// Largest extent drawn at once, pixels along a side: of bands of the picture and of tiles of
    /// solids.
    pub tile: u32,
    /// Whether the adapter's subgroups have at most eight threads, as those of software adapters
    /// do.
    pub is_narrow: bool,
}

impl Limits {
    /// Returns the limits of an adapter.
    pub fn of(context: &Context) -> Self {
        let limits = &context.limits;
        Self {
            storage: (limits.max_storage_buffer_binding_size).min(limits.max_buffer_size),
            texture: limits.max_texture_dimension_2d,
            tile: limits.max_texture_dimension_2d,
            is_narrow: context.info.subgroup_min_size <= 8,
        }
    }
}

/// Number of times that a pass runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Runs {
    /// Runs before the first frame.
    pub once: usize,
    /// Runs for each state of the water: once per frame, or with an open shutter once per sample.
    pub water: usize,
    /// Runs for each sample of a frame.
    pub sample: usize,
    /// Runs for the additional channels of a frame's picture.
    pub aovs: usize,
}

/// Buffers, textures and commands of a look.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// All buffers to allocate.
    pub buffers: Vec<BufferSpec>,
    /// All textures to allocate.
    pub textures: Vec<TextureSpec>,
    pub(super) samplers: Vec<SamplerSpec>,
    /// Commands before the first frame.
    pub(super) once: Vec<Command>,
    /// Commands for each state of the water.
    pub(super) water: Vec<Command>,
    /// Commands for each sample of a frame.
    pub(super) sample: Vec<Command>,
    /// Commands for the additional channels; empty where the look requests none.
    pub(super) aovs: Vec<Command>,
    pub(super) extent: Extent,
    /// Rows of the picture in each of its buffers.
    pub(super) bands: Vec<u32>,
    /// Vectors per pixel in the picture's buffers: the beauty and one for each requested light
    /// component.
    pub(super) stride: usize,
    /// Radius of a splat, metres.
    pub(super) radius: f64,
    pub(super) closed: Closed,
    /// `None` where no opaque geometry moves within the shutter.
    pub(super) moving: Option<MovingSet>,
    pub(super) defines: BTreeMap<&'static str, Vec<&'static str>>,
    pub(super) constants: BTreeMap<&'static str, Vec<(&'static str, f64)>>,
    pub(super) fills: Vec<Fill>,
    pub(super) contents: Vec<(String, Vec<u8>)>,
    pub(super) texels: Vec<(String, Vec<u8>)>,
}

impl Plan {
    /// Returns the passes by name, with the number of runs of each.
    pub fn passes(&self) -> BTreeMap<&'static str, Runs> {
        let mut passes: BTreeMap<&'static str, Runs> = BTreeMap::new();
        let mut add = |commands: &[Command], count: fn(&mut Runs) -> &mut usize| {
            for name in commands.iter().filter_map(Command::pass) {
                *count(passes.entry(name).or_default()) += 1;
            }
        };
        add(&self.once, |runs| &mut runs.once);
        add(&self.water, |runs| &mut runs.water);
        add(&self.sample, |runs| &mut runs.sample);
        add(&self.aovs, |runs| &mut runs.aovs);
        passes
    }

    /// Returns the total size of all buffers and textures, bytes.
    pub fn bytes(&self) -> u64 {
        let buffers = self.buffers.iter().map(|buffer| buffer.bytes);
        let textures = self.textures.iter().map(TextureSpec::bytes);
        buffers.sum::<u64>() + textures.sum::<u64>()
    }

    /// Compute and raster passes in the form that a program compiles, by name.
    fn specs(&self) -> (Vec<PassSpec>, Vec<RasterSpec>) {
        let all = [&self.once, &self.water, &self.sample, &self.aovs];
        let commands = || all.into_iter().flatten();
        let mut rasters: BTreeMap<&'static str, RasterSpec> = BTreeMap::new();
        let mut passes: BTreeMap<&'static str, PassSpec> = BTreeMap::new();
        for command in commands() {
            match command {
                Command::Draw(draw) => {
                    rasters.insert(draw.raster.name, draw.raster);
                }
                Command::Dispatch { pass, .. } => {
                    let spec = PassSpec {
                        name: pass,
                        defines: self.defines.get(pass).cloned().unwrap_or_default(),
                        constants: self.constants.get(pass).cloned().unwrap_or_default(),
                    };
                    passes.insert(pass, spec);
                }
                _ => {}
            }
        }
        (
            passes.into_values().collect(),
            rasters.into_values().collect(),
        )
    }

    /// Checks that an adapter can allocate the buffers, and that it can bind as many as each pass
    /// needs.
    ///
    /// # Errors
    /// That of a renderer built with this plan: [`GpuError::TooLarge`],
    /// [`GpuError::TooManyBuffers`].
    pub fn check(&self, context: &Context) -> Result<(), GpuError> {
        check_sizes(context, &self.buffers)?;
        let (passes, rasters) = self.specs();
        let passes = passes.iter().map(|it| (it.name, &it.defines[..]));
        check_bindings(context, passes)?;
        check_bindings(context, rasters.iter().map(|it| (it.name, it.defines)))
    }

    /// Builds the program on a device and uploads the contents that stay constant across frames.
    pub(super) fn program(&self, context: &Context) -> Result<Program, RenderError> {
        let (passes, rasters) = self.specs();
        let program = Program::new(context, &self.buffers, &passes, &[])?
            .with_rasters(&rasters)?
            .with_textures(&self.textures, &self.samplers)?;
        for (name, bytes) in &self.contents {
            program.upload(Buf::named(name.clone()), 0, bytes);
        }
        for (name, bytes) in &self.texels {
            program.upload_texture(name, bytes);
        }
        Ok(program)
    }

    /// Whether the plan has a buffer with this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.buffers.iter().any(|buffer| buffer.name == name)
    }

    /// Replaces the buffer with the same name, if there is one, where `to` is larger.
    pub(super) fn grow(&mut self, to: BufferSpec) {
        let found = self.buffers.iter_mut().find(|it| it.name == to.name);
        if let Some(buffer) = found
            && buffer.bytes < to.bytes
        {
            *buffer = to;
        }
    }

    /// Adds a buffer of `count` zeros.
    pub(super) fn buffer<T: Element>(&mut self, buffer: &Buf<T>, count: usize) {
        self.buffers.push(buffer.sized(count));
    }

    /// Adds a buffer of `count` values for particles, which passes bind page by page; as a whole
    /// where the look has additional channels, whose motion may look up any particle.
    pub(super) fn per_particle<T: Element>(&mut self, buffer: &Buf<T>, count: usize, look: &Look) {
        self.buffers.push(per_particle(buffer, count, look));
    }

    /// Adds a buffer with these values.
    pub(super) fn values<T: Element>(&mut self, buffer: &Buf<T>, values: &[T]) {
        self.buffer(buffer, values.len());
        let bytes = bytemuck::cast_slice(values).to_vec();
        self.contents.push((buffer.name().to_owned(), bytes));
    }

    /// Adds a uniform buffer of which each dispatch binds one of these values.
    pub(super) fn windows<T: Element>(&mut self, windows: &Windows<T>, values: &[T]) {
        self.buffers.push(windows.sized(values.len()));
        let bytes = Windows::bytes(values);
        self.contents.push((windows.name().to_owned(), bytes));
    }

    /// Adds a texture with these texels.
    pub(super) fn texture(&mut self, spec: TextureSpec, texels: Vec<u8>) {
        self.texels.push((spec.name.clone(), texels));
        self.textures.push(spec);
    }

    /// Adds a shader define to a pass.
    pub(super) fn define(&mut self, pass: &'static str, condition: &'static str) {
        let conditions = self.defines.entry(pass).or_default();
        if !conditions.contains(&condition) {
            conditions.push(condition);
        }
    }

    /// Returns a command that sets each of a buffer's first `count` words.
    pub(super) fn fill<T>(&mut self, buffer: &Buf<T>, word: u32, count: usize) -> Command {
        let index = self.fills.len();
        self.fills.push(Fill {
            word,
            count: u32::try_from(count).unwrap_or(u32::MAX),
            ..Fill::default()
        });
        let binds = vec![FILLS.bind(index), Bind::whole("words", buffer)];
        Command::with("ssfr/fill", count, binds)
    }

    /// Adds the uniforms of [`Self::fill`]; to be called after the last fill.
    pub(super) fn end_fills(&mut self) {
        let fills = std::mem::take(&mut self.fills);
        if !fills.is_empty() {
            self.windows(&FILLS, &fills);
        }
    }
}

/// Description of the buffer that [`Plan::per_particle`] adds.
pub(super) fn per_particle<T: Element>(buffer: &Buf<T>, count: usize, look: &Look) -> BufferSpec {
    let spec = buffer.sized(count);
    match look.spec().output.aovs.is_empty() {
        true => spec.windowed(),
        false => spec,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use std::{collections::BTreeSet, path::Path};

    use glam::DVec3;

    use super::*;
    use crate::{Mover, PosePath, RenderScene, SetMotion};
    use swell_domain::{bounds::Bounds, mesh::TriangleMesh, pose::Pose};
    use swell_files::parse_look;
    use swell_gpu::{
        raster::Draw,
        recording::Groups,
        reflect::{Access, reflect},
        shader::compose,
    };

    const LIMITS: Limits = Limits {
        storage: 1 << 27,
        texture: 8192,
        tile: 64,
        is_narrow: false,
    };

    fn plan(surface: &str, more: &str) -> Plan {
        plan_of("", surface, more)
    }

    fn plan_of(image: &str, surface: &str, more: &str) -> Plan {
        plan_with(Vec::new(), image, surface, more)
    }

    /// The plan of a triangle with these motions.
    fn plan_with(moving: Vec<SetMotion>, image: &str, surface: &str, more: &str) -> Plan {
        let corners = TriangleMesh {
            vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            triangles: vec![[0, 1, 2]],
        };
        let solids = if moving.is_empty() {
            Vec::new()
        } else {
            vec![corners]
        };
        let text = format!(
            "[camera]\nfocal_length_mm = 35.0\nfilm_back_mm = [36.0, 18.0]\n\
             position = [-2.0, 3.0, 2.5]\n\
             target = [0.0, 1.0, 0.75]\n[image]\nwidth = 96\nheight = 48\n{image}[surface]\n\
             filter = \"{surface}\"\n\
             [sky]\nmodel = \"hosek_wilkie\"\n[sun]\nazimuth_degrees = 120.0\n\
             elevation_degrees = 35.0\n{more}"
        );
        let look = parse_look(&text, Path::new("look.toml")).unwrap();
        let scene = RenderScene {
            origin: DVec3::ZERO,
            domain: Bounds {
                min: DVec3::ZERO,
                max: DVec3::ONE,
            },
            solids,
            wet: None,
            parts: Vec::new(),
            particle_spacing: 0.1,
            frames_per_second: 24.0,
            gravity: DVec3::ZERO,
            wave_makers: Vec::new(),
            moving,
            waves: None,
        };
        Plan::new(&look, &scene, &LIMITS).unwrap()
    }

    /// Names of the buffers, textures and samplers that commands use.
    fn used(plan: &Plan) -> BTreeSet<String> {
        let mut used = BTreeSet::new();
        let all = [&plan.once, &plan.water, &plan.sample, &plan.aovs];
        for command in all.into_iter().flatten() {
            let binds = match command {
                Command::Dispatch { binds, groups, .. } => {
                    if let Groups::Indirect { buffer, .. } = groups {
                        used.insert(buffer.clone());
                    }
                    binds
                }
                Command::Draw(Draw {
                    binds,
                    colours,
                    depth,
                    ..
                }) => {
                    used.extend(colours.iter().chain([depth]).map(|t| t.texture.clone()));
                    binds
                }
                Command::Clear(buffer) => {
                    used.insert(buffer.clone());
                    continue;
                }
                Command::ClearDepth(target) => {
                    used.insert(target.texture.clone());
                    continue;
                }
                Command::CopyTexture(copy) => {
                    used.extend([copy.texture.clone(), copy.buffer.clone()]);
                    continue;
                }
            };
            let pass = command.pass().unwrap();
            let defines = plan.defines.get(pass).cloned().unwrap_or_default();
            for binding in reflect(pass, &compose(pass, &defines).unwrap())
                .unwrap()
                .bindings
            {
                let bind = binds.iter().find(|bind| bind.variable == binding.name);
                let name = bind.map_or(&binding.name, |bind| &bind.buffer);
                if let Some(buffer) = plan.buffers.iter().find(|buffer| buffer.name == *name) {
                    let is_uniform = binding.access == Access::Uniform;
                    assert_eq!(is_uniform, buffer.is_uniform, "{pass}: {name}");
                    let window = bind.and_then(|bind| bind.window);
                    let bytes = window.map_or(buffer.bytes, |(_, bytes)| bytes);
                    let least = u64::from(binding.element.stride);
                    assert!(bytes >= least, "{pass}: {name}");
                }
                used.insert(name.clone());
            }
        }
        used
    }

    fn planned(plan: &Plan) -> BTreeSet<String> {
        let buffers = plan.buffers.iter().map(|buffer| buffer.name.clone());
        let textures = plan.textures.iter().map(|texture| texture.name.clone());
        let samplers = plan.samplers.iter().map(|spec| spec.name.to_owned());
        buffers.chain(textures).chain(samplers).collect()
    }

    /// Defines of the passes that draw ripples and windows, for both methods.
    #[test]
    fn ripples_and_windows_are_drawn_where_the_look_has_them() {
        const BOTH: &str = "[surface.ripple]\nwavelength_m = 1.0\nslope = 0.1\n\
            [solids.windows]\nstorey_m = 1.0\nbay_m = 1.0\n[water]\n\
            caustics = { resolution = 64 }\n";
        let conditions = |pass: &str, method: &str, more: &str| {
            let more = format!("[renderer]\nmethod = \"{method}\"\n{more}");
            let plan = plan("curvature_flow", &more);
            let of_pass = plan.defines.get(pass).cloned().unwrap_or_default();
            ["RIPPLES", "WINDOWS"].map(|condition| of_pass.contains(&condition))
        };
        for (pass, method) in [
            ("ssfr/shade", "ssfr"),
            ("ssfr/shade_dry", "ssfr"),
            ("rays/cast", "ray"),
            ("rays/caustics_follow", "ray"),
        ] {
            let more = match method {
                "ray" => BOTH,
                _ => BOTH.split("[water]").next().unwrap(),
            };
            assert_eq!(conditions(pass, method, more), [true; 2], "{pass}");
            assert_eq!(conditions(pass, method, ""), [false; 2], "{pass}");
        }
    }

    fn slides(metres_per_second: f64) -> Vec<SetMotion> {
        let pose = move |t: f64| Pose {
            centre: metres_per_second * t * DVec3::X,
            ..Pose::START
        };
        vec![SetMotion {
            mover: Mover::Solid(0),
            path: PosePath::new(pose),
        }]
    }

    /// What a look takes of the device: its commands and buffers.
    fn taken(plan: &Plan) -> String {
        format!("{:?} {:?} {:?}", plan.passes(), plan.buffers, plan.defines)
    }

    #[test]
    fn motion_costs_something_only_where_it_is_shown() {
        const ONCE: &str = "shutter = 0.5\nsamples = 1\n";
        const OPEN: &str = "shutter = 0.5\nsamples = 4\n";
        const FORWARD: &str = "[output]\nformats = [\"exr\"]\naovs = [\"forward\"]\n";
        for method in ["", "[renderer]\nmethod = \"ray\"\n"] {
            let of = |moving, image: &str, more: &str| {
                let plan = plan_with(moving, image, "narrow_range", &format!("{method}{more}"));
                assert_eq!(used(&plan), planned(&plan), "{method} {image} {more}");
                plan
            };
            let shadows = |plan: &Plan| {
                let runs = plan.passes()["ssfr/shadow"];
                [runs.once, runs.sample]
            };
            for image in ["", ONCE, OPEN] {
                let rests = of(slides(0.0), image, FORWARD);
                assert!(rests.moving.is_none() && !rests.has("carried"));
                assert_eq!(shadows(&rests), [1, 0]);
                // With splats a shutter without a second instant is as good as closed.
                let is_open = image == OPEN || (image == ONCE && !method.is_empty());
                let moves = of(slides(1.0), image, "");
                assert_eq!(moves.moving.is_some(), is_open, "{image}");
                let same = taken(&moves) == taken(&of(slides(0.0), image, ""));
                assert_eq!(same, !is_open, "{image}");
                let has_moments = !image.is_empty() && !method.is_empty();
                assert_eq!(moves.has("moments"), has_moments, "{image}");
            }
            assert_eq!(shadows(&of(slides(1.0), OPEN, "")), [0, 1]);
            let vectors = of(slides(1.0), "", FORWARD);
            assert!(vectors.moving.is_none() && vectors.has("carried"));
        }
    }

    #[test]
    fn what_is_planned_is_what_commands_use() {
        const ALL: &str = "[output]\nformats = [\"exr\"]\naovs = [\"Z\", \"forward\"]\n[basin]\n\
            height_m = 0.5\n\
            [water]\nspray = { density_per_metre = 9.0, speed_m_per_s = 5.5 }\n";
        let depth_alone = "[output]\nformats = [\"exr\"]\naovs = [\"Z\"]\n";
        const LIGHTS: &str = "[output]\nformats = [\"exr\"]\ncryptomatte = true\n\
                              lights = [\"sun\", \"spray\"]\nsolids = \"holdout\"\n";
        const SEA: &str = "[output]\nformats = [\"exr\"]\naovs = [\"Z\"]\ncryptomatte = true\n\
            [sea]\nlevel_m = 0.5\n\
            [basin]\nheight_m = 0.5\ncolour = [0.5, 0.5, 0.5]\n";
        let mut sizes = BTreeSet::new();
        for surface in ["curvature_flow", "narrow_range"] {
            for more in ["", depth_alone, ALL, LIGHTS, SEA] {
                let plan = plan(surface, more);
                assert_eq!(used(&plan), planned(&plan), "{surface} {more}");
                sizes.insert(plan.bytes());
            }
        }
        const RAYS: &str = "[renderer]\nmethod = \"ray\"\n";
        for more in ["", depth_alone, ALL, LIGHTS, SEA] {
            let plan = plan("curvature_flow", &format!("{RAYS}{more}"));
            assert_eq!(used(&plan), planned(&plan), "rays {more}");
            sizes.insert(plan.bytes());
        }
        const CAUSTICS: &str = "[water]\ncaustics = { resolution = 64 }\n";
        for more in [CAUSTICS, &format!("{CAUSTICS}{SEA}")] {
            let plan = plan("curvature_flow", &format!("{RAYS}{more}"));
            assert_eq!(used(&plan), planned(&plan), "rays {more}");
            sizes.insert(plan.bytes());
        }
        assert_eq!(sizes.len(), 17, "each look takes what it needs: {sizes:?}");
        // Wet solids take no buffer and no byte but those of their finer triangles.
        const WALLS: &str = "[basin]\nheight_m = 0.5\n";
        for method in ["", RAYS] {
            let [dry, wet] =
                ["", "[wet]\n"].map(|it| plan("narrow_range", &format!("{method}{WALLS}{it}")));
            assert_eq!(used(&wet), planned(&wet), "wet {method}");
            assert_eq!((planned(&wet), wet.bytes()), (planned(&dry), dry.bytes()));
        }
        // Paths exist where the shutter is open, and motion of spray where a channel shows it.
        let motion_alone = "[output]\nformats = [\"exr\"]\naovs = [\"forward\"]\n";
        let white = "[whitewater]\n";
        for method in ["", RAYS] {
            for more in ["", motion_alone, white, ALL] {
                let plan = plan_of(
                    "shutter = 0.5\n",
                    "narrow_range",
                    &format!("{method}{more}"),
                );
                assert_eq!(used(&plan), planned(&plan), "open: {method} {more}");
                let has_paths = plan.buffers.iter().any(|buffer| buffer.name == "paths");
                // With rays, the CPU moves particles, except for splatted drops.
                assert_eq!(
                    has_paths,
                    method.is_empty() || more == ALL,
                    "{method} {more}"
                );
                let has_motion = plan.passes().contains_key("ssfr/splat_spray_aovs");
                assert_eq!(has_motion, more == ALL, "{method} {more}");
            }
        }
        // Controls: a buffer that nothing uses, and a command whose buffer is not planned.
        let mut spare = plan("narrow_range", "");
        spare.buffer(&crate::buffers::SPRAY, 1);
        assert_ne!(used(&spare), planned(&spare));
        let mut lacking = plan("narrow_range", "");
        lacking.buffers.retain(|buffer| buffer.name != "particles");
        assert_ne!(used(&lacking), planned(&lacking));
    }
}
