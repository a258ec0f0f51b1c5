//! From splat depth to a smooth surface.

use wgpu::{BindGroup, Buffer, CommandEncoder};

use super::RenderError;
use super::pass::{ComputePass, Slot, Timer, storage, tiles, uniform};
use super::uniform::{Flow, FlowLevel, Narrow};
use crate::gpu::adapter::Context;

/// How wide a surface is smoothed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Width {
    /// Standard deviation in metres, the same at any distance (Bagar 2010).
    World(f64),
    /// In pixels: the flow without that correction, which smooths distant waves away. Kept as the control of
    /// the test that shows the difference.
    #[cfg_attr(not(test), expect(dead_code, reason = "the control of a test"))]
    Pixels(f64),
}

/// Settings of the curvature flow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FlowSettings {
    pub(super) width: Width,
    /// Of the largest stable step.
    pub(super) fraction: f64,
    /// Depth steps beyond this are edges, metres.
    pub(super) edge: f64,
    /// Most levels of the pyramid; 1 is the plain explicit flow.
    pub(super) levels: u32,
    /// Steps on each level but the last, which makes as many as are left, up to `last_steps`.
    pub(super) steps: u32,
    pub(super) last_steps: u32,
}

impl FlowSettings {
    /// As looks use it: at most `steps` steps a level, and as many levels as reach a standard deviation of
    /// `width` metres at a distance of four widths.
    pub(super) fn for_width(width: f64, radius: f64, focal_px: f64) -> Self {
        const STEPS: u32 = 6;
        const FRACTION: f64 = 0.95;
        // σ in pixels at that distance; each level adds steps × fraction / 2 × 4^level to the variance.
        let wanted = (focal_px / 4.0).powi(2);
        let mut levels = 1;
        let mut reached = f64::from(STEPS) * FRACTION / 2.0;
        let mut cell = 4.0;
        while reached < wanted && levels < 9 {
            reached += f64::from(STEPS) * FRACTION / 2.0 * cell;
            cell *= 4.0;
            levels += 1;
        }
        Self {
            width: Width::World(width),
            fraction: FRACTION,
            edge: 3.0 * radius,
            levels,
            steps: STEPS,
            last_steps: STEPS,
        }
    }
}

struct Step {
    group: BindGroup,
    groups: [u32; 2],
}

/// The curvature flow over a pyramid, recorded once.
pub(super) struct CurvatureFlow {
    restrict: ComputePass,
    flow: ComputePass,
    prolong: ComputePass,
    down: Vec<Step>,
    /// From the coarsest level to the finest: the correction from the level below, then the steps.
    up: Vec<(Option<Step>, Vec<Step>)>,
    _buffers: Vec<Buffer>,
    in_second: bool,
}

impl CurvatureFlow {
    /// Smooths `depth`, which has `size` cells; `other` is as large, and which of the two holds the result
    /// [`Self::result_is_in_other`] tells.
    pub(super) fn new(
        context: &Context,
        settings: &FlowSettings,
        camera: &Buffer,
        [depth, other]: [&Buffer; 2],
        size: [u32; 2],
    ) -> Result<Self, RenderError> {
        use Slot::{Read, Uniform, Write};
        let pass = |name, slots: &[Slot]| ComputePass::new(context, name, name, &[], slots);
        let restrict = pass(
            "ssfr/flow_restrict",
            &[Uniform, Uniform, Uniform, Read, Write],
        )?;
        let flow = pass(
            "ssfr/curvature_flow",
            &[Uniform, Uniform, Uniform, Read, Write],
        )?;
        let prolong = pass(
            "ssfr/flow_prolong",
            &[Uniform, Uniform, Uniform, Read, Read, Read, Write],
        )?;
        let (width, world) = match settings.width {
            Width::World(metres) => (metres, 1),
            Width::Pixels(pixels) => (pixels, 0),
        };
        let params = uniform(
            context,
            "flow",
            &Flow {
                width: width as f32,
                world,
                fraction: settings.fraction as f32,
                edge: settings.edge as f32,
                steps: settings.steps,
                levels: settings.levels,
                pad: [0; 2],
            },
        );
        let mut sizes = vec![size];
        for _ in 1..settings.levels {
            let [w, h] = sizes[sizes.len() - 1];
            sizes.push([w.div_ceil(2), h.div_ceil(2)]);
        }
        // Per level: what restriction left, and two to work in.
        let mut originals = vec![depth.clone()];
        let mut work: Vec<[Buffer; 2]> = vec![[other.clone(), depth.clone()]];
        for [w, h] in &sizes[1..] {
            let bytes = 4 * u64::from(*w) * u64::from(*h);
            originals.push(storage(context, "coarse depth", bytes)?);
            work.push([
                storage(context, "coarse depth", bytes)?,
                storage(context, "coarse depth", bytes)?,
            ]);
        }
        let level = |level: usize, index: u32| {
            uniform(
                context,
                "flow level",
                &FlowLevel {
                    size: sizes[level],
                    level: level as u32,
                    index,
                },
            )
        };
        let step = |pass: &ComputePass, at: usize, index: u32, buffers: &[&Buffer]| {
            let level = level(at, index);
            let mut all = vec![camera, &params, &level];
            all.extend(buffers);
            let resources = all
                .iter()
                .map(|buffer| buffer.as_entire_binding())
                .collect();
            pass.bind(context, resources)
        };
        let top = settings.levels as usize - 1;
        let down = (0..top)
            .map(|l| Step {
                group: step(&restrict, l, 0, &[&originals[l], &originals[l + 1]]),
                groups: tiles(sizes[l + 1]),
            })
            .collect();
        let mut up = Vec::new();
        let mut after: Option<Buffer> = None;
        for l in (0..=top).rev() {
            let groups = tiles(sizes[l]);
            let mut source = originals[l].clone();
            let mut next = 0;
            let correction = after.take().map(|after| {
                let buffers = [&originals[l + 1], &after, &originals[l], &work[l][0]];
                let group = step(&prolong, l, 0, &buffers);
                source = work[l][0].clone();
                next = 1;
                Step { group, groups }
            });
            let count = if l == top {
                settings.last_steps
            } else {
                settings.steps
            };
            let steps = (0..count)
                .map(|index| {
                    let into = work[l][next].clone();
                    next = 1 - next;
                    let group = step(&flow, l, index, &[&source, &into]);
                    source = into;
                    Step { group, groups }
                })
                .collect();
            up.push((correction, steps));
            after = Some(source);
        }
        let in_second = after.as_ref() == Some(other);
        Ok(Self {
            restrict,
            flow,
            prolong,
            down,
            up,
            _buffers: originals,
            in_second,
        })
    }

    pub(super) fn result_is_in_other(&self) -> bool {
        self.in_second
    }

    pub(super) fn run(&self, encoder: &mut CommandEncoder, timer: &mut Timer) {
        for step in &self.down {
            self.restrict.run(encoder, timer, &step.group, step.groups);
        }
        for (correction, steps) in &self.up {
            if let Some(step) = correction {
                self.prolong.run(encoder, timer, &step.group, step.groups);
            }
            for step in steps {
                self.flow.run(encoder, timer, &step.group, step.groups);
            }
        }
    }
}

/// The narrow-range filter: along x, then along y.
pub(super) struct NarrowRange {
    pass: ComputePass,
    groups: [BindGroup; 2],
    tiles: [u32; 2],
}

impl NarrowRange {
    /// Smooths `depth` by way of `other`; the result is in `depth`.
    pub(super) fn new(
        context: &Context,
        width: f64,
        radius: f64,
        camera: &Buffer,
        [depth, other]: [&Buffer; 2],
        size: [u32; 2],
    ) -> Result<Self, RenderError> {
        let slots = [Slot::Uniform, Slot::Uniform, Slot::Read, Slot::Write];
        let name = "ssfr/narrow_range";
        let pass = ComputePass::new(context, name, name, &[], &slots)?;
        let groups = [0u32, 1].map(|axis| {
            let params = Narrow {
                width: width as f32,
                // The paper's choice: δ = 10 r, μ = r.
                range: 10.0 * radius as f32,
                offset: radius as f32,
                axis,
            };
            let params = uniform(context, name, &params);
            let (from, to) = if axis == 0 {
                (depth, other)
            } else {
                (other, depth)
            };
            let buffers = [camera, &params, from, to];
            pass.bind(context, buffers.map(Buffer::as_entire_binding).to_vec())
        });
        Ok(Self {
            pass,
            groups,
            tiles: tiles(size),
        })
    }

    pub(super) fn run(&self, encoder: &mut CommandEncoder, timer: &mut Timer) {
        for group in &self.groups {
            self.pass.run(encoder, timer, group, self.tiles);
        }
    }
}

/// The look's filter.
pub(super) enum Filter {
    Flow(Box<CurvatureFlow>),
    Narrow(NarrowRange),
}

impl Filter {
    pub(super) fn run(&self, encoder: &mut CommandEncoder, timer: &mut Timer) {
        match self {
            Self::Flow(flow) => flow.run(encoder, timer),
            Self::Narrow(narrow) => narrow.run(encoder, timer),
        }
    }

    /// Which of the two depth buffers holds the surface.
    pub(super) fn result_is_in_other(&self) -> bool {
        match self {
            Self::Flow(flow) => flow.result_is_in_other(),
            Self::Narrow(_) => false,
        }
    }
}

#[cfg(test)]
#[path = "surface_tests.rs"]
mod tests;
