//! Smooths the depth of splats into a surface.

use super::buffers::{DEPTHS, FLOW, FLOW_LEVELS, NARROW_RANGE};
use super::frame::FAR;
use super::plan::Plan;
use super::tiles::{FLOW_TILE, Tiles, every_tile};
use super::uniform::{Flow, FlowLevel, Narrow, TileGrid};
use swell_gpu::{
    buffer::Buf,
    recording::{Bind, Command, Groups},
};

/// Width of the smoothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Width {
    /// Standard deviation in metres, the same at any distance (Bagar 2010).
    World(f64),
    /// Standard deviation in pixels, without that correction: smooths distant waves away. Control
    /// of the test that shows the difference.
    #[cfg_attr(not(test), expect(dead_code, reason = "the control of a test"))]
    Pixels(f64),
}

/// Settings of the curvature flow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FlowSettings {
    pub(super) width: Width,
    /// Fraction of the largest stable step.
    pub(super) fraction: f64,
    /// Depth difference above which neighbours are separated by an edge, metres.
    pub(super) edge: f64,
    /// Largest number of levels of the pyramid; 1 is the plain explicit flow.
    pub(super) levels: u32,
    /// Steps on each level except the coarsest, which makes up to `last_steps`.
    pub(super) steps: u32,
    pub(super) last_steps: u32,
}

impl FlowSettings {
    /// Settings for looks: enough levels to reach a standard deviation of `width` metres at a
    /// distance of four widths.
    pub(super) fn for_width(width: f64, radius: f64, focal_px: f64) -> Self {
        const STEPS: u32 = 6;
        const FRACTION: f64 = 0.95;
        // Variance in pixels² at that distance. Each level adds steps × fraction / 2 × 4^level.
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

/// Commands that smooth the first of [`DEPTHS`].
pub(super) struct Smoothing {
    pub(super) commands: Vec<Command>,
    /// The buffer of [`DEPTHS`] that holds the surface afterwards.
    pub(super) surface: Buf<f32>,
}

/// Number of finest levels on which only tiles with water are processed; each coarser level has a
/// quarter of the cells of the one before.
const LISTED: usize = 2;

/// Depths of a level of the pyramid: the result of restriction and two working buffers, with the
/// tiles over which the flow runs.
struct Level {
    size: [u32; 2],
    original: Buf<f32>,
    work: [Buf<f32>; 2],
    tiles: (Groups, Bind),
}

/// Commands that list the tiles with water of the finer levels: before restriction the fills of all
/// other tiles, to which no step writes, and after it the lists.
#[derive(Default)]
struct Lists {
    before: Vec<Command>,
    after: Vec<Command>,
}

impl Level {
    fn all(plan: &mut Plan, count: u32, size: [u32; 2]) -> (Vec<Self>, Lists) {
        let mut lists = Lists::default();
        let mut levels: Vec<Self> = Vec::new();
        for index in 0..count as usize {
            let size = levels
                .last()
                .map_or(size, |finer| finer.size.map(|side| side.div_ceil(2)));
            let (original, work) = Self::buffers(plan, index, size);
            let tiles = match index < LISTED {
                true => lists.add(plan, index, size, (&original, &work)),
                false => every_tile(plan, &format!("flow.{index}"), size),
            };
            levels.push(Self {
                size,
                original,
                work,
                tiles,
            });
        }
        (levels, lists)
    }

    fn buffers(plan: &mut Plan, index: usize, size: [u32; 2]) -> (Buf<f32>, [Buf<f32>; 2]) {
        let [depth, other] = DEPTHS;
        if index == 0 {
            return (depth.clone(), [other, depth]);
        }
        let buffers =
            ["", ".a", ".b"].map(|part| Buf::named(format!("coarse_depth.{index}{part}")));
        for buffer in &buffers {
            plan.buffer(buffer, size[0] as usize * size[1] as usize);
        }
        let [original, first, second] = buffers;
        (original, [first, second])
    }
}

impl Lists {
    fn add(
        &mut self,
        plan: &mut Plan,
        index: usize,
        size: [u32; 2],
        (original, work): (&Buf<f32>, &[Buf<f32>; 2]),
    ) -> (Groups, Bind) {
        for buffer in work.iter().filter(|work| work.name() != original.name()) {
            let cells = size[0] as usize * size[1] as usize;
            self.before.push(plan.fill(buffer, FAR.to_bits(), cells));
        }
        let grid = TileGrid {
            size,
            tile: FLOW_TILE,
            frame: size,
            ..TileGrid::default()
        };
        let (tiles, commands) = Tiles::of_water(plan, &format!("flow.{index}"), grid, original);
        self.after.extend(commands);
        (tiles.wet(), tiles.bind())
    }
}

/// Plans the curvature flow over a pyramid for a frame of `size` cells.
pub(super) fn curvature_flow(
    plan: &mut Plan,
    settings: &FlowSettings,
    size: [u32; 2],
) -> Smoothing {
    let (width, world) = match settings.width {
        Width::World(metres) => (metres, 1),
        Width::Pixels(pixels) => (pixels, 0),
    };
    let params = Flow {
        width: width as f32,
        world,
        fraction: settings.fraction as f32,
        edge: settings.edge as f32,
        steps: settings.steps,
        levels: settings.levels,
        pad0: 0,
        pad1: 0,
    };
    plan.values(&FLOW, &[params]);
    let (levels, lists) = Level::all(plan, settings.levels, size);
    let mut commands = lists.before;
    let mut windows = Vec::new();
    // Dispatch for step `index` of level `at`.
    let mut command = |pass, groups: Groups, (at, index): (usize, u32), mut binds: Vec<Bind>| {
        binds.push(Bind::whole("params", &FLOW));
        binds.push(FLOW_LEVELS.bind(windows.len()));
        windows.push(FlowLevel {
            size: levels[at].size,
            level: at as u32,
            index,
        });
        Command::in_groups(pass, groups, binds)
    };
    let top = levels.len() - 1;
    for (l, pair) in levels.windows(2).enumerate() {
        let binds = vec![
            Bind::whole("fine", &pair[0].original),
            Bind::whole("coarse", &pair[1].original),
        ];
        let groups = Groups::Pixels(pair[1].size);
        commands.push(command("ssfr/flow_restrict", groups, (l, 0), binds));
    }
    commands.extend(lists.after);
    let mut surface: Option<&Buf<f32>> = None;
    for (l, level) in levels.iter().enumerate().rev() {
        let mut source = &level.original;
        let mut into = level.work.iter().cycle();
        let (groups, tiles) = &level.tiles;
        if let Some(after) = surface {
            let corrected = &level.work[0];
            let binds = vec![
                Bind::whole("coarse_before", &levels[l + 1].original),
                Bind::whole("coarse_after", after),
                Bind::whole("fine", source),
                Bind::whole("corrected", corrected),
                tiles.clone(),
            ];
            commands.push(command("ssfr/flow_prolong", groups.clone(), (l, 0), binds));
            source = corrected;
            into.next();
        }
        let count = match l == top {
            true => settings.last_steps,
            false => settings.steps,
        };
        for (index, into) in (0..count).zip(into) {
            let depths = [Bind::whole("source", source), Bind::whole("smoothed", into)];
            let binds = [&depths[..], std::slice::from_ref(tiles)].concat();
            let step = command("ssfr/curvature_flow", groups.clone(), (l, index), binds);
            commands.push(step);
            source = into;
        }
        surface = Some(source);
    }
    plan.windows(&FLOW_LEVELS, &windows);
    Smoothing {
        surface: surface.unwrap_or(&levels[0].original).clone(),
        commands,
    }
}

/// Plans the narrow-range filter: along x, then along y through the second depth buffer, then over
/// a few pixels around each.
pub(super) fn narrow_range(plan: &mut Plan, width: f64, radius: f64, size: [u32; 2]) -> Smoothing {
    let params = [0, 1].map(|axis| Narrow {
        width: width as f32,
        // Choice of the paper: δ = 10 r, μ = r.
        range: 10.0 * radius as f32,
        offset: radius as f32,
        axis,
    });
    plan.windows(&NARROW_RANGE, &params);
    let along = |axis: usize| {
        let binds = vec![
            NARROW_RANGE.bind(axis),
            Bind::whole("source", &DEPTHS[axis]),
            Bind::whole("smoothed", &DEPTHS[1 - axis]),
        ];
        Command::in_groups("ssfr/narrow_range", Groups::Pixels(size), binds)
    };
    let [depth, other] = &DEPTHS;
    let binds = vec![
        NARROW_RANGE.bind(0),
        Bind::whole("source", depth),
        Bind::whole("smoothed", other),
    ];
    let clean = Command::in_groups("ssfr/narrow_clean", Groups::Pixels(size), binds);
    Smoothing {
        commands: vec![along(0), along(1), clean],
        surface: other.clone(),
    }
}

#[cfg(test)]
#[path = "surface_tests.rs"]
mod tests;
