//! Types of values that a grid can hold.

use half::f16;

use crate::vdb::FLOAT_TREE;

/// A voxel's value.
pub(super) trait VoxelValue: Copy + PartialEq + Send + Sync {
    /// OpenVDB's name of the tree.
    const TREE: &'static str;
    /// How transforms act on vectors: like velocities.
    const VECTOR_TYPE: Option<&'static str>;

    /// The negated value.
    fn negative(self) -> Self;

    /// Components of the value.
    fn components(&self) -> &[f32];
}

impl VoxelValue for f32 {
    const TREE: &'static str = FLOAT_TREE;
    const VECTOR_TYPE: Option<&'static str> = None;

    fn negative(self) -> Self {
        -self
    }

    fn components(&self) -> &[f32] {
        std::slice::from_ref(self)
    }
}

impl VoxelValue for [f32; 3] {
    const TREE: &'static str = "Tree_vec3s_5_4_3";
    const VECTOR_TYPE: Option<&'static str> = Some("contravariant relative");

    fn negative(self) -> Self {
        self.map(|x| -x)
    }

    fn components(&self) -> &[f32] {
        self
    }
}

/// Appends a buffer value: two or four bytes per component.
pub(super) fn put<T: VoxelValue>(out: &mut Vec<u8>, value: T, is_half: bool) {
    for &x in value.components() {
        if is_half {
            out.extend_from_slice(&f16::from_f32(x).to_le_bytes());
        } else {
            out.extend_from_slice(&x.to_le_bytes());
        }
    }
}

/// Appends a tree value: four bytes per component, rounded to half precision if the buffers are.
pub(super) fn put_whole<T: VoxelValue>(out: &mut Vec<u8>, value: T, is_half: bool) {
    for &x in value.components() {
        let x = if is_half {
            f16::from_f32(x).to_f32()
        } else {
            x
        };
        out.extend_from_slice(&x.to_le_bytes());
    }
}
