//! Bodies of water that no air touches, as lists of cells.

/// Returns the cells of all pockets, pocket by pocket, and the half-open range of each pocket. A
/// label is the smallest element of its body; 0 if air touches the body or the cell has no row.
pub(super) fn list(labels: &[u32]) -> (Vec<u32>, Vec<[u32; 2]>) {
    let mut cells: Vec<u32> = (0..labels.len() as u32)
        .filter(|&element| labels[element as usize] != 0)
        .collect();
    cells.sort_by_key(|&element| labels[element as usize]);
    let mut ranges: Vec<[u32; 2]> = Vec::new();
    let mut last = 0;
    for (place, &element) in cells.iter().enumerate() {
        let label = labels[element as usize];
        match ranges.last_mut() {
            Some(range) if label == last => range[1] += 1,
            _ => ranges.push([place as u32, place as u32 + 1]),
        }
        last = label;
    }
    (cells, ranges)
}

#[cfg(test)]
mod tests {
    #[test]
    fn cells_stand_by_pocket() {
        let (cells, ranges) = super::list(&[0, 9, 2, 0, 2, 9, 6, 2]);
        assert_eq!(cells, [2, 4, 7, 6, 1, 5]);
        assert_eq!(ranges, [[0, 3], [3, 4], [4, 6]]);
    }
}
