//! The exact passes and buffers that a scene calls for, in bytes, before a device is touched.
//!
//! The solver builds these and nothing more.

mod flip;
mod pbf;

use crate::{
    domain::sph::Calibration,
    gpu::{
        program::{BufferSpec, PassSpec},
        sort,
    },
};

use super::{Method, Scene, effects::EffectPlan};

pub use flip::{FLIP_PARAMS_BYTES, SOLID_GRIDS_BYTES, WINDOW_BYTES, layers, stored_cells};
pub use pbf::{
    LIST_BUDGET, LIST_CAPACITY, PARAMS_BYTES, PHASE_BYTES, SHARED_CONSTANTS, grid_dims, list_name,
};

/// What of the device decides the arrangement, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeviceLimits {
    /// Largest storage binding.
    pub binding: u64,
    /// Largest buffer.
    pub buffer: u64,
    /// What neighbour lists may take in all; 0 goes without them.
    pub list_budget: u64,
}

/// How much there is of everything.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Fluid particles.
    pub particles: usize,
    /// Samples on solids.
    pub boundary_samples: usize,
    /// Nodes of the solids' signed distance along each axis.
    pub solid_grid: [usize; 3],
    /// Nodes of the moving solids' signed distances, all together.
    pub moving_nodes: usize,
    /// Bricks that sparse grids hold; of FLIP alone.
    pub bricks: Capacity,
}

/// How many bricks sparse grids can hold. What is in the frame does not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Capacity {
    /// Slots of bricks with water, slot 0 included.
    pub wet: usize,
    /// Slots in all: those within reach and the coarser levels as well.
    pub slots: usize,
}

impl Capacity {
    /// Enough for `needed`, with a quarter to spare, so that water that spreads does not ask for more
    /// every substep.
    pub fn grown(self, needed: Self) -> Self {
        let grow = |have: usize, need: usize| {
            if need > have { need + need / 4 } else { have }
        };
        Self {
            wet: grow(self.wet, needed.wet),
            slots: grow(self.slots, needed.slots),
        }
    }
}

/// A buffer, and what it is there for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlannedBuffer {
    /// Name and bytes.
    pub spec: BufferSpec,
    /// `pbf`, `flip`, `pressure`, `sort`, `solids`, `lists`, `probes`, `budget`, or an effect's name.
    pub owner: &'static str,
}

/// A pass, and what it is there for.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPass {
    /// Shader and conditions.
    pub spec: PassSpec,
    /// As for buffers.
    pub owner: &'static str,
}

/// Particles that one binding of the neighbour lists covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chunk {
    /// First sorted index; even.
    pub first: usize,
    /// Particles.
    pub count: usize,
}

/// What a scene needs on the device.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What it was made for.
    pub counts: Counts,
    /// Cells along each axis: of edge h with PBF, of edge Δx with FLIP.
    pub grid_dims: [u32; 3],
    /// One where lists fit into a binding or there are none; of PBF alone.
    pub chunks: Vec<Chunk>,
    /// Whether neighbours are listed once a substep; of PBF alone.
    pub has_lists: bool,
    /// Every buffer.
    pub buffers: Vec<PlannedBuffer>,
    /// Every pass.
    pub passes: Vec<PlannedPass>,
}

impl Plan {
    /// Lays out the chosen solver for `scene`, but for FLIP's projection, which `solve::plan` adds.
    pub fn new(scene: &Scene, counts: Counts, limits: DeviceLimits) -> Self {
        let cell = match scene.solver.method {
            Method::Pbf => {
                let pbf = scene.solver.pbf();
                Calibration::new(pbf.particle_spacing, pbf.support_ratio).support_radius
            }
            Method::Flip => scene.solver.flip().cell_size,
        };
        let mut plan = Self {
            counts,
            grid_dims: grid_dims(&scene.domain, cell),
            chunks: Vec::new(),
            has_lists: false,
            buffers: Vec::new(),
            passes: Vec::new(),
        };
        match scene.solver.method {
            Method::Pbf => plan.add_all_of_pbf(scene, limits),
            Method::Flip => plan.add_all_of_flip(scene),
        }
        plan
    }

    /// The same with what another part of a solver needs.
    pub fn with(
        mut self,
        owner: &'static str,
        buffers: Vec<BufferSpec>,
        passes: Vec<PassSpec>,
    ) -> Self {
        self.add_specs(buffers, owner);
        let passes = passes.into_iter();
        self.passes
            .extend(passes.map(|spec| PlannedPass { spec, owner }));
        self
    }

    /// Bytes in all, and those of the neighbour lists.
    pub fn bytes(&self) -> (u64, u64) {
        let sum = |lists_only: bool| {
            self.buffers
                .iter()
                .filter(|buffer| !lists_only || buffer.owner == "lists")
                .map(|buffer| buffer.spec.bytes)
                .sum()
        };
        (sum(false), sum(true))
    }

    fn add_specs(&mut self, specs: Vec<BufferSpec>, owner: &'static str) {
        self.buffers
            .extend(specs.into_iter().map(|spec| PlannedBuffer { spec, owner }));
    }

    fn add_effects(&mut self, effects: Vec<EffectPlan>, condition: impl Fn(&mut PassSpec)) {
        for effect in effects {
            self.add_specs(effect.buffers, effect.name);
            for mut spec in effect.passes {
                condition(&mut spec);
                self.passes.push(PlannedPass {
                    spec,
                    owner: effect.name,
                });
            }
        }
    }

    fn add_buffer(&mut self, name: &str, bytes: u64, owner: &'static str) {
        self.buffers.push(PlannedBuffer {
            spec: sort::storage(name, bytes),
            owner,
        });
    }

    fn add_uniform(&mut self, name: &str, bytes: u64, owner: &'static str) {
        let spec = BufferSpec {
            name: name.to_owned(),
            bytes,
            is_uniform: true,
        };
        self.buffers.push(PlannedBuffer { spec, owner });
    }

    /// Passes of effects, in the order in which they run.
    pub fn effect_passes(&self) -> Vec<&'static str> {
        let of_effect = |pass: &&PlannedPass| {
            !["pbf", "flip", "pressure", "sort", "budget"].contains(&pass.owner)
        };
        self.passes
            .iter()
            .filter(of_effect)
            .map(|pass| pass.spec.name)
            .collect()
    }
}
