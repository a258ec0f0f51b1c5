//! Lists of a picture's tiles by content (water or spray, solids only, neither), so that passes run
//! only where they are needed.

use super::{
    buffers::{SOLID_DEPTH, SPRAY, tile_groups, tiles},
    plan::Plan,
    uniform::TileGrid,
};
use swell_gpu::{
    buffer::{Buf, Windows, Workgroups},
    recording::{Bind, Command, Groups},
};

/// Threads of a workgroup of the passes over lists; each workgroup processes one tile.
const WORKGROUP: [u32; 2] = [16, 4];
/// Pixels of a tile of the picture, one per thread.
pub(super) const TILE: [u32; 2] = WORKGROUP;
/// Cells of a tile of the curvature flow, two by two per thread.
pub(super) const FLOW_TILE: [u32; 2] = [2 * WORKGROUP[0], 2 * WORKGROUP[1]];

/// Pass that lists the tiles with spray.
const LIST_SPRAY: &str = "ssfr/list_spray";
/// Pass that lists the tiles with water, and those of the others that have solids.
const LIST_PICTURE: &str = "ssfr/list_picture";
/// Number of lists for a part of the frame: `LISTS` of shared/ssfr_tiles.wgsl.
const LISTS: usize = 3;

/// Lists of tiles, and the workgroup counts of indirect dispatches over them.
pub(super) struct Tiles {
    list: Buf<u32>,
    groups: Buf<Workgroups>,
}

impl Tiles {
    /// Plans the lists of a part of the frame by water, and returns the commands that fill them
    /// from the depths in `source`.
    pub(super) fn of_water(
        plan: &mut Plan,
        name: &str,
        grid: TileGrid,
        source: &Buf<f32>,
    ) -> (Self, Vec<Command>) {
        let source = vec![Bind::whole("source", source)];
        Self::plan(plan, name, grid, ("ssfr/list_tiles", source))
    }

    /// Like [`Self::of_water`], with a separate list for tiles that have solids but no water.
    pub(super) fn of_picture(
        plan: &mut Plan,
        name: &str,
        grid: TileGrid,
        source: &Buf<f32>,
    ) -> (Self, Vec<Command>) {
        plan.define(LIST_PICTURE, "SOLIDS");
        let binds = vec![
            Bind::whole("source", source),
            Bind::whole("solid_depth", &SOLID_DEPTH),
        ];
        Self::plan(plan, name, grid, (LIST_PICTURE, binds))
    }

    /// Plans the lists of a part of the frame by spray, and returns the commands that fill them
    /// from the sums of splats.
    pub(super) fn of_spray(plan: &mut Plan, name: &str, grid: TileGrid) -> (Self, Vec<Command>) {
        plan.define(LIST_SPRAY, "SPRAY");
        let source = vec![Bind::whole("source", &SPRAY)];
        Self::plan(plan, name, grid, (LIST_SPRAY, source))
    }

    fn plan(
        plan: &mut Plan,
        name: &str,
        grid: TileGrid,
        (pass, sources): (&'static str, Vec<Bind>),
    ) -> (Self, Vec<Command>) {
        let count = count(grid.size, grid.tile);
        let made = Self {
            list: tiles(name),
            groups: tile_groups(name),
        };
        plan.buffer(&made.list, LISTS + LISTS * count);
        plan.buffer(&made.groups, LISTS);
        let grids = Windows::named("grid", format!("tile_grid.{name}"));
        plan.windows(&grids, &[grid]);
        let list = [sources, vec![grids.bind(0), made.bind()]].concat();
        let spread = vec![made.bind(), Bind::whole("tile_groups", &made.groups)];
        let commands = vec![
            Command::clear(&made.list),
            Command::with(pass, count, list),
            Command::with("ssfr/spread_tiles", 1, spread),
        ];
        (made, commands)
    }

    /// Binds the lists to a pass.
    pub(super) fn bind(&self) -> Bind {
        Bind::whole("tiles", &self.list)
    }

    /// Workgroups of a pass over the tiles with water or spray.
    pub(super) fn wet(&self) -> Groups {
        Groups::at(&self.groups, 0)
    }

    /// Workgroups of a pass over the other tiles with solids.
    pub(super) fn dry(&self) -> Groups {
        Groups::at(&self.groups, 1)
    }

    /// Workgroups of a pass over the tiles with neither.
    pub(super) fn bare(&self) -> Groups {
        Groups::at(&self.groups, 2)
    }
}

/// Plans a list of all tiles of the flow over `size` cells, as if each had water, and returns the
/// workgroups and the binding of a pass over it.
pub(super) fn every_tile(plan: &mut Plan, name: &str, size: [u32; 2]) -> (Groups, Bind) {
    let [across, down] = counts(size, FLOW_TILE);
    let mut words = vec![across * down, 0, 0];
    words.extend((0..down).flat_map(|y| (0..across).map(move |x| x | y << 16)));
    let list = tiles(name);
    plan.values(&list, &words);
    // One workgroup per tile, requested as columns of threads.
    let columns = u64::from(WORKGROUP[0]) * u64::from(words[0]);
    (Groups::Threads(columns), Bind::whole("tiles", &list))
}

fn counts(size: [u32; 2], tile: [u32; 2]) -> [u32; 2] {
    [0, 1].map(|axis| size[axis].div_ceil(tile[axis]))
}

fn count(size: [u32; 2], tile: [u32; 2]) -> usize {
    counts(size, tile)
        .map(|side| side as usize)
        .iter()
        .product()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

    use super::*;
    use swell_gpu::{reflect::reflect, shader::compose};

    #[test]
    fn a_workgroup_is_what_a_tile_is_for() {
        let passes = [
            ("ssfr/curvature_flow", &[][..]),
            ("ssfr/flow_prolong", &[]),
            ("ssfr/shade", &["LISTED"]),
            ("ssfr/shade_dry", &["LISTED", "DRY"]),
            ("ssfr/shade_bare", &["LISTED", "DRY", "BARE"]),
            ("ssfr/shade_spray", &[]),
        ];
        for (pass, defines) in passes {
            let found = reflect(pass, &compose(pass, defines).unwrap()).unwrap();
            assert_eq!(
                found.workgroup_size,
                [WORKGROUP[0], WORKGROUP[1], 1],
                "{pass}"
            );
        }
    }

    #[test]
    fn every_tile_is_listed_once() {
        let mut plan = Plan::default();
        let (groups, _) = every_tile(&mut plan, "all", [80, 17]);
        assert_eq!(groups, Groups::Threads(16 * 9));
        let words: &[u32] = bytemuck::cast_slice(&plan.contents[0].1);
        let tiles = [0, 1, 2].map(|y| [0, 1, 2].map(|x| x | y << 16));
        assert_eq!(words[..LISTS], [9, 0, 0]);
        assert_eq!(words[LISTS..], *tiles.as_flattened());
    }
}
