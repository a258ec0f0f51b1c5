//! Bodies of water that no air touches, as lists of cells.

use super::params::PocketPart;

/// Most cells that one workgroup sums.
const PART: u32 = 4096;

/// Returns the cells of all pockets, pocket by pocket, and the parts of each pocket. A label is the
/// smallest element of its body; 0 if air touches the body or the cell has no row.
pub(super) fn list(labels: &[u32]) -> (Vec<u32>, Vec<PocketPart>) {
    let label = |element: &u32| labels[*element as usize];
    let mut cells: Vec<u32> = (0..labels.len() as u32)
        .filter(|element| label(element) != 0)
        .collect();
    cells.sort_by_key(label);
    let mut parts = Vec::new();
    let mut first = 0;
    for pocket in cells.chunk_by(|a, b| label(a) == label(b)) {
        let end = first + pocket.len() as u32;
        let first_part = parts.len() as u32;
        let end_part = first_part + (end - first).div_ceil(PART);
        parts.extend((first..end).step_by(PART as usize).map(|first| PocketPart {
            first,
            end: end.min(first + PART),
            first_part,
            end_part,
        }));
        first = end;
    }
    (cells, parts)
}

/// Returns the number of pockets.
pub(super) fn count(parts: &[PocketPart]) -> u32 {
    let is_first = |(index, part): &(usize, &PocketPart)| part.first_part as usize == *index;
    parts.iter().enumerate().filter(is_first).count() as u32
}

#[cfg(test)]
mod tests {
    use super::{PART, count, list};

    #[test]
    fn cells_stand_by_pocket_in_parts() {
        let (cells, parts) = list(&[0, 9, 2, 0, 2, 9, 6, 2]);
        assert_eq!(cells, [2, 4, 7, 6, 1, 5]);
        let ranges: Vec<_> = parts.iter().map(|part| [part.first, part.end]).collect();
        assert_eq!(ranges, [[0, 3], [3, 4], [4, 6]]);
        let own: Vec<_> = (parts.iter())
            .map(|part| [part.first_part, part.end_part])
            .collect();
        assert_eq!(own, [[0, 1], [1, 2], [2, 3]]);
        assert_eq!(count(&parts), 3);

        // A pocket of two parts and a cell, between two small ones.
        let most = 2 * PART as usize + 1;
        let labels = [vec![1; 2], vec![3; most], vec![5; 4]].concat();
        let (cells, parts) = list(&labels);
        assert_eq!(cells, (0..labels.len() as u32).collect::<Vec<_>>());
        let ranges: Vec<_> = parts.iter().map(|part| part.end - part.first).collect();
        assert_eq!(ranges, [2, PART, PART, 1, 4]);
        let own: Vec<_> = (parts.iter())
            .map(|part| [part.first_part, part.end_part])
            .collect();
        assert_eq!(own, [[0, 1], [1, 4], [1, 4], [1, 4], [4, 5]]);
        assert_eq!(count(&parts), 3);
    }
}
