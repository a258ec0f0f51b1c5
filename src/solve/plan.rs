//! Plans the passes and buffers (with their sizes in bytes) that a scene needs, before any GPU
//! device is opened.
//!
//! Passes come from the commands that a solver records, in the order of their first run. Each
//! module declares its buffers once; a test compares the declared buffers with those that the
//! commands bind.

use swell_domain::{bricks::CELLS, places, solver::PassTime};
use swell_gpu::{
    adapter::{Context, GpuError},
    bindings::check_bindings,
    buffer::BufferSpec,
    program::{PassSpec, check_sizes},
    recording::Command,
};
use swell_scene::Scene;

use super::effects::Addition;

/// Neighbours that a list of PBF holds. If a particle has more, passes search the cells for it, and
/// the report counts it. At rest, h = 2d gives 32 neighbours; in the dam break of `tools/bench pbf`
/// no list of 48 overflowed.
pub const LIST_CAPACITY: u32 = 48;

/// Device memory that neighbour lists may take, bytes. In a larger scene each pass searches the
/// cells.
pub const LIST_BUDGET: u64 = 4 << 30;

/// Device limits that determine the layout of buffers, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeviceLimits {
    /// Largest storage-buffer binding.
    pub binding: u64,
    /// Largest buffer.
    pub buffer: u64,
    /// Budget for all neighbour lists together; 0 disables neighbour lists.
    pub list_budget: u64,
}

/// Returns the limits of an open device that a plan depends on.
pub fn device_limits(context: &Context) -> DeviceLimits {
    DeviceLimits {
        binding: context.limits.max_storage_buffer_binding_size,
        buffer: context.limits.max_buffer_size,
        list_budget: LIST_BUDGET,
    }
}

/// Sizes that a plan is made for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Fluid particles.
    pub particles: usize,
    /// Boundary samples on the surfaces of solids.
    pub boundary_samples: usize,
    /// Nodes of the static solids' signed-distance grid along each axis.
    pub solid_grid: [usize; 3],
    /// Nodes of the moving solids' signed-distance grids, summed.
    pub moving_nodes: usize,
    /// Those of them in grids of solids whose shape changes.
    pub shape_nodes: usize,
    /// Capacity of the sparse grids, of FLIP or of PBF's projection.
    pub bricks: Capacity,
}

/// Capacity of the sparse grids, in bricks. Results do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Capacity {
    /// Slots for bricks with particles, including the empty slot 0. Without a band these are all
    /// with water.
    pub laden: usize,
    /// Slots for bricks with water, including the empty slot 0.
    pub wet: usize,
    /// Slots in total: also bricks within reach of water, and bricks of the coarser levels.
    pub slots: usize,
}

impl Capacity {
    /// Returns the number of cells in slots for bricks with water, and in all slots.
    pub(super) fn cells(self) -> [usize; 2] {
        [self.wet, self.slots].map(|bricks| CELLS as usize * bricks)
    }

    /// Returns a capacity that holds `needed`. What has to grow gets 25 % headroom, so that
    /// spreading water does not reallocate in every substep.
    pub fn grown(self, needed: Self) -> Self {
        let grow = |have: usize, need: usize| {
            if need > have { need + need / 4 } else { have }
        };
        Self {
            laden: grow(self.laden, needed.laden),
            wet: grow(self.wet, needed.wet),
            slots: grow(self.slots, needed.slots),
        }
    }
}

/// A buffer of the plan, with the component that owns it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlannedBuffer {
    /// Name and size.
    pub spec: BufferSpec,
    /// One of `pbf`, `flip`, `pressure`, `sort`, `solids`, `lists`, `probes`, `budget`, `emitters`,
    /// `forces`, `bodies`, or the name of an effect.
    pub owner: &'static str,
    /// Whether FLIP scans this buffer for non-finite values at the end of a substep. Such values
    /// may not show up in any later result.
    pub is_watched: bool,
}

/// Buffers that a module declares, each once.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct BufferTable {
    rows: Vec<PlannedBuffer>,
}

impl BufferTable {
    pub(super) fn add(&mut self, owner: &'static str, spec: BufferSpec) {
        self.rows.push(PlannedBuffer {
            spec,
            owner,
            is_watched: false,
        });
    }

    pub(super) fn extend(
        &mut self,
        owner: &'static str,
        specs: impl IntoIterator<Item = BufferSpec>,
    ) {
        specs.into_iter().for_each(|spec| self.add(owner, spec));
    }

    /// Declares a float buffer that is scanned for non-finite values.
    pub(super) fn watch(&mut self, owner: &'static str, spec: BufferSpec) {
        self.rows.push(PlannedBuffer {
            spec,
            owner,
            is_watched: true,
        });
    }

    /// Appends the buffers of another module.
    pub(super) fn append(&mut self, mut other: Self) {
        self.rows.append(&mut other.rows);
    }

    /// Returns names and sizes of all buffers.
    pub fn specs(&self) -> Vec<BufferSpec> {
        self.rows.iter().map(|row| row.spec.clone()).collect()
    }
}

/// A pass of the plan, with the component that owns it.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPass {
    /// Shader, conditional defines and constants.
    pub spec: PassSpec,
    /// Owner, as in [`PlannedBuffer::owner`].
    pub owner: &'static str,
}

/// Resources of one owner, summed over a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Share {
    /// Owner, as in [`PlannedBuffer::owner`].
    pub owner: &'static str,
    /// Number of passes.
    pub passes: usize,
    /// Total size of its buffers.
    pub bytes: u64,
    /// Time spent in its passes, seconds; 0 where they were not timed.
    pub seconds: f64,
}

/// Range of particles whose neighbour lists share one binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chunk {
    /// First sorted index; always even.
    pub first: usize,
    /// Number of particles.
    pub count: usize,
}

/// Passes and buffers that a scene needs on the device.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Sizes that the plan was made for.
    pub counts: Counts,
    /// Cells along each axis: of edge h for PBF, of edge Δx for FLIP.
    pub grid_dims: [u32; 3],
    /// Ranges of the neighbour lists; a single one if the lists fit into one binding or there are
    /// none. PBF only.
    pub chunks: Vec<Chunk>,
    /// Whether neighbours are listed once per substep. PBF only.
    pub has_lists: bool,
    /// Number of entries of `predicted` that one binding holds, if one binding cannot hold them
    /// all. PBF only.
    pub page: Option<usize>,
    /// Whether FLIP moves particles; `false` for PBF's projection, which only corrects velocities.
    pub moves: bool,
    /// Plan of the grid on which PBF's velocities are projected, if they are.
    pub projection: Option<Box<Plan>>,
    /// All buffers, without those of `projection`.
    pub buffers: Vec<PlannedBuffer>,
    /// All passes, without those of `projection`.
    pub passes: Vec<PlannedPass>,
}

impl Plan {
    /// Returns whether quantized position words are in use (shared/place.wgsl).
    pub fn has_places(&self, scene: &Scene) -> bool {
        let dims = self.grid_dims.iter().map(|&cells| cells as usize);
        places::can_pack(dims, scene.is_periodic())
    }

    /// Returns a plan without buffers and passes.
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

    /// Returns the total size of all buffers, and the size of the neighbour lists, bytes.
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

    /// Sums up resources by owner, in the order of each owner's first buffer. `times` are pass
    /// times as a solver reports them.
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
                // A pass that appears in both parts is timed under one name: count its time once.
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

    /// Iterates over this plan and the plan of its projection.
    pub fn parts(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(self.projection.as_deref())
    }

    /// Returns whether the scene has solids, static or moving.
    pub(super) fn has_solids(&self) -> bool {
        self.counts.boundary_samples > 0
            || self.counts.solid_grid != [0; 3]
            || self.counts.moving_nodes > 0
    }

    /// Returns whether boundary samples have velocities: in PBF's plan if solids move.
    pub(super) fn has_sample_velocities(&self) -> bool {
        let reads_them = |name: &str| name == "pbf/compute_delta";
        self.counts.moving_nodes > 0 && self.passes.iter().any(|pass| reads_them(pass.spec.name))
    }

    /// Returns names and sizes of the buffers, without those of the projection.
    pub fn buffer_specs(&self) -> Vec<BufferSpec> {
        self.buffers.iter().map(|row| row.spec.clone()).collect()
    }

    /// Returns the passes in the form that a program compiles, without those of the projection.
    pub fn pass_specs(&self) -> Vec<PassSpec> {
        self.passes.iter().map(|row| row.spec.clone()).collect()
    }

    /// Checks that an adapter can allocate the buffers, and that it can bind as many as each pass
    /// needs, of the projection as well.
    ///
    /// # Errors
    /// That of a solver built with this plan: [`GpuError::TooLarge`],
    /// [`GpuError::TooManyBuffers`].
    pub fn check(&self, context: &Context) -> Result<(), GpuError> {
        self.parts().try_for_each(|part| {
            check_sizes(context, &part.buffer_specs())?;
            let passes = part.passes.iter().map(|pass| &pass.spec);
            check_bindings(context, passes.map(|spec| (spec.name, &spec.defines[..])))
        })
    }

    pub(super) fn declare(&mut self, table: BufferTable) {
        self.buffers.extend(table.rows);
    }

    /// Adds the passes of `specs` that the plan does not have yet. A pass of an effect also gets
    /// the effect's own constants.
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

/// Returns the names of the passes that commands run, without repetition, in the order of their
/// first run.
pub(super) fn in_order<'a>(
    commands: impl IntoIterator<Item = &'a Command>,
) -> impl Iterator<Item = &'static str> {
    let mut names: Vec<&'static str> = Vec::new();
    for command in commands {
        names.extend(command.pass().filter(|pass| !names.contains(pass)));
    }
    names.into_iter()
}

/// Returns the owner of a pass: the shader's folder, or `budget` or `emitters`.
fn owner_of(pass: &'static str) -> &'static str {
    match pass {
        "pbf/boundary_work" | "flip/boundary_work" | "flip/find_not_finite" => "budget",
        "flip/let_in" => "emitters",
        "flip/couple_bodies"
        | "flip/carry_bodies"
        | "pressure/push_bodies"
        | "pressure/move_bodies"
        | "pressure/couple"
        | "pressure/carry_flux" => "bodies",
        _ => pass.split('/').next().unwrap_or(pass),
    }
}
