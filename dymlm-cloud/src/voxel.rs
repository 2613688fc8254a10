use dymlm_core::{Point, Rgb};

/// Bits of a coordinate that lie within its voxel: positions are summed in 1/256 of a voxel.
pub(crate) const SUBVOXEL_BITS: u32 = 8;
/// Parts of a voxel along an axis.
pub(crate) const SUBVOXELS: i32 = 1 << SUBVOXEL_BITS;

/// What a voxel has seen, as integer sums: sums of integers do not depend on their order, and what was added
/// can be taken out again without a trace. Arithmetic wraps, so a negated weight takes out.
///
/// One cache line: adding a reading to a voxel costs little more than fetching it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(align(64))]
pub(crate) struct Voxel {
    /// Sum of weights.
    weight: u64,
    /// Sums of weight times position within the voxel, 1/256 voxel.
    position: [u64; 3],
    /// Sums of weight times colour.
    color: [u64; 3],
    /// Frames that read the voxel.
    pub(crate) observations: u32,
    /// The last frame that did, so that a frame counts once.
    pub(crate) stamp: u32,
}

impl Voxel {
    /// Adds a reading of `weight` at a position within the voxel.
    #[inline]
    pub(crate) fn add(&mut self, weight: u64, within: [u64; 3], color: Rgb) {
        self.weight = self.weight.wrapping_add(weight);
        for axis in 0..3 {
            self.position[axis] = self.position[axis].wrapping_add(weight.wrapping_mul(within[axis]));
            self.color[axis] = self.color[axis].wrapping_add(weight.wrapping_mul(u64::from(color[axis])));
        }
    }

    /// Adds another map's sums for the same voxel.
    pub(crate) fn merge(&mut self, other: &Self) {
        self.weight = self.weight.wrapping_add(other.weight);
        for axis in 0..3 {
            self.position[axis] = self.position[axis].wrapping_add(other.position[axis]);
            self.color[axis] = self.color[axis].wrapping_add(other.color[axis]);
        }
        self.observations = self.observations.wrapping_add(other.observations);
    }

    /// The same readings at one place of a voxel, 1/256 voxel.
    pub(crate) fn placed(&self, within: [u64; 3]) -> Self {
        Self { position: within.map(|c| c.wrapping_mul(self.weight)), stamp: 0, ..*self }
    }

    /// Whether nothing is left of it.
    pub(crate) fn is_empty(&self) -> bool {
        self.weight == 0 && self.observations == 0
    }

    /// Whether more was taken out than put in.
    pub(crate) fn is_overdrawn(&self) -> bool {
        let negative = |sum: u64| sum > u64::MAX / 2;
        negative(self.weight)
            || self.position.into_iter().any(negative)
            || self.color.into_iter().any(negative)
            || self.observations > u32::MAX / 2
            || (self.weight == 0) != (self.observations == 0)
    }

    /// Sum of weights.
    pub(crate) fn weight(&self) -> u64 {
        self.weight
    }

    /// Weighted mean position, metres, of the voxel at lattice coordinates `cell`.
    pub(crate) fn mean_position(&self, cell: [i32; 3], voxel_size: f64) -> Point {
        let weight = self.weight.max(1) as f64;
        std::array::from_fn(|axis| {
            let within = self.position[axis] as f64 / weight / f64::from(SUBVOXELS);
            ((f64::from(cell[axis]) + within) * voxel_size) as f32
        })
    }

    /// Weighted mean colour of the readings but for the weight `uncolored` of those without; `None` when
    /// there are none.
    pub(crate) fn mean_color(&self, uncolored: u64) -> Option<Rgb> {
        let weight = self.weight.wrapping_sub(uncolored);
        (weight > 0).then(|| self.color.map(|sum| (sum.wrapping_add(weight / 2) / weight) as u8))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_added_can_be_taken_out() {
        let mut voxel = Voxel { observations: 1, ..Voxel::default() };
        voxel.add(30, [1, 2, 255], [10, 20, 30]);
        let before = voxel;
        voxel.add(700, [200, 0, 17], [255, 0, 1]);
        voxel.add(700_u64.wrapping_neg(), [200, 0, 17], [255, 0, 1]);
        assert_eq!(voxel, before);
        voxel.add(700_u64.wrapping_neg(), [200, 0, 17], [255, 0, 1]);
        assert!(voxel.is_overdrawn());
    }
}
