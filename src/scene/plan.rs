//! The exact passes and buffers that a scene calls for, in bytes, before a device is touched.
//!
//! The solver builds these and nothing more.

use crate::{
    domain::{bounds::Bounds, sph::Calibration},
    gpu::{
        program::{BufferSpec, PassSpec},
        sort,
    },
};

use super::{Scene, Stop};

/// Constants for every pass that declares them.
pub const SHARED_CONSTANTS: [(&str, f64); 1] = [("LIST_CAPACITY", LIST_CAPACITY as f64)];

/// Neighbours that a list holds; a particle with more is searched for, and the report counts it. At rest
/// h = 2d has 32; in the dam of `tools/bench` no list of 48 overflowed.
pub const LIST_CAPACITY: u32 = 48;

/// Device memory that neighbour lists may take; a larger scene searches the cells in each pass instead.
pub const LIST_BUDGET: u64 = 4 << 30;

/// Particles of a list block: lists are chunked in these.
const LIST_BLOCK: u64 = 128;

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
}

/// A buffer, and what it is there for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlannedBuffer {
    /// Name and bytes.
    pub spec: BufferSpec,
    /// `pbf`, `sort`, `solids`, `lists`, or an effect's name.
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
    /// Cells of edge h along each axis.
    pub grid_dims: [u32; 3],
    /// One where lists fit into a binding or there are none.
    pub chunks: Vec<Chunk>,
    /// Whether neighbours are listed once a substep.
    pub has_lists: bool,
    /// Every buffer.
    pub buffers: Vec<PlannedBuffer>,
    /// Every pass.
    pub passes: Vec<PlannedPass>,
}

/// Cells of edge `support_radius` that cover the domain.
pub fn grid_dims(domain: &Bounds, support_radius: f64) -> [u32; 3] {
    (domain.size() / support_radius)
        .to_array()
        .map(|cells| (cells.ceil() as u32).max(1))
}

impl Plan {
    /// Lays out PBF for `scene`.
    pub fn new(scene: &Scene, counts: Counts, limits: DeviceLimits) -> Self {
        let pbf = scene.solver.pbf();
        let h = Calibration::new(pbf.particle_spacing, pbf.support_ratio).support_radius;
        let mut plan = Self {
            counts,
            grid_dims: grid_dims(&scene.domain, h),
            chunks: Vec::new(),
            has_lists: false,
            buffers: Vec::new(),
            passes: Vec::new(),
        };
        plan.choose_lists(limits);
        plan.add_sort();
        plan.add_pbf(scene);
        plan.add_solids();
        for effect in scene.effects.plans(counts.particles) {
            plan.buffers
                .extend(effect.buffers.into_iter().map(|spec| PlannedBuffer {
                    spec,
                    owner: effect.name,
                }));
            for mut spec in effect.passes {
                plan.condition(&mut spec);
                plan.passes.push(PlannedPass {
                    spec,
                    owner: effect.name,
                });
            }
        }
        plan
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

    fn choose_lists(&mut self, limits: DeviceLimits) {
        let particles = self.counts.particles;
        let bytes_each = 4 * u64::from(LIST_CAPACITY);
        let total = (particles as u64).next_multiple_of(LIST_BLOCK) * bytes_each;
        let window = limits.binding.min(limits.buffer) / (bytes_each * LIST_BLOCK) * LIST_BLOCK;
        self.has_lists = total <= limits.list_budget && window > 0;
        let step = if self.has_lists {
            window as usize
        } else {
            particles.max(1)
        };
        self.chunks = (0..particles)
            .step_by(step)
            .map(|first| Chunk {
                first,
                count: step.min(particles - first),
            })
            .collect();
        if self.has_lists {
            for (index, chunk) in self.chunks.iter().enumerate() {
                let bytes = (chunk.count as u64).next_multiple_of(LIST_BLOCK) * bytes_each;
                self.buffers.push(PlannedBuffer {
                    spec: sort::storage(&list_name(index), bytes),
                    owner: "lists",
                });
            }
            self.add_buffer("neighbor_count", 4 * particles as u64, "lists");
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

    fn add_pass(
        &mut self,
        name: &'static str,
        defines: &[&'static str],
        constants: &[(&'static str, f64)],
    ) {
        let mut spec = PassSpec {
            name,
            defines: defines.to_vec(),
            constants: constants.to_vec(),
        };
        self.condition(&mut spec);
        let owner = if name.starts_with("sort/") {
            "sort"
        } else {
            "pbf"
        };
        self.passes.push(PlannedPass { spec, owner });
    }

    /// Conditions that hold for the whole plan; a pass that does not ask ignores them.
    fn condition(&self, spec: &mut PassSpec) {
        if self.counts.boundary_samples > 0 || self.counts.solid_grid != [0; 3] {
            spec.defines.push("SOLIDS");
        }
        if self.has_lists {
            spec.defines.push("NEIGHBOR_LIST");
        }
    }

    fn cells(&self) -> usize {
        self.grid_dims.iter().map(|&n| n as usize).product()
    }

    fn add_sort(&mut self) {
        let particles = self.counts.particles as u64;
        self.add_buffer("cell_start", 4 * (self.cells() as u64 + 1), "sort");
        for spec in sort::scan_buffers("cell_start", self.cells()) {
            self.buffers.push(PlannedBuffer {
                spec,
                owner: "sort",
            });
        }
        for name in ["cell_of", "slot_in_cell", "placed", "order"] {
            self.add_buffer(name, 4 * particles, "sort");
        }
        self.add_uniform("element_count", 16, "sort");
        for name in sort::SCAN_PASSES.into_iter().chain(sort::SORT_PASSES) {
            self.add_pass(name, &[], &[]);
        }
    }

    fn add_pbf(&mut self, scene: &Scene) {
        let n = self.counts.particles as u64;
        let pbf = scene.solver.pbf();
        self.add_uniform("params", PARAMS_BYTES, "pbf");
        self.add_uniform("phases", PHASE_BYTES * self.phase_slots(), "pbf");
        self.add_buffer(
            "predicted",
            16 * (2 * n + self.counts.boundary_samples as u64 + 1),
            "pbf",
        );
        for name in ["position", "velocity", "start_position", "sorted_velocity"] {
            self.add_buffer(name, 16 * n, "pbf");
        }
        for name in ["id", "sorted_id", "density"] {
            self.add_buffer(name, 4 * n, "pbf");
        }
        self.add_buffer("counters", 16, "pbf");
        let mut lambda = Vec::new();
        let mut update = Vec::new();
        if let Stop::DensityError { density_error, .. } = pbf.stop {
            self.add_buffer("control", 48, "pbf");
            self.add_buffer("error_sums", 4 * n.div_ceil(256), "pbf");
            self.add_pass("pbf/sum_error", &[], &[]);
            self.add_pass("pbf/decide", &[], &[("DENSITY_ERROR", density_error)]);
            lambda.push("DENSITY");
            update.push("ADAPTIVE");
        }
        let delta: &[&str] = if pbf.artificial_pressure > 0.0 {
            &["ARTIFICIAL_PRESSURE"]
        } else {
            &[]
        };
        for name in ["pbf/predict", "pbf/assign_cells", "pbf/reorder"] {
            self.add_pass(name, &[], &[]);
        }
        if self.has_lists {
            self.add_pass("pbf/build_neighbors", &[], &[]);
        }
        self.add_pass("pbf/compute_lambda", &lambda, &[]);
        self.add_pass("pbf/compute_delta", delta, &[]);
        self.add_pass("pbf/update_velocity", &update, &[]);
        self.add_pass("pbf/measure_density", &[], &[]);
    }

    fn add_solids(&mut self) {
        if self.counts.boundary_samples == 0 && self.counts.solid_grid == [0; 3] {
            return;
        }
        let nodes: usize = self.counts.solid_grid.iter().product();
        self.add_uniform("solid_grid", 32, "solids");
        self.add_buffer("solid_distance", 4 * nodes as u64, "solids");
        self.add_buffer(
            "boundary_cell_start",
            4 * (self.cells() as u64 + 1),
            "solids",
        );
    }

    /// Passes of effects, in the order in which they run.
    pub fn effect_passes(&self) -> Vec<&'static str> {
        let of_effect = |pass: &&PlannedPass| pass.owner != "pbf" && pass.owner != "sort";
        self.passes
            .iter()
            .filter(of_effect)
            .map(|pass| pass.spec.name)
            .collect()
    }

    /// Most phases that an iteration can have: per chunk two halves of (all, red, black), and one that ends it.
    pub fn phase_slots(&self) -> u64 {
        6 * self.chunks.len() as u64 + 1
    }
}

/// Name of a chunk's list buffer.
pub fn list_name(chunk: usize) -> String {
    format!("neighbor_list.{chunk}")
}

/// Size of the `Params` uniform.
pub const PARAMS_BYTES: u64 = 144;

/// Stride of phase slots, the largest uniform offset alignment that WebGPU lets an adapter ask for.
pub const PHASE_BYTES: u64 = 256;
