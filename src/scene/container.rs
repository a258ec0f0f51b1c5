//! Warnings for meshes that are accepted with defects: open meshes, and water inside of them.

use std::borrow::Cow;

use glam::DVec3;

use super::{PlacedMesh, Scene};
use swell_domain::{bounds::Bounds, bvh::Bvh};

/// Points per axis at which water is looked for in a mesh.
const LOOKS: usize = 8;

impl PlacedMesh {
    fn file_name(&self) -> Cow<'_, str> {
        self.file.file_name().unwrap_or_default().to_string_lossy()
    }

    /// Warning for a mesh that is not watertight, with its holes; `None` for a closed mesh.
    fn warning(&self) -> Option<String> {
        let name = self.file_name();
        (!self.holes.0.is_empty()).then(|| {
            format!(
                "{name} is open and treated as closed: {}; inside is where its winding number is \
                 above one half, about as if a flat cap closed each hole",
                self.holes
            )
        })
    }
}

impl Scene {
    /// Returns the warnings of the scene, one sentence each: defects of its meshes and legal but
    /// suspicious values.
    pub fn warnings(&self) -> Vec<String> {
        let of_water = self.water.meshes.iter().filter_map(|placed| {
            let warning = placed.warning()?;
            Some(format!("{warning}; water fills this container up to there"))
        });
        let moving = self.drawn_movers().map(|solid| &solid.placed);
        let solids = self.solids.iter().chain(moving).filter_map(|placed| {
            let warning = placed.warning()?;
            Some(match self.is_container(placed) {
                true => format!(
                    "{warning}; the scene puts water inside it, and that water is removed: an open \
                     mesh is solid up to a flat cap over each hole; give walls that hold water a \
                     thickness, so that the mesh is closed"
                ),
                false => warning,
            })
        });
        let open = self.source_meshes().filter_map(PlacedMesh::warning);
        let placed = self.water.meshes.iter().chain(&self.solids);
        let moving = self.drawn_movers().map(|solid| &solid.placed);
        let placed = placed.chain(moving).chain(self.source_meshes());
        let faults = placed.flat_map(|placed| {
            let name = placed.file_name();
            (placed.faults.iter()).map(move |fault| format!("{name}: {fault}"))
        });
        of_water
            .chain(solids)
            .chain(open)
            .chain(faults)
            .chain(self.lints())
            .collect()
    }

    /// Whether initial water or the volume of an emitter is inside a mesh.
    fn is_container(&self, placed: &PlacedMesh) -> bool {
        let Some(bounds) = placed.mesh.bounds() else {
            return false;
        };
        let tree = Bvh::new(&placed.mesh);
        let meshes = self.water.meshes.iter().filter_map(|it| it.mesh.bounds());
        let emitters = self.emitters.iter().map(|it| it.shape.bounds());
        let rooms = self
            .start_blocks()
            .into_iter()
            .chain(meshes)
            .chain(emitters);
        let in_both = rooms.map(|room| room.intersection(&bounds));
        let in_both = in_both.filter(|both| both.min.cmplt(both.max).all());
        let particles = self.water.particles.iter().flat_map(|swarm| &swarm.at);
        let mut places = in_both.flat_map(looks).chain(particles.copied());
        places.any(|p| tree.winding_number(p).abs() > 0.5)
    }
}

/// Points evenly spread over a box.
fn looks(room: Bounds) -> impl Iterator<Item = DVec3> {
    (0..LOOKS.pow(3)).map(move |n| {
        let cell = [n % LOOKS, n / LOOKS % LOOKS, n / LOOKS.pow(2)];
        let part = DVec3::from_array(cell.map(|i| (i as f64 + 0.5) / LOOKS as f64));
        room.min + room.size() * part
    })
}
