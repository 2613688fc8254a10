use dymlm_core::{Point, Rgb};

/// Bits of a coordinate that lie within its voxel: positions are summed in 1/256 of a voxel.
pub(crate) const SUBVOXEL_BITS: u32 = 8;
/// Parts of a voxel along an axis.
pub(crate) const SUBVOXELS: i32 = 1 << SUBVOXEL_BITS;
/// Number of sums of a voxel.
pub(crate) const SUMS: usize = 8;

/// What was read in a voxel, as sums of integers: these do not depend on their order, and what was added can
/// be taken out again without a trace. Arithmetic wraps, so adding a negated weight takes a reading out.
///
/// [`VoxelBlock`](crate::voxel_block::VoxelBlock) stores it in half the bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Voxel {
    pub(crate) sums: Sums,
    /// Frames that read the voxel.
    pub(crate) observations: u32,
}

/// Sums over the readings of a voxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Sums {
    pub(crate) weight: u64,
    /// Sums of weight times position within the voxel, 1/256 voxel.
    pub(crate) position: [u64; 3],
    /// Sums of weight times colour.
    pub(crate) color: [u64; 3],
    /// Weight of the readings without colour.
    pub(crate) uncolored: u64,
}

impl Sums {
    /// The sums whose addition takes these out.
    pub(crate) fn negated(self) -> Self {
        Self::from_array(self.to_array().map(u64::wrapping_neg))
    }

    #[inline]
    pub(crate) fn to_array(self) -> [u64; SUMS] {
        let ([x, y, z], [r, g, b]) = (self.position, self.color);
        [self.weight, x, y, z, r, g, b, self.uncolored]
    }

    #[inline]
    pub(crate) fn from_array([weight, x, y, z, r, g, b, uncolored]: [u64; SUMS]) -> Self {
        Self { weight, position: [x, y, z], color: [r, g, b], uncolored }
    }
}

impl Voxel {
    /// The same readings, all at one place of a voxel, 1/256 voxel.
    pub(crate) fn placed(&self, within: [u64; 3]) -> Self {
        let position = within.map(|c| c.wrapping_mul(self.sums.weight));
        Self { sums: Sums { position, ..self.sums }, ..*self }
    }

    /// Whether nothing is left of the voxel.
    pub(crate) fn is_empty(&self) -> bool {
        self.sums.weight == 0 && self.observations == 0
    }

    /// Whether more was taken out than put in.
    pub(crate) fn is_overdrawn(&self) -> bool {
        self.sums.to_array().into_iter().any(|sum| sum > u64::MAX / 2)
            || self.sums.uncolored > self.sums.weight
            || self.observations > u32::MAX / 2
            || (self.sums.weight == 0) != (self.observations == 0)
    }

    /// Weighted mean position, metres, of the voxel at lattice coordinates `cell`.
    pub(crate) fn mean_position(&self, cell: [i32; 3], voxel_size: f64) -> Point {
        let within = self.mean_within();
        [0, 1, 2].map(|axis| ((f64::from(cell[axis]) + within[axis]) * voxel_size) as f32)
    }

    /// Weighted mean position from the voxel's lowest corner, voxels.
    pub(crate) fn mean_within(&self) -> [f64; 3] {
        let weight = to_f64(self.sums.weight.max(1));
        self.sums.position.map(|sum| to_f64(sum) / weight / f64::from(SUBVOXELS))
    }

    /// Weighted mean colour of the readings that had one; `None` when none had.
    pub(crate) fn mean_color(&self) -> Option<Rgb> {
        let weight = self.sums.weight.wrapping_sub(self.sums.uncolored);
        (weight > 0).then(|| self.sums.color.map(|sum| (sum.wrapping_add(weight / 2) / weight) as u8))
    }
}

/// A sum of a voxel that is not [overdrawn](Voxel::is_overdrawn).
#[inline]
pub(crate) fn to_f64(sum: u64) -> f64 {
    // A cast of a signed number is one instruction.
    sum as i64 as f64
}
