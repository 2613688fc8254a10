/// A box of voxels with inclusive corners; empty when `min` exceeds `max` on an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct VoxelBox {
    pub(crate) min: [i32; 3],
    pub(crate) max: [i32; 3],
}

impl Default for VoxelBox {
    /// The empty box.
    fn default() -> Self {
        Self { min: [i32::MAX; 3], max: [i32::MIN; 3] }
    }
}

impl VoxelBox {
    /// The voxels that a box (lowest and highest corner, metres) touches.
    pub(crate) fn around([low, high]: [[f64; 3]; 2], voxel_size: f64) -> Self {
        let voxel = |corner: [f64; 3]| corner.map(|c| (c / voxel_size).floor() as i32);
        Self { min: voxel(low), max: voxel(high) }
    }

    pub(crate) fn is_empty(&self) -> bool {
        (0..3).any(|axis| self.min[axis] > self.max[axis])
    }

    pub(crate) fn contains(&self, voxel: [i32; 3]) -> bool {
        (0..3).all(|axis| (self.min[axis]..=self.max[axis]).contains(&voxel[axis]))
    }

    pub(crate) fn grown(&self, voxels: i32) -> Self {
        if self.is_empty() {
            return *self;
        }
        Self {
            min: self.min.map(|c| c.saturating_sub(voxels)),
            max: self.max.map(|c| c.saturating_add(voxels)),
        }
    }

    pub(crate) fn union(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].min(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(other.max[axis])),
        }
    }

    pub(crate) fn intersection(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].max(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].min(other.max[axis])),
        }
    }

    /// The cells of 2^bits voxels a side that the box touches, as a box of cells.
    pub(super) fn coarse(&self, bits: u32) -> Self {
        Self { min: self.min.map(|c| c >> bits), max: self.max.map(|c| c >> bits) }
    }

    /// Number of columns along z.
    pub(super) fn columns(&self) -> u64 {
        if self.is_empty() {
            return 0;
        }
        (0..2).map(|axis| (i64::from(self.max[axis]) - i64::from(self.min[axis]) + 1) as u64).product()
    }

    /// Distance between two boxes, voxels; vast when one is empty.
    pub(crate) fn distance(&self, other: &Self) -> f64 {
        let gap = |axis: usize| {
            (i64::from(self.min[axis]) - i64::from(other.max[axis]))
                .max(i64::from(other.min[axis]) - i64::from(self.max[axis]))
        };
        (0..3).map(|axis| ((gap(axis) - 1).max(0) as f64).powi(2)).sum::<f64>().sqrt()
    }
}
