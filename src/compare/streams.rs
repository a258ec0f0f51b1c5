//! Comparison of what caches hold beside a frame's particles: grids, rows of probes, lines of
//! the ledger.

use std::cmp::Ordering;

use serde::Serialize;
use serde_json::Value as Json;

use super::ComparedValue;
use swell_domain::sparse_grid::{Leaf, SparseGrid, VOXELS};

/// Differences in one stream of one frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StreamDiff {
    /// Output frame number.
    pub frame: u32,
    /// `grids`, `probe NAME` or `ledger`.
    pub stream: String,
    /// Paths of a's and of b's file, relative to the caches' folders.
    pub files: [String; 2],
    /// The differences; never empty.
    pub differences: Vec<Difference>,
}

/// One difference in a stream.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Difference {
    /// A probe's column, a setting of the stream, or a key of the ledger's line.
    Value {
        /// Column or key.
        key: String,
        /// Value in a; null if it has none.
        a: Json,
        /// Value in b; null if it has none.
        b: Json,
    },
    /// The values of a grid.
    Grid(GridDiff),
    /// The bytes of the files, if no voxel differs: another program made one of them from
    /// its particles.
    Bytes {
        /// Length of a's file, bytes.
        a: u64,
        /// Length of b's file, bytes.
        b: u64,
    },
}

/// Difference of two grids of the same name, voxel by voxel.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct GridDiff {
    /// Grid name: `surface` (metres) or `vel` (m/s).
    pub grid: String,
    /// Number of active voxels of a and of b.
    pub active: [u64; 2],
    /// Number of voxels whose values differ, or that are active on only one side.
    pub different: u64,
    /// Largest |a − b| of a voxel that is active in both, in the grid's unit.
    pub largest: f64,
    /// Index of the first voxel with that error; `None` if there is none.
    pub largest_at: Option<[i32; 3]>,
}

/// Compares grids whose voxels have the same positions.
pub fn grids<T: ComparedValue + PartialEq>(
    name: &str,
    a: &SparseGrid<T>,
    b: &SparseGrid<T>,
) -> GridDiff {
    let mut found = GridDiff {
        grid: name.to_owned(),
        active: [a.active_count(), b.active_count()],
        ..GridDiff::default()
    };
    // Both are ordered by their leaves' first voxels.
    let (mut i, mut j) = (0, 0);
    loop {
        let order = match (a.leaves.get(i), b.leaves.get(j)) {
            (None, None) => return found,
            (Some(_), None) => Ordering::Less,
            (None, Some(_)) => Ordering::Greater,
            (Some(x), Some(y)) => x.origin.cmp(&y.origin),
        };
        match order {
            Ordering::Less => found.different += a.leaves[i].active_count(),
            Ordering::Greater => found.different += b.leaves[j].active_count(),
            Ordering::Equal => found.leaf(&a.leaves[i], &b.leaves[j]),
        }
        i += usize::from(order.is_le());
        j += usize::from(order.is_ge());
    }
}

impl GridDiff {
    fn leaf<T: ComparedValue + PartialEq>(&mut self, a: &Leaf<T>, b: &Leaf<T>) {
        for element in 0..VOXELS {
            match (a.is_active(element), b.is_active(element)) {
                (false, false) => {}
                (true, true) => self.voxel(a, b, element),
                _ => self.different += 1,
            }
        }
    }

    fn voxel<T: ComparedValue + PartialEq>(&mut self, a: &Leaf<T>, b: &Leaf<T>, element: usize) {
        let (x, y) = (a.values[element], b.values[element]);
        self.different += u64::from(x != y);
        let error = x.error(y);
        if error > self.largest {
            self.largest = error;
            self.largest_at = Some(a.voxel(element));
        }
    }
}

/// Row of a probe for one frame.
#[derive(Clone, Copy, Debug)]
pub struct ProbeRow<'a> {
    /// Names of the columns.
    pub columns: &'a [String],
    /// Values; `None` where there was nothing to measure.
    pub values: &'a [Option<f64>],
}

/// Returns the columns in which two rows differ in any bit, or that only one side has; in a's
/// order, then b's.
pub fn rows(a: ProbeRow<'_>, b: ProbeRow<'_>) -> Vec<Difference> {
    let value = |row: ProbeRow<'_>, column: &String| {
        let index = row.columns.iter().position(|c| c == column)?;
        Some(row.values.get(index).copied().flatten())
    };
    let is_new = |column: &&String| !a.columns.contains(column);
    let columns = a.columns.iter().chain(b.columns.iter().filter(is_new));
    let mut found = Vec::new();
    for column in columns {
        let (x, y) = (value(a, column), value(b, column));
        let bits = |v: Option<Option<f64>>| v.map(|v| v.map(f64::to_bits));
        if bits(x) != bits(y) {
            let json = |v: Option<Option<f64>>| Json::from(v.flatten());
            found.push(Difference::Value {
                key: column.clone(),
                a: json(x),
                b: json(y),
            });
        }
    }
    found
}

/// Returns the keys at which two JSON values differ, with dots between their parts, prefixed by
/// `key` unless it is empty.
pub fn keys(key: &str, a: &Json, b: &Json) -> Vec<Difference> {
    let (Json::Object(x), Json::Object(y)) = (a, b) else {
        let different = (a != b).then(|| Difference::Value {
            key: key.to_owned(),
            a: a.clone(),
            b: b.clone(),
        });
        return different.into_iter().collect();
    };
    let below = |name: &String| {
        let of = |map: &serde_json::Map<String, Json>| map.get(name).cloned().unwrap_or_default();
        let path = match key {
            "" => name.clone(),
            _ => format!("{key}.{name}"),
        };
        keys(&path, &of(x), &of(y))
    };
    let is_new = |name: &&String| !x.contains_key(*name);
    let names = x.keys().chain(y.keys().filter(is_new));
    names.flat_map(below).collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use serde_json::json;

    use super::*;

    /// A leaf whose first voxels are active and have these values.
    fn leaf(origin: [i32; 3], values: &[f32]) -> Leaf<f32> {
        let mut active = [0; 8];
        active[0] = (1u64 << values.len()) - 1;
        let mut all = vec![9.0; VOXELS];
        all[..values.len()].copy_from_slice(values);
        Leaf {
            origin,
            active,
            values: all,
        }
    }

    fn grid(leaves: Vec<Leaf<f32>>) -> SparseGrid<f32> {
        SparseGrid {
            origin: DVec3::ZERO,
            voxel_size: 0.1,
            background: 9.0,
            leaves,
            inside: Vec::new(),
        }
    }

    #[test]
    fn voxels_are_matched_by_their_index() {
        let b = grid(vec![
            leaf([0, 0, 0], &[1.0, 2.0, 3.0]),
            leaf([8, 0, 0], &[4.0, 5.0]),
        ]);
        let same = grids("surface", &b, &b);
        assert_eq!((same.different, same.largest_at), (0, None));

        // One value off by 0.5 and one more voxel; a leaf that only b has, and one that only a has.
        let a = grid(vec![
            leaf([0, 0, -8], &[7.0]),
            leaf([0, 0, 0], &[1.0, 2.5, 3.0, 3.0]),
        ]);
        let found = grids("surface", &a, &b);
        assert_eq!(found.active, [5, 5]);
        assert_eq!(found.different, 1 + 1 + 2 + 1);
        assert_eq!((found.largest, found.largest_at), (0.5, Some([0, 0, 1])));
    }

    #[test]
    fn a_row_differs_in_the_columns_that_are_named() {
        let columns = ["eta_m", "depth_m", "speed_m_s"].map(str::to_owned);
        let row = |columns, values| ProbeRow { columns, values };
        let b = row(&columns, &[Some(1.0), None, Some(0.0)]);
        assert_eq!(rows(b, b), []);
        let value = |key: &str, a: Json, b: Json| Difference::Value {
            key: key.to_owned(),
            a,
            b,
        };
        // A different value, one that only a has, and the sign of a zero.
        let a = row(&columns, &[Some(1.5), Some(2.0), Some(-0.0)]);
        assert_eq!(
            rows(a, b),
            [
                value("eta_m", json!(1.5), json!(1.0)),
                value("depth_m", json!(2.0), json!(null)),
                value("speed_m_s", json!(-0.0), json!(0.0)),
            ]
        );
        // Columns are matched by name; those on only one side differ.
        let swapped = ["depth_m", "eta_m"].map(str::to_owned);
        let a = row(&swapped, &[None, Some(1.0)]);
        assert_eq!(rows(a, b), [value("speed_m_s", json!(null), json!(0.0))]);
    }

    #[test]
    fn a_ledger_line_differs_in_the_keys_that_are_named() {
        let b = json!({ "time": 0.5, "projection": { "residual": 1e-6, "missed": 0 } });
        assert_eq!(keys("report", &b, &b), []);
        let a = json!({ "time": 0.5, "projection": { "residual": 2e-6 }, "capped": 1 });
        let found = keys("report", &a, &b);
        let names: Vec<_> = found
            .iter()
            .map(|difference| match difference {
                Difference::Value { key, .. } => key.as_str(),
                _ => "",
            })
            .collect();
        let expected = [
            "report.capped",
            "report.projection.residual",
            "report.projection.missed",
        ];
        assert_eq!(names, expected);
    }
}
