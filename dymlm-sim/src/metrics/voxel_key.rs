//! Points of a lattice as keys of hash tables.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use dymlm_core::Point;

/// Largest lattice coordinate: three of them and their signs fit one integer.
const LIMIT: i32 = (1 << 20) - 1;

/// A voxel of the lattice whose voxel (0, 0, 0) reaches from the origin to `voxel_size` along each axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct VoxelKey(u64);

impl VoxelKey {
    /// The voxel that holds a point; `None` when the point is not finite. Points more than 2^20 voxels from the
    /// origin fall to the outermost voxels.
    #[inline]
    pub(crate) fn of(point: Point, voxels_per_metre: f32) -> Option<Self> {
        let [x, y, z] = point.map(|c| c * voxels_per_metre);
        // A NaN coordinate makes the sum NaN, an infinite one leaves it infinite or NaN.
        if !(point[0] + point[1] + point[2]).is_finite() && point.iter().any(|c| !c.is_finite()) {
            return None;
        }
        Some(Self::pack([x, y, z].map(|c| c.floor() as i32)))
    }

    #[inline]
    fn pack(cell: [i32; 3]) -> Self {
        let [x, y, z] = cell.map(|c| (c.clamp(-LIMIT, LIMIT) + LIMIT) as u64);
        Self(x << 42 | y << 21 | z)
    }

    /// The voxel `offset` voxels away, held to the lattice's bounds.
    #[inline]
    pub(crate) fn offset(self, offset: [i32; 3]) -> Self {
        let [x, y, z] = [42, 21, 0].map(|shift| (self.0 >> shift & 0x1f_ffff) as i32 - LIMIT);
        Self::pack([x + offset[0], y + offset[1], z + offset[2]])
    }
}

/// A map from voxels, hashed by one multiplication: its keys are points of space, not an adversary's choice.
pub(crate) type VoxelMap<T> = HashMap<VoxelKey, T, BuildHasherDefault<VoxelHasher>>;

#[derive(Default)]
pub(crate) struct VoxelHasher(u64);

impl Hasher for VoxelHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.write_u64(byte.into());
        }
    }

    #[inline]
    fn write_u64(&mut self, value: u64) {
        let mixed = (self.0 ^ value).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        // The table uses the upper and the lower bits.
        self.0 = mixed ^ (mixed >> 32);
    }
}

/// All offsets within `radius` voxels (Euclidean, bound included), nearest first.
pub(crate) fn ball(radius: f32) -> Vec<[i32; 3]> {
    let reach = radius.max(0.0).min(64.0);
    let (whole, squared) = (reach as i32, (reach * reach) as i32);
    let length = |[x, y, z]: [i32; 3]| x * x + y * y + z * z;
    let side = -whole..=whole;
    let mut offsets: Vec<[i32; 3]> = side
        .clone()
        .flat_map(|x| side.clone().map(move |y| (x, y)))
        .flat_map(|(x, y)| side.clone().map(move |z| [x, y, z]))
        .filter(|&offset| length(offset) <= squared)
        .collect();
    offsets.sort_by_key(|&offset| (length(offset), offset));
    offsets
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_agree_with_moved_points() {
        for point in [[0.5_f32, -0.5, 3.5], [-1e4, 20.25, 0.0], [1e5, -1e5, 0.125]] {
            let key = VoxelKey::of(point, 1.0).unwrap();
            let moved = [point[0] + 3.0, point[1] - 2.0, point[2] + 1.0];
            assert_eq!(key.offset([3, -2, 1]), VoxelKey::of(moved, 1.0).unwrap());
        }
    }

    #[test]
    fn odd_points_do_no_harm() {
        assert_eq!(VoxelKey::of([f32::NAN, 0.0, 0.0], 50.0), None);
        assert_eq!(VoxelKey::of([0.0, f32::INFINITY, f32::NEG_INFINITY], 50.0), None);
        let far = VoxelKey::of([f32::MAX, f32::MAX, -f32::MAX], 50.0).unwrap();
        assert_eq!(far.offset([1, 1, -1]), far);
    }

    #[test]
    fn a_ball_holds_its_bound() {
        assert_eq!(ball(0.0), [[0; 3]]);
        assert_eq!(ball(3.0).len(), 123);
        assert!(ball(3.0).contains(&[0, 0, 3]) && ball(3.0).contains(&[2, 2, 1]));
    }
}
