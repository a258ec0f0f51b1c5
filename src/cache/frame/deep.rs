//! Deep cells of a frame: a second element of its PLY file, after the particles.

use glam::DVec3;
use ply_rs_bw::ply::{Addable, ElementDef, Header, PropertyDef, PropertyType, ScalarType};

use swell_domain::deep::{Deep, DeepGrid, FILLED};

/// Name of the element.
const ELEMENT: &str = "deep";

/// Columns of every row, in this order.
const COLUMNS: [(&str, ScalarType); 7] = [
    ("i", ScalarType::UInt),
    ("j", ScalarType::UInt),
    ("k", ScalarType::UInt),
    ("depth", ScalarType::Float),
    ("u", ScalarType::Float),
    ("v", ScalarType::Float),
    ("w", ScalarType::Float),
];

/// Bytes of a row.
pub(super) const ROW: usize = 4 * COLUMNS.len();

/// Prefix of the comment that records the grid.
const GRID: &str = "deep_grid ";

/// What a header says of the deep cells.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Promised {
    /// Number of cells.
    pub(super) count: usize,
    grid: DeepGrid,
}

/// Adds the deep cells, if there are any, to the header of a frame.
pub(super) fn add(header: &mut Header, deep: &Deep) {
    if deep.is_empty() {
        return;
    }
    let mut element = ElementDef::new(ELEMENT.to_owned());
    element.count = deep.cell.len();
    for (name, scalar) in COLUMNS {
        let kind = PropertyType::Scalar(scalar);
        element
            .properties
            .add(PropertyDef::new(name.to_owned(), kind));
    }
    header.comments.push(comment(&deep.grid));
    header.elements.add(element);
}

fn comment(grid: &DeepGrid) -> String {
    let (DVec3 { x, y, z }, [i, j, k]) = (grid.origin, grid.cells);
    format!(
        "{GRID}{:?} {x:?} {y:?} {z:?} {i} {j} {k} {} {}",
        grid.cell_size, grid.per_edge, grid.band
    )
}

/// Reads the header's second element, if it has one.
///
/// # Errors
/// A message if it is not what [`add`] writes.
pub(super) fn promised(header: &Header, element: &ElementDef) -> Result<Promised, String> {
    let wrong = || "its second element is not one that swell writes".to_owned();
    let columns = element
        .properties
        .values()
        .map(|it| (&*it.name, &it.data_type));
    let kinds = COLUMNS.map(|(name, scalar)| (name, PropertyType::Scalar(scalar)));
    let is_same = columns.eq(kinds.iter().map(|(name, kind)| (*name, kind)));
    let comment_of = |it: &&String| it.starts_with(GRID);
    let Some(found) = header.comments.iter().find(comment_of) else {
        return Err(wrong());
    };
    let words: Vec<&str> = found[GRID.len()..].split(' ').collect();
    let number = |k: usize| words.get(k)?.parse::<f64>().ok();
    let whole = |k: usize| words.get(k)?.parse::<u32>().ok();
    let grid = || {
        Some(DeepGrid {
            cell_size: number(0)?,
            origin: DVec3::new(number(1)?, number(2)?, number(3)?),
            cells: [whole(4)?, whole(5)?, whole(6)?],
            per_edge: whole(7)?,
            band: whole(8)?,
        })
    };
    let grid = grid().ok_or_else(wrong)?;
    let is_sound = grid.cell_size > 0.0
        && grid.cell_size.is_finite()
        && grid.origin.is_finite()
        && (1..=8).contains(&grid.per_edge)
        && (1..=8).contains(&grid.band)
        && grid.ids() <= u64::from(FILLED);
    if element.name != ELEMENT || !is_same || !is_sound || comment(&grid) != *found {
        return Err(wrong());
    }
    Ok(Promised {
        count: element.count,
        grid,
    })
}

/// Packs the cells as little-endian rows.
pub(super) fn pack(deep: &Deep) -> Vec<u8> {
    let mut rows = Vec::with_capacity(deep.cell.len() * ROW);
    for ((cell, depth), velocity) in deep.cell.iter().zip(&deep.depth).zip(&deep.velocity) {
        rows.extend_from_slice(cell.map(u32::to_le_bytes).as_flattened());
        rows.extend_from_slice(&depth.to_le_bytes());
        rows.extend_from_slice(velocity.map(f32::to_le_bytes).as_flattened());
    }
    rows
}

/// Reads what [`pack`] wrote.
///
/// # Errors
/// A message if the cells are not in order, or not finite.
pub(super) fn unpack(promised: Promised, rows: &[u8]) -> Result<Deep, String> {
    let mut deep = Deep::default();
    if promised.count > 0 {
        deep.grid = promised.grid;
    }
    for row in rows.chunks_exact(ROW) {
        let word = |k: usize| <[u8; 4]>::try_from(&row[4 * k..4 * k + 4]).unwrap_or_default();
        deep.cell
            .push([0, 1, 2].map(|k| u32::from_le_bytes(word(k))));
        deep.depth.push(f32::from_le_bytes(word(3)));
        deep.velocity
            .push([4, 5, 6].map(|k| f32::from_le_bytes(word(k))));
    }
    let beyond = |cell: &&[u32; 3]| (0..3).any(|axis| cell[axis] >= promised.grid.cells[axis]);
    if let Some(cell) = deep.cell.iter().find(beyond) {
        return Err(format!("deep cell {cell:?} is outside of its grid"));
    }
    match deep.fault() {
        None => Ok(deep),
        Some(fault) => Err(fault),
    }
}
