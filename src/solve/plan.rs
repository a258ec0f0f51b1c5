//! The exact passes and buffers that a scene calls for, in bytes, before a device is touched.
//!
//! Passes are those of the commands that a solver records, in the order in which they first run; each room declares its
//! buffers once, and a test holds those declared against those that the commands bind.

use swell_domain::{places, solver::PassTime};
use swell_gpu::{
    adapter::Context,
    program::{BufferSpec, PassSpec},
    recording::Command,
};
use swell_scene::{Method, Scene};

use super::{effects::Addition, flip, pbf, pbf::buffers::SAMPLE_VELOCITY};

pub use super::pbf::plan::{LIST_BUDGET, LIST_CAPACITY, shared_constants};

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

/// The limits of an open device that a plan depends on.
pub fn device_limits(context: &Context) -> DeviceLimits {
    DeviceLimits {
        binding: context.limits.max_storage_buffer_binding_size,
        buffer: context.limits.max_buffer_size,
        list_budget: LIST_BUDGET,
    }
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
    /// Bricks that sparse grids hold; of FLIP, or of PBF's projection.
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
    /// `pbf`, `flip`, `pressure`, `sort`, `solids`, `lists`, `probes`, `budget`, `emitters`, or an effect's name.
    pub owner: &'static str,
    /// Whether FLIP looks for what is not finite in it at a substep's end, where it may be hidden from all that follows.
    pub is_watched: bool,
}

/// Buffers of a room, each declared once.
#[derive(Clone, Debug, Default)]
pub struct Table {
    rows: Vec<PlannedBuffer>,
}

impl Table {
    /// Declares a buffer.
    pub(super) fn add(&mut self, owner: &'static str, spec: BufferSpec) {
        self.rows.push(PlannedBuffer {
            spec,
            owner,
            is_watched: false,
        });
    }

    /// Declares several.
    pub(super) fn extend(
        &mut self,
        owner: &'static str,
        specs: impl IntoIterator<Item = BufferSpec>,
    ) {
        specs.into_iter().for_each(|spec| self.add(owner, spec));
    }

    /// Declares a buffer of floats that is watched.
    pub(super) fn watch(&mut self, owner: &'static str, spec: BufferSpec) {
        self.rows.push(PlannedBuffer {
            spec,
            owner,
            is_watched: true,
        });
    }

    /// Takes in another room's.
    pub(super) fn append(&mut self, mut other: Self) {
        self.rows.append(&mut other.rows);
    }

    /// Names and bytes.
    pub fn specs(&self) -> Vec<BufferSpec> {
        self.rows.iter().map(|row| row.spec.clone()).collect()
    }
}

/// A pass, and what it is there for.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPass {
    /// Shader and conditions.
    pub spec: PassSpec,
    /// As for buffers.
    pub owner: &'static str,
}

/// What all of a plan takes that is there for one thing.
#[derive(Clone, Debug, PartialEq)]
pub struct Share {
    /// As for buffers and passes.
    pub owner: &'static str,
    /// Passes.
    pub passes: usize,
    /// Of its buffers.
    pub bytes: u64,
    /// That its passes took, where they were timed.
    pub seconds: f64,
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
    /// How many of the places of `predicted` one binding holds, where it does not hold them all; of PBF alone.
    pub page: Option<usize>,
    /// Whether FLIP moves particles; not where PBF takes its velocities alone.
    pub moves: bool,
    /// Of the grid on which PBF's velocities are projected, where they are.
    pub projection: Option<Box<Plan>>,
    /// Every buffer.
    pub buffers: Vec<PlannedBuffer>,
    /// Every pass.
    pub passes: Vec<PlannedPass>,
}

impl Plan {
    /// Lays out the chosen solver for `scene`.
    pub fn new(scene: &Scene, counts: Counts, limits: DeviceLimits) -> Self {
        match scene.solver.method {
            Method::Pbf => pbf::plan::plan(scene, counts, limits),
            Method::Flip => flip::plan::plan(scene, counts, true),
        }
    }

    /// Every command that a solver of this plan for `scene` may run.
    pub fn commands(&self, scene: &Scene) -> Vec<Command> {
        match scene.solver.method {
            Method::Pbf => pbf::plan::commands(self, scene),
            Method::Flip => flip::plan::commands(self, scene),
        }
    }

    /// Whether words tell places (shared/place.wgsl).
    pub fn has_places(&self, scene: &Scene) -> bool {
        let dims = self.grid_dims.iter().map(|&cells| cells as usize);
        places::are_told(dims, scene.is_periodic())
    }

    /// One whose buffers and passes are yet to come.
    pub(super) fn bare(counts: Counts, grid_dims: [u32; 3]) -> Self {
        Self {
            counts,
            grid_dims,
            chunks: Vec::new(),
            has_lists: false,
            page: None,
            moves: true,
            projection: None,
            buffers: Vec::new(),
            passes: Vec::new(),
        }
    }

    /// Bytes in all, and those of the neighbour lists.
    pub fn bytes(&self) -> (u64, u64) {
        let sum = |lists_only: bool| -> u64 {
            self.buffers
                .iter()
                .filter(|buffer| !lists_only || buffer.owner == "lists")
                .map(|buffer| buffer.spec.bytes)
                .sum()
        };
        let of_projection = self.projection.as_ref().map_or(0, |plan| plan.bytes().0);
        (sum(false) + of_projection, sum(true))
    }

    /// What there is for each owner, in the order of its first buffer; `times` of passes are as a solver tells them.
    pub fn shares(&self, times: &[PassTime]) -> Vec<Share> {
        let mut shares: Vec<Share> = Vec::new();
        let mut add = |owner, passes, bytes, seconds| match shares
            .iter_mut()
            .find(|share| share.owner == owner)
        {
            Some(share) => {
                share.passes += passes;
                share.bytes += bytes;
                share.seconds += seconds;
            }
            None => shares.push(Share {
                owner,
                passes,
                bytes,
                seconds,
            }),
        };
        let mut timed: Vec<&str> = Vec::new();
        for part in self.parts() {
            for buffer in &part.buffers {
                add(buffer.owner, 0, buffer.spec.bytes, 0.0);
            }
            for PlannedPass { spec, owner } in &part.passes {
                // A pass of two parts is timed as one.
                let of_pass = times.iter().filter(|time| time.pass == spec.name);
                let seconds = match timed.contains(&spec.name) {
                    true => 0.0,
                    false => of_pass.map(|time| time.seconds).sum(),
                };
                timed.push(spec.name);
                add(owner, 1, 0, seconds);
            }
        }
        shares
    }

    /// Itself, and the plan of its projection.
    pub fn parts(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(self.projection.as_deref())
    }

    /// Whether solids stand in the scene, moving or not.
    pub(super) fn has_solids(&self) -> bool {
        self.counts.boundary_samples > 0
            || self.counts.solid_grid != [0; 3]
            || self.counts.moving_nodes > 0
    }

    /// Whether PBF's samples have velocities: where solids move.
    pub(super) fn has_sample_velocities(&self) -> bool {
        let is_it = |name: &str| name == SAMPLE_VELOCITY.name();
        self.buffers.iter().any(|buffer| is_it(&buffer.spec.name))
    }

    /// Names and bytes of its buffers.
    pub fn buffer_specs(&self) -> Vec<BufferSpec> {
        self.buffers.iter().map(|row| row.spec.clone()).collect()
    }

    /// Its passes as a program compiles them.
    pub fn pass_specs(&self) -> Vec<PassSpec> {
        self.passes.iter().map(|row| row.spec.clone()).collect()
    }

    /// The same with the buffers of `table`.
    pub(super) fn declare(&mut self, table: Table) {
        self.buffers.extend(table.rows);
    }

    /// Plans passes that are not planned yet: `specs` say each one's conditions and constants, beside which an effect has
    /// its own.
    pub(super) fn add_passes(
        &mut self,
        specs: impl IntoIterator<Item = PassSpec>,
        effects: &[(&'static str, Addition)],
    ) {
        for mut spec in specs {
            if self.passes.iter().any(|pass| pass.spec.name == spec.name) {
                continue;
            }
            let mut owner = owner_of(spec.name);
            for (effect, addition) in effects {
                if let Some(own) = addition.all().find(|own| own.name == spec.name) {
                    spec.constants.extend_from_slice(&own.constants);
                    owner = effect;
                }
            }
            self.passes.push(PlannedPass { spec, owner });
        }
    }
}

/// Names of the passes that commands run, each once, in the order in which they first run.
pub(super) fn in_order<'a>(
    commands: impl IntoIterator<Item = &'a Command>,
) -> impl Iterator<Item = &'static str> {
    let mut names: Vec<&'static str> = Vec::new();
    for command in commands {
        names.extend(command.pass().filter(|pass| !names.contains(pass)));
    }
    names.into_iter()
}

/// What a pass is there for: the room that its shader stands in, or the budget.
fn owner_of(pass: &'static str) -> &'static str {
    match pass {
        "pbf/boundary_work" | "flip/boundary_work" | "flip/find_not_finite" => "budget",
        "flip/let_in" => "emitters",
        _ => pass.split('/').next().unwrap_or(pass),
    }
}
