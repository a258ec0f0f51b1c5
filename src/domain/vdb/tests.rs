use super::{read::level_set, *};
use crate::sparse_grid::{Leaf, Precision, SparseGrid};
use glam::DVec3;

/// Files of OpenVDB: floats and half precision, both by Blosc.
const FILES: [&[u8]; 2] = [
    include_bytes!("../../../tests/suite/domain/files/sphere.vdb"),
    include_bytes!("../../../tests/suite/domain/files/half.vdb"),
];

/// Leaves of two 32³ nodes, with each kind of inactive values that is written.
fn written(precision: Precision) -> (SparseGrid<f32>, Vec<u8>) {
    let leaf = |origin, active: [u64; 8], inactive: fn(usize) -> f32| Leaf {
        origin,
        active,
        values: (0..512)
            .map(|k| match active[k / 64] >> (k % 64) & 1 == 1 {
                true => (k as f32 - 200.0) / 1024.0,
                false => inactive(k),
            })
            .collect(),
    };
    let grid = SparseGrid {
        origin: DVec3::new(1.0, -2.0, 0.5),
        voxel_size: 0.25,
        background: 0.75,
        leaves: vec![
            leaf([-8, 0, 16], [0xff00_1234_5678_9abc; 8], |_| 0.75),
            leaf([0, -128, 8], [0xf0f0; 8], |_| -0.75),
            leaf([0, 0, 0], [u64::MAX; 8], |_| 0.0),
            leaf(
                [8, 0, 4088],
                [1; 8],
                |k| if k % 3 == 0 { 0.75 } else { -0.75 },
            ),
        ],
        inside: vec![[16, 0, 0]],
    };
    let metadata = [("frame", Metadata::Int(3))];
    let bytes = encode(&metadata, &[VdbGrid::LevelSet("surface", &grid)], precision);
    (grid, bytes)
}

#[test]
fn a_written_level_set_is_read_value_by_value() {
    for precision in [Precision::Float, Precision::Half] {
        let (grid, bytes) = written(precision);
        let mut found = level_set(&bytes).unwrap();
        found.leaves.sort_by_key(|leaf| leaf.origin);
        assert_eq!(found.leaves, grid.leaves);
        assert_eq!(found.scale, DVec3::splat(0.25));
        assert_eq!(found.translation, grid.origin + 0.125);
        let listed = &grids(&bytes).unwrap()[0];
        assert_eq!(
            (listed.name.as_str(), listed.class.as_str()),
            ("surface", "level set")
        );
        assert_eq!(listed.voxels, Some(grid.active_count()));
    }
}

/// Each byte of the first 900 and every 53rd of the rest damaged, and the file cut anywhere: an
/// error, or as many leaves as the bytes have space for.
#[test]
fn no_damage_makes_the_reader_panic() {
    let own = [Precision::Float, Precision::Half].map(|precision| written(precision).1);
    for file in FILES.into_iter().chain(own.iter().map(Vec::as_slice)) {
        let whole = level_set(file).unwrap();
        let check = |bytes: &[u8]| {
            let _ = grids(bytes);
            level_set(bytes).map(|it| assert!(it.leaves.len() <= bytes.len() / 128))
        };
        let mut spoiled = file.to_vec();
        let mut refused = 0;
        for at in (0..900).chain((900..file.len()).step_by(53)) {
            for value in [0x00, 0x7f, 0xff] {
                spoiled[at] = value;
                refused += u32::from(check(&spoiled).is_err());
                spoiled[at] = file[at];
            }
        }
        assert!(refused > 100, "negative control");
        for end in (0..file.len()).step_by(97) {
            assert!(check(&file[..end]).is_err(), "{end}");
        }
        assert_eq!(level_set(&spoiled).unwrap(), whole);
    }
}

#[test]
fn a_grid_is_not_read_twice() {
    let (_, bytes) = written(Precision::Float);
    let name = b"Tree_float_5_4_3";
    let at = bytes.windows(name.len()).position(|it| it == name).unwrap();
    // The end of the grid, after the name of its parent and two offsets.
    let end = at + name.len() + 4 + 16;
    let mut looped = bytes.clone();
    looped[end..][..8].copy_from_slice(&(at as u64).to_le_bytes());
    assert!(level_set(&looped).unwrap_err().contains("not in order"));
    looped[end..][..8].copy_from_slice(&(1u64 << 40).to_le_bytes());
    assert!(level_set(&looped).unwrap_err().contains("truncated"));
}
