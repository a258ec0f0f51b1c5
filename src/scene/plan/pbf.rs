//! What PBF needs on the device.

use crate::{
    domain::{bounds::Bounds, pbf::chebyshev_factors},
    gpu::{program::PassSpec, sort},
    scene::{Iteration, Pbf, Scene, Stop},
};

use super::{Chunk, DeviceLimits, Plan, PlannedBuffer, PlannedPass};

/// Constants for every pass that declares them.
pub const SHARED_CONSTANTS: [(&str, f64); 1] = [("LIST_CAPACITY", LIST_CAPACITY as f64)];

/// Neighbours that a list holds; a particle with more is searched for, and the report counts it. At rest
/// h = 2d has 32; in the dam of `tools/bench pbf` no list of 48 overflowed.
pub const LIST_CAPACITY: u32 = 48;

/// Device memory that neighbour lists may take; a larger scene searches the cells in each pass instead.
pub const LIST_BUDGET: u64 = 4 << 30;

/// Particles of a list block: lists are chunked in these.
const LIST_BLOCK: u64 = 128;

/// Cells of edge `support_radius` that cover the domain.
pub fn grid_dims(domain: &Bounds, support_radius: f64) -> [u32; 3] {
    (domain.size() / support_radius)
        .to_array()
        .map(|cells| (cells.ceil() as u32).max(1))
}

impl Plan {
    /// Lays out PBF for `scene`.
    pub(super) fn add_all_of_pbf(&mut self, scene: &Scene, limits: DeviceLimits) {
        self.choose_lists(limits);
        self.add_sort();
        self.add_pbf(scene);
        self.add_solids();
        let conditions = self.conditions();
        self.add_effects(scene.effects.plans(self.counts.particles), |spec| {
            spec.defines.extend_from_slice(&conditions)
        });
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
        spec.defines.extend(self.conditions());
        let owner = match name {
            "pbf/boundary_work" => "budget",
            name if name.starts_with("sort/") => "sort",
            _ => "pbf",
        };
        self.passes.push(PlannedPass { spec, owner });
    }

    /// Conditions that hold for the whole plan; a pass that does not ask ignores them.
    fn conditions(&self) -> Vec<&'static str> {
        let mut conditions = Vec::new();
        if self.counts.boundary_samples > 0 || self.counts.solid_grid != [0; 3] {
            conditions.push("SOLIDS");
        }
        if self.has_lists {
            conditions.push("NEIGHBOR_LIST");
        }
        conditions
    }

    fn cells(&self) -> usize {
        self.grid_dims.iter().map(|&n| n as usize).product()
    }

    fn add_sort(&mut self) {
        let particles = self.counts.particles as u64;
        self.add_buffer("cell_start", 4 * (self.cells() as u64 + 1), "sort");
        self.add_specs(sort::scan_buffers(&sort::CELL_START, self.cells()), "sort");
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
        self.add_uniform("phases", PHASE_BYTES * self.phase_slots(pbf), "pbf");
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
        let mut delta = Vec::new();
        if pbf.artificial_pressure > 0.0 {
            delta.push("ARTIFICIAL_PRESSURE");
        }
        if pbf.iteration == Iteration::Chebyshev {
            delta.push("CHEBYSHEV");
        }
        if !scene.pressure_points().is_empty() {
            self.add_buffer("lambda_sum", 4 * n, "probes");
            delta.push("PRESSURE");
        }
        let mut predict = Vec::new();
        if scene.has_movers() {
            self.add_buffer("wall_work", 8 * n, "budget");
            self.add_buffer("boundary_work", 4 * n.div_ceil(64), "budget");
            self.add_pass("pbf/boundary_work", &[], &[]);
            predict.push("WALL_WORK");
            delta.push("WALL_WORK");
        }
        self.add_pass("pbf/predict", &predict, &[]);
        for name in ["pbf/assign_cells", "pbf/reorder"] {
            self.add_pass(name, &[], &[]);
        }
        if self.has_lists {
            self.add_pass("pbf/build_neighbors", &[], &[]);
        }
        self.add_pass("pbf/compute_lambda", &lambda, &[]);
        self.add_pass("pbf/compute_delta", &delta, &[]);
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

    /// Most phases that an iteration can have: per chunk two halves of (all, red, black) and of every factor of
    /// a semi-iteration, and one that ends it.
    fn phase_slots(&self, pbf: &Pbf) -> u64 {
        let factors = match pbf.iteration {
            Iteration::Jacobi | Iteration::RedBlack => 0,
            Iteration::Chebyshev => {
                let mut factors: Vec<f32> = chebyshev_factors(pbf.spectral_radius)
                    .take(pbf.stop.most_iterations() as usize)
                    .map(|factor| factor as f32)
                    .collect();
                factors.sort_unstable_by(f32::total_cmp);
                factors.dedup();
                factors.len() as u64
            }
        };
        (6 + 2 * factors) * self.chunks.len() as u64 + 1
    }
}

/// Name of a chunk's list buffer.
pub fn list_name(chunk: usize) -> String {
    format!("neighbor_list.{chunk}")
}

/// Size of the `Params` uniform.
pub const PARAMS_BYTES: u64 = 176;

/// Stride of phase slots, the largest uniform offset alignment that WebGPU lets an adapter ask for.
pub const PHASE_BYTES: u64 = 256;
