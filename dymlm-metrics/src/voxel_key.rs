//! Lattice points as keys of hash tables.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use dymlm_core::Point;

/// Largest lattice coordinate: three of them, with their signs, fit into one integer.
const LIMIT: i32 = (1 << 20) - 1;
/// By which share of a voxel [`VoxelKey::on_surface`] shifts the lattice: no whole number of millimetres for
/// any usual voxel.
const SHIFT: f32 = 0.313_7;

/// A voxel of a lattice; voxel (0, 0, 0) reaches from the origin to the voxel size along each axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VoxelKey(u64);

impl VoxelKey {
    /// The voxel that contains a point; `None` when the point is not finite. Points more than 2^20 voxels
    /// from the origin are assigned to the outermost voxels.
    #[inline]
    pub fn of(point: Point, voxels_per_metre: f32) -> Option<Self> {
        let [x, y, z] = point.map(|c| c * voxels_per_metre);
        // A quick test first: the sum with a NaN is NaN, and with an infinite coordinate infinite or NaN.
        if !(point[0] + point[1] + point[2]).is_finite() && point.iter().any(|c| !c.is_finite()) {
            return None;
        }
        Some(Self::pack([x, y, z].map(|c| c.floor() as i32)))
    }

    /// The voxel of a point on a surface, in a lattice that is shifted a little. Walls and table tops are often
    /// at whole centimetres, where two layers of the lattice of [`of`](Self::of) meet: rounding would put their
    /// points into either, and each piece of such a surface would count twice.
    #[inline]
    pub fn on_surface(point: Point, voxels_per_metre: f32) -> Option<Self> {
        Self::of(point.map(|c| c + SHIFT / voxels_per_metre), voxels_per_metre)
    }

    #[inline]
    fn pack(cell: [i32; 3]) -> Self {
        let [x, y, z] = cell.map(|c| (c.clamp(-LIMIT, LIMIT) + LIMIT) as u64);
        Self(x << 42 | y << 21 | z)
    }
}

/// A map from voxels, hashed by one multiplication: no adversary chooses the keys, which are points of space.
pub type VoxelMap<T> = HashMap<VoxelKey, T, BuildHasherDefault<VoxelHasher>>;

/// The hasher of a [`VoxelMap`].
#[derive(Debug, Clone, Default)]
pub struct VoxelHasher(u64);

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
        // The table uses both the upper and the lower bits.
        self.0 = mixed ^ (mixed >> 32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voxels_are_half_open_cubes_from_the_origin() {
        let key = |x: f32| VoxelKey::of([x, -0.5, 2.5], 1.0).unwrap();
        assert_eq!(key(0.0), key(0.999));
        assert_ne!(key(0.0), key(-0.001));
        assert!(key(-1.5) < key(-0.5) && key(0.5) < key(1.0));
    }

    #[test]
    fn a_surface_at_whole_centimetres_is_in_one_layer() {
        for voxels_per_metre in [100.0, 50.0, 20.0, 10.0] {
            for centimetres in -400..=400_i16 {
                let x = 0.01 * f32::from(centimetres);
                let keys = [x - 1e-6, x, x + 1e-6].map(|x| VoxelKey::on_surface([x; 3], voxels_per_metre));
                assert!(keys[0].is_some() && keys.iter().all(|key| *key == keys[0]), "{x} m");
            }
        }
    }

    #[test]
    fn odd_points_do_no_harm() {
        assert_eq!(VoxelKey::of([f32::NAN, 0.0, 0.0], 50.0), None);
        assert_eq!(VoxelKey::of([0.0, f32::INFINITY, f32::NEG_INFINITY], 50.0), None);
        let far = |x: f32| VoxelKey::of([x, x, -x], 50.0).unwrap();
        assert_eq!(far(f32::MAX), far(1e9));
        assert!(far(f32::MAX) > far(1e3));
    }
}
