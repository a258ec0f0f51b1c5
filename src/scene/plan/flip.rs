//! What FLIP needs on the device.

use crate::{
    domain::bricks::{Brick, CELLS, table_dims},
    gpu::{
        program::{BufferSpec, PassSpec},
        sort,
    },
    scene::{
        Scene,
        flip::{Flip, Surface, Transfer},
    },
};

use super::{Plan, PlannedPass};

/// Size of the `FlipParams` uniform.
pub const FLIP_PARAMS_BYTES: u64 = 160;

/// Stride of a uniform that is bound through windows, the largest offset alignment that WebGPU lets an adapter
/// ask for.
pub const WINDOW_BYTES: u64 = 256;

/// Size of the `SolidGrids` uniform.
pub const SOLID_GRIDS_BYTES: u64 = 400;

/// Faces about a cell that its particles reach, of one component.
const FACES: u64 = 18;

/// Cell centres that they reach.
const CENTERS: u64 = 27;

/// Layers of faces that a velocity is carried outward where particles move by so many cells: √3 times as many
/// along a diagonal, and what trilinear samples at both stages of the midpoint rule add.
pub fn layers(displacement: f64) -> usize {
    (3f64.sqrt() * displacement).ceil() as usize + 3
}

/// Cells stored along each axis: one beyond the domain's own, for its upper faces.
pub fn stored_cells(cells: [u32; 3]) -> [u32; 3] {
    cells.map(|n| n + 1)
}

impl Plan {
    /// Lays out FLIP for `scene`.
    pub(super) fn add_all_of_flip(&mut self, scene: &Scene) {
        let flip = scene.solver.flip();
        self.add_particles(flip);
        self.add_bricks(flip);
        self.add_flip_passes(flip);
        self.add_watch(scene);
        let slots = self.counts.bricks.slots;
        let cells = CELLS as usize * slots;
        self.add_effects(scene.effects.flip_plans(cells), |_| {});
    }

    fn add_particles(&mut self, flip: &Flip) {
        let n = self.counts.particles as u64;
        for name in ["position", "velocity", "sorted_position", "sorted_velocity"] {
            self.add_buffer(name, 16 * n, "flip");
        }
        for name in ["id", "sorted_id"] {
            self.add_buffer(name, 4 * n, "flip");
        }
        let carried = if flip.density_correction { 6 } else { 3 };
        self.add_buffer("carried", 4 * carried * n, "flip");
        if flip.transfer == Transfer::Apic {
            for name in ["affine", "sorted_affine"] {
                self.add_buffer(name, 36 * n, "flip");
            }
        }
        for name in ["cell_of", "slot_in_cell", "placed", "order"] {
            self.add_buffer(name, 4 * n, "sort");
        }
        self.add_uniform("element_count", 16, "sort");
        self.add_buffer("counters", 16, "flip");
    }

    /// Whatever follows the bricks: its size changes while a scene runs.
    fn add_bricks(&mut self, flip: &Flip) {
        let cells = u64::from(CELLS);
        let wet = self.counts.bricks.wet as u64 * cells;
        let all = self.counts.bricks.slots as u64 * cells;
        let table: u64 = table_dims(stored_cells(self.grid_dims))
            .iter()
            .map(|&n| u64::from(n))
            .product();
        self.add_buffer("survey", 16 + 4 * table, "flip");
        self.add_buffer("brick_slot", 4 * table, "flip");
        self.add_buffer(
            "bricks",
            size_of::<Brick>() as u64 * self.counts.bricks.slots as u64,
            "flip",
        );
        self.add_buffer("cell_start", 4 * (wet + 1), "sort");
        self.add_specs(sort::scan_buffers(&sort::CELL_START, wet as usize), "sort");
        self.add_buffer("partial_momentum", 4 * FACES * wet, "flip");
        self.add_buffer("partial_weight", 4 * CENTERS * wet, "flip");
        for name in ["face_velocity", "face_change", "face_open"] {
            self.add_buffer(name, 12 * all, "flip");
        }
        for name in ["face_layer", "cell_kind", "solid_flux", "density"] {
            self.add_buffer(name, 4 * all, "flip");
        }
        if flip.density_correction {
            self.add_buffer("density_excess", 4 * all, "flip");
        }
        if flip.surface == Surface::GhostFluid {
            self.add_buffer("liquid_distance", 4 * all, "flip");
        }
        if self.has_solids() {
            self.add_buffer("open_volume", 4 * all, "solids");
            let nodes = self.counts.solid_grid.iter().product::<usize>() + self.counts.moving_nodes;
            self.add_buffer("solid_distance", 4 * nodes as u64, "solids");
            if self.counts.moving_nodes > 0 {
                self.add_buffer("closed_velocity", 12 * all, "solids");
                self.add_uniform("solid_grids", SOLID_GRIDS_BYTES, "solids");
            } else {
                self.add_uniform("solid_grid", 32, "solids");
            }
        }
        let layers = layers(flip.cfl) as u64;
        self.add_uniform("params", FLIP_PARAMS_BYTES, "flip");
        self.add_uniform("axes", 3 * WINDOW_BYTES, "flip");
        self.add_uniform("layers", layers * WINDOW_BYTES, "flip");
        self.add_buffer("groups", 16 * (2 + layers), "flip");
    }

    /// What budgets take: the passes that look for values that are not finite and, where something moves, for its work.
    fn add_watch(&mut self, scene: &Scene) {
        let mut names = vec!["flip/find_not_finite"];
        if scene.has_movers() {
            let cells = self.counts.bricks.wet as u64 * u64::from(CELLS);
            self.add_buffer("boundary_work", 4 * cells / 64, "budget");
            names.push("flip/boundary_work");
        }
        for name in names {
            let spec = PassSpec {
                name,
                defines: Vec::new(),
                constants: Vec::new(),
            };
            let owner = "budget";
            self.passes.push(PlannedPass { spec, owner });
        }
    }

    /// Arrays of floats in which what is not finite may be hidden from all that follows; of those that the plan has.
    pub fn watched(&self) -> impl Iterator<Item = &BufferSpec> {
        const NAMES: [&str; 13] = [
            "face_open",
            "solid_flux",
            "open_volume",
            "closed_velocity",
            "face_velocity",
            "face_change",
            "density",
            "density_excess",
            "liquid_distance",
            "pressure",
            "face_displacement",
            "carried",
            "affine",
        ];
        let specs = self.buffers.iter().map(|buffer| &buffer.spec);
        specs.filter(|spec| NAMES.contains(&spec.name.as_str()))
    }

    fn has_solids(&self) -> bool {
        self.counts.solid_grid != [0; 3] || self.counts.moving_nodes > 0
    }

    fn add_flip_passes(&mut self, flip: &Flip) {
        let mut defines = Vec::new();
        if self.has_solids() {
            defines.push("SOLIDS");
        }
        if self.counts.moving_nodes > 0 {
            defines.push("MOVING_SOLIDS");
        }
        if flip.transfer == Transfer::Apic {
            defines.push("APIC");
        }
        if flip.surface == Surface::GhostFluid {
            defines.push("GHOST_FLUID");
        }
        if flip.density_correction {
            defines.push("CORRECTION");
        }
        let sort = sort::SCAN_PASSES.into_iter().chain(sort::SORT_PASSES);
        let own = [
            "flip/survey",
            "flip/assign_cells",
            "flip/reorder",
            "flip/cut_cells",
            "flip/spread_faces",
            "flip/gather_faces",
            "flip/spread_centers",
            "flip/gather_centers",
            "flip/find_change",
            "flip/extrapolate",
            "flip/grid_to_particle",
            "flip/advect",
        ];
        let owners = sort.map(|name| (name, "sort"));
        for (name, owner) in owners.chain(own.map(|name| (name, "flip"))) {
            let spec = PassSpec {
                name,
                defines: defines.clone(),
                constants: Vec::new(),
            };
            self.passes.push(PlannedPass { spec, owner });
        }
    }
}
