//! The sea beyond the box: its still level, its waves, and the heights at which the simulated water
//! joins it.

use glam::{DVec2, DVec3, Vec3};

use super::{
    RenderScene,
    buffers::{SEA, SEA_VALUES},
    paths::{Path, body_of},
    plan::Plan,
    uniform,
};
use swell_domain::{
    level_set::{
        VOXELS,
        edges::{Edges, nodes_along},
    },
    motion::Spectrum,
    open_waves::{LINES, Meeting, OpenSea, OpenWaves, WaveComponent},
};
use swell_gpu::program::Program;
use swell_scene::look::{Look, SeaSpec, SeaWavesSpec};

/// Peak enhancement γ of a growing sea (Hasselmann et al. 1973).
const PEAK_ENHANCEMENT: f64 = 3.3;
/// Default shortest period over the peak period; the look's ripples represent shorter waves.
const SHORTEST: f64 = 0.35;
/// Gravity for waves that the look specifies, m/s²; waves of the scene use the scene's gravity.
const GRAVITY: f64 = 9.81;
/// Bound of the sea's height in standard deviations; a Gaussian sea exceeds it at two of 10⁸
/// points.
const HIGHEST: f64 = 5.5;

/// Waves of a sea, with lengths in metres from the domain's least corner; `None` for a still sea.
fn waves(look: &SeaSpec, scene: &RenderScene) -> Option<OpenWaves> {
    let Some(asked) = &look.waves else {
        return scene.waves.clone();
    };
    Some(OpenWaves::sea(
        &open_sea(asked, look.level_m),
        asked.direction_degrees.to_radians(),
    ))
}

fn open_sea(asked: &SeaWavesSpec, depth: f64) -> OpenSea {
    OpenSea {
        spectrum: Spectrum::Jonswap,
        meeting: Meeting::Random {
            significant_height: asked.significant_height_m,
            seed: asked.seed,
        },
        peak_period: asked.peak_period_s,
        peak_enhancement: PEAK_ENHANCEMENT,
        shortest_period: (asked.shortest_period_s).unwrap_or(SHORTEST * asked.peak_period_s),
        depth,
        gravity: GRAVITY,
        ramp: 0.0,
        spreading: Some(asked.spreading),
    }
}

/// Plans the sea; does nothing where the look has none.
pub(super) fn plan_sea(plan: &mut Plan, look: &Look, scene: &RenderScene, passes: &[&'static str]) {
    if look.spec().sea.is_none() {
        return;
    }
    for pass in passes {
        plan.define(pass, "SEA");
    }
    let [nx, nz] = nodes_along(scene.domain.size(), scene.particle_spacing).map(|n| n as usize);
    plan.buffer(&SEA, 1);
    plan.buffer(
        &SEA_VALUES,
        2 * LINES as usize + (2 * (nx + nz)).div_ceil(4),
    );
}

/// The sea of a look, and its state on the device.
pub(super) struct Sea {
    look: SeaSpec,
    /// Wave components in order of decreasing wavelength.
    lines: Vec<WaveComponent>,
    waves: Option<OpenWaves>,
    /// Positions and paths of the body's particles.
    places: Vec<(Vec3, Path)>,
    /// Seconds from the frame and since frame 0 for which the device holds the sea.
    stands: Option<[f32; 2]>,
    /// Greatest height of the sea at that instant, metres.
    highest: f64,
}

impl Sea {
    /// Returns `None` where the look has no sea.
    pub(super) fn of(look: &Look, scene: &RenderScene) -> Option<Self> {
        let look = look.spec().sea.clone()?;
        let waves = waves(&look, scene);
        let mut lines = waves.as_ref().map_or_else(Vec::new, |it| it.lines.clone());
        lines.sort_by(|a, b| a.number.length().total_cmp(&b.number.length()));
        Some(Self {
            look,
            lines,
            waves,
            places: Vec::new(),
            stands: None,
            highest: 0.0,
        })
    }

    /// Takes the particles of a frame that belong to the body; without `paths` they move in
    /// straight lines.
    pub(super) fn take(&mut self, particles: &[uniform::Particle], paths: &[Path]) {
        self.places = body_of(particles, paths);
        self.stands = None;
    }

    /// Uploads the sea at the instant of a sample.
    pub(super) fn stand_at(
        &mut self,
        camera: &uniform::Camera,
        program: &mut Program,
        scene: &RenderScene,
    ) {
        let stands = [camera.seconds, camera.clock];
        if self.stands == Some(stands) {
            return;
        }
        self.stands = Some(stands);
        let moved: Vec<DVec3> = self
            .places
            .iter()
            .map(|(p, path)| p.as_dvec3() + path.displacement(camera.seconds))
            .collect();
        let edges = Edges::new(&moved, scene.domain.size(), scene.particle_spacing);
        let uniform = self.uniform(&edges, scene);
        self.highest = uniform.high.into();
        program.upload(SEA, 0, &[uniform]);
        program.upload(SEA_VALUES, 0, &self.values(&edges, camera.clock.into()));
    }

    /// Greatest height of the sea on the device, metres.
    pub(super) fn highest(&self) -> f64 {
        self.highest
    }

    fn uniform(&self, edges: &Edges, scene: &RenderScene) -> uniform::Sea {
        let level = self.look.level_m;
        let variance: f64 = self.lines.iter().map(|it| 0.5 * it.elevation.powi(2)).sum();
        // With few components, the sum of their amplitudes is less.
        let sum: f64 = self.lines.iter().map(|it| it.elevation.abs()).sum();
        let swing = (HIGHEST * variance.sqrt()).min(sum);
        let heights = edges.heights.iter().map(|&h| f64::from(h));
        let low = heights.clone().fold(level - swing, f64::min);
        let high = heights.fold(level + swing, f64::max);
        let sides = self.look.sides.iter();
        uniform::Sea {
            size: scene.domain.size().as_vec3().to_array(),
            level: level as f32,
            low: low as f32,
            high: high as f32,
            band: self.look.band_m as f32,
            hair: (1e-3 * scene.particle_spacing / VOXELS) as f32,
            nodes: edges.nodes,
            lines: self.lines.len() as u32,
            sides: sides.fold(0, |bits, wall| {
                bits | 1 << (2 * wall.axis + usize::from(wall.is_max))
            }),
        }
    }

    /// Two vectors per wave component: wave vector, current phase and amplitude; then angular
    /// frequency and amplitude of the horizontal velocity. The heights along the edges follow, four
    /// per vector.
    fn values(&self, edges: &Edges, clock: f64) -> Vec<[f32; 4]> {
        let grown = self.waves.as_ref().map_or(0.0, |waves| waves.grown(clock));
        let mut quads = vec![[0.0; 4]; 2 * LINES as usize];
        for (pair, line) in quads.chunks_exact_mut(2).zip(&self.lines) {
            let DVec2 { x, y } = line.number;
            let phase = (line.phase - line.frequency * clock).rem_euclid(std::f64::consts::TAU);
            pair[0] = [x, y, phase, grown * line.elevation].map(|x| x as f32);
            pair[1] = [line.frequency, grown * line.speed, 0.0, 0.0].map(|x| x as f32);
        }
        for heights in edges.heights.chunks(4) {
            let mut quad = [0.0; 4];
            quad[..heights.len()].copy_from_slice(heights);
            quads.push(quad);
        }
        quads
    }
}
