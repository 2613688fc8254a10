use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::vector3::{Vector3, along, difference};
use dymlm_core::{Point, Pose, SensorModel};

#[cfg(feature = "state")]
use super::counter::MOST_COUNTED;
use super::counter::counted;

/// The fused surface points of an object, in voxels relative to its first centroid.
///
/// Sums are integers, so what was added can be subtracted again exactly, and the order does not matter. When
/// there are too many voxels, their side doubles.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct ObjectCloud {
    origin: Vector3,
    /// Side of a voxel at level 0, metres.
    voxel_size: f64,
    /// Voxels have a side of 2^level voxel sizes.
    level: u32,
    voxels: BTreeMap<VoxelKey, Voxel>,
    /// Cells of [`CELL`] metres that hold points, with a count of the voxels added to each.
    cells: BTreeMap<VoxelKey, u32>,
}

type VoxelKey = [i32; 3];

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
struct Voxel {
    /// Sum of the readings' weights, in units of 1 / [`WEIGHT_UNITS`].
    weight: i64,
    /// Weighted sum of places relative to the origin, in units of 1 / [`UNITS`] metres.
    sum: [i64; 3],
    /// Sum of the observations' weights.
    observations: u32,
}

/// The points of one observation, by voxel of level 0, ascending.
#[derive(Debug, Clone, Default)]
pub(crate) struct CloudPatch {
    voxels: Vec<(VoxelKey, Voxel)>,
}

/// Units of length per metre.
const UNITS: f64 = 1_048_576.0;
/// Weight of a reading at a depth of 0.4 m.
const WEIGHT_UNITS: f32 = 65_536.0;
/// Side of the cells by which shared points are found, metres.
const CELL: f64 = 0.04;
/// Half side of the cube around the origin within which points are accepted, metres.
const REACH: f64 = 64.0;

#[cfg(feature = "state")]
impl ObjectCloud {
    /// Whether its numbers are plausible; a damaged file may hold others.
    pub(crate) fn is_possible(&self) -> bool {
        self.level <= 16
            && self.origin.iter().all(|c| c.abs() < 1e9)
            && (1e-6..1e3).contains(&self.voxel_size)
            && self.voxels.values().all(|voxel| voxel.weight > 0)
            && self.cells.values().all(|&count| count <= MOST_COUNTED)
    }
}

impl ObjectCloud {
    pub(crate) fn new(origin: Vector3, voxel_size: f64) -> Self {
        Self { origin, voxel_size, level: 0, voxels: BTreeMap::new(), cells: BTreeMap::new() }
    }

    pub(crate) fn origin(&self) -> Vector3 {
        self.origin
    }

    pub(crate) fn len(&self) -> usize {
        self.voxels.len()
    }

    /// The voxels of an observation's points (camera's frame), each with the weight `observations`; only of
    /// points for whose place in the world `is_wanted` holds.
    pub(crate) fn patch(
        &self,
        points: &[Point],
        observations: u32,
        world_from_camera: &Pose,
        sensor: &SensorModel,
        is_wanted: impl Fn(Vector3) -> bool,
    ) -> CloudPatch {
        let mut voxels = Vec::with_capacity(points.len());
        for point in points {
            let place = world_from_camera.transform_point(point.map(f64::from));
            let offset = difference(place, self.origin);
            if !offset.iter().all(|c| c.abs() < REACH) || !is_wanted(place) {
                continue;
            }
            let weight = weight_at(point[2], sensor);
            let sum = offset.map(|c| weight * (c * UNITS).round() as i64);
            voxels.push((self.key(offset), Voxel { weight, sum, observations }));
        }
        // The sort is unstable, but integer sums do not depend on the order within a voxel.
        voxels.sort_unstable_by_key(|(key, _)| *key);
        voxels.dedup_by(|(other, added), (key, voxel)| {
            let is_same = other == key;
            if is_same {
                voxel.add(&Voxel { observations: 0, ..*added });
            }
            is_same
        });
        CloudPatch { voxels }
    }

    pub(crate) fn add(&mut self, patch: &CloudPatch, max_voxels: usize) {
        for (key, voxel) in &patch.voxels {
            self.voxels.entry(raised(*key, self.level)).or_default().add(voxel);
            self.count_cell(voxel.place(), 1);
        }
        self.limit(max_voxels);
    }

    /// Subtracts a patch that was added.
    pub(crate) fn subtract(&mut self, patch: &CloudPatch) {
        for (key, voxel) in &patch.voxels {
            let key = raised(*key, self.level);
            if let Some(own) = self.voxels.get_mut(&key) {
                own.subtract(voxel);
                if own.weight <= 0 {
                    self.voxels.remove(&key);
                }
            }
            let cell = cell_at(voxel.place());
            if let Some(count) = self.cells.get_mut(&cell) {
                *count = count.saturating_sub(1);
                if *count == 0 {
                    self.cells.remove(&cell);
                }
            }
        }
    }

    /// Takes out the voxels whose mean place in the world is no longer the object's. Returns whether there
    /// were any.
    pub(crate) fn take_out(&mut self, is_gone: impl Fn(Vector3) -> bool) -> bool {
        let (before, origin) = (self.voxels.len(), self.origin);
        self.voxels.retain(|_, voxel| !is_gone(along(voxel.place(), 1.0, origin)));
        let is_changed = self.voxels.len() < before;
        if is_changed {
            let side = self.voxel_size * f64::from(1_u32 << self.level.min(16));
            let cells_of = |key: &VoxelKey| {
                let first = key.map(|c| (f64::from(c) * side / CELL).floor() as i32);
                let last = key.map(|c| ((f64::from(c) + 1.0) * side / CELL).ceil() as i32 - 1);
                cells_between(first, last)
            };
            let left: BTreeSet<VoxelKey> = self.voxels.keys().flat_map(cells_of).collect();
            self.cells.retain(|cell, _| left.contains(cell));
        }
        is_changed
    }

    /// Adds the points of another object's cloud.
    pub(crate) fn merge(&mut self, other: &Self, max_voxels: usize) {
        let shift: [i64; 3] =
            difference(other.origin, self.origin).map(|c| (c.clamp(-REACH, REACH) * UNITS).round() as i64);
        for voxel in other.voxels.values() {
            let mut moved = *voxel;
            for (sum, shift) in moved.sum.iter_mut().zip(shift) {
                *sum = sum.saturating_add(voxel.weight.saturating_mul(shift));
            }
            let key = raised(self.key(moved.place()), self.level);
            self.voxels.entry(key).or_default().add(&moved);
        }
        let shift = shift.map(|c| c as f64 / UNITS);
        self.count_cells_of(other, |place| along(place, 1.0, shift));
        self.limit(max_voxels);
    }

    /// The same points, moved.
    pub(crate) fn moved(&self, new_from_old: &Pose) -> Self {
        let mut moved = Self::new(new_from_old.transform_point(self.origin), self.voxel_size);
        moved.level = self.level;
        for voxel in self.voxels.values() {
            let place = new_from_old.rotate(voxel.place());
            let sum = place.map(|c| voxel.weight.saturating_mul((c * UNITS).round() as i64));
            let turned = Voxel { sum, ..*voxel };
            let key = raised(moved.key(place), moved.level);
            moved.voxels.entry(key).or_default().add(&turned);
        }
        moved.count_cells_of(self, |place| new_from_old.rotate(place));
        moved
    }

    /// The voxels' mean places relative to the origin, and their observations' summed weight, in order of
    /// voxels.
    pub(crate) fn points(&self) -> impl Iterator<Item = (Vector3, u32)> + '_ {
        self.voxels.values().map(|voxel| (voxel.place(), voxel.observations))
    }

    /// Whether a world point lies in a cell that holds points.
    pub(crate) fn holds(&self, place: Vector3) -> bool {
        let offset = difference(place, self.origin);
        offset.iter().all(|c| c.abs() < REACH) && self.cells.contains_key(&cell_at(offset))
    }

    /// Approximate size in bytes.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.voxels.len() * size_of::<(VoxelKey, Voxel)>() + self.cells.len() * size_of::<(VoxelKey, u32)>()
    }

    fn key(&self, offset: Vector3) -> VoxelKey {
        offset.map(|c| (c / self.voxel_size).floor() as i32)
    }

    fn count_cell(&mut self, offset: Vector3, voxels: u32) {
        let count = self.cells.entry(cell_at(offset)).or_default();
        *count = counted(*count, voxels);
    }

    /// Counts the cells of another cloud at their places here. They are its cells and not those of its
    /// voxels, which may be larger: each by the middles of its eight parts, since it lies across several
    /// here.
    fn count_cells_of(&mut self, other: &Self, here: impl Fn(Vector3) -> Vector3) {
        for (cell, &count) in &other.cells {
            for part in 0..8_u8 {
                let middle = [0, 1, 2].map(|k| {
                    let half = f64::from(part >> k & 1);
                    (f64::from(cell[k]) + 0.25 + 0.5 * half) * CELL
                });
                self.count_cell(here(middle), count);
            }
        }
    }

    fn limit(&mut self, max_voxels: usize) {
        while self.voxels.len() > max_voxels && self.level < 16 {
            self.coarsen();
        }
    }

    fn coarsen(&mut self) {
        self.level += 1;
        let fine = std::mem::take(&mut self.voxels);
        for (key, voxel) in fine {
            self.voxels.entry(raised(key, 1)).or_default().add(&voxel);
        }
    }
}

impl Voxel {
    fn add(&mut self, other: &Self) {
        self.weight = self.weight.saturating_add(other.weight);
        self.observations = self.observations.saturating_add(other.observations);
        for (sum, added) in self.sum.iter_mut().zip(other.sum) {
            *sum = sum.saturating_add(added);
        }
    }

    fn subtract(&mut self, other: &Self) {
        self.weight = self.weight.saturating_sub(other.weight);
        self.observations = self.observations.saturating_sub(other.observations);
        for (sum, taken) in self.sum.iter_mut().zip(other.sum) {
            *sum = sum.saturating_sub(taken);
        }
    }

    fn place(&self) -> Vector3 {
        self.sum.map(|sum| sum as f64 / (self.weight.max(1) as f64 * UNITS))
    }
}

/// The cell at an offset from the origin.
fn cell_at(offset: Vector3) -> VoxelKey {
    offset.map(|c| (c / CELL).floor() as i32)
}

/// The key of the voxel 2^levels times as large.
fn raised(key: VoxelKey, levels: u32) -> VoxelKey {
    key.map(|c| c >> levels)
}

/// The cells of a box, given by its first and its last one.
fn cells_between(first: VoxelKey, last: VoxelKey) -> impl Iterator<Item = VoxelKey> {
    (first[0]..=last[0]).flat_map(move |x| {
        (first[1]..=last[1]).flat_map(move |y| (first[2]..=last[2]).map(move |z| [x, y, z]))
    })
}

/// The weight 1 / sigma(z)^2 as an integer, relative to a reading at 0.4 m.
fn weight_at(z: f32, sensor: &SensorModel) -> i64 {
    let ratio = sensor.sigma(0.4) / sensor.sigma(z);
    ((WEIGHT_UNITS * ratio * ratio).round() as i64).max(1)
}

#[cfg(test)]
mod tests {
    use super::super::counter::MOST_COUNTED;
    use super::*;

    fn points(seed: u32) -> Vec<Point> {
        (0..200_u32)
            .map(|k| {
                [0, 1, 2].map(|axis| {
                    ((k * 7919 * (1 + axis) + seed * 104_729 + axis * 31) % 9973) as f32 / 20_000.0 + 0.4
                })
            })
            .collect()
    }

    #[test]
    fn what_was_added_is_taken_out_without_a_trace() {
        let mut cloud = ObjectCloud::new([0.5; 3], 0.01);
        let everything = |_: Vector3| true;
        let patches = [1, 2, 3]
            .map(|seed| cloud.patch(&points(seed), 1, &Pose::identity(), &SensorModel::kinect(), everything));
        for patch in &patches {
            cloud.add(patch, 100_000);
        }
        cloud.subtract(&patches[1]);
        let mut others = ObjectCloud::new([0.5; 3], 0.01);
        for patch in [&patches[2], &patches[0]] {
            others.add(patch, 100_000);
        }
        assert_eq!(cloud.voxels, others.voxels);
        assert_eq!(cloud.cells, others.cells);
    }

    #[test]
    fn what_is_no_longer_there_leaves_neither_voxels_nor_cells() {
        let mut cloud = ObjectCloud::new([0.5; 3], 0.01);
        let patch = cloud.patch(&points(1), 1, &Pose::identity(), &SensorModel::kinect(), |_| true);
        cloud.add(&patch, 100_000);
        assert!(!cloud.take_out(|_| false));
        let is_far = |place: Vector3| place[0] > 0.6;
        let rest = cloud.points().filter(|(place, _)| !is_far(along(*place, 1.0, [0.5; 3]))).count();
        assert!(cloud.take_out(is_far) && !cloud.take_out(is_far));
        assert_eq!(cloud.len(), rest);
        // All but a cell's width of what is left.
        let places = points(1).into_iter().map(|point| point.map(f64::from));
        let (far, near): (Vec<_>, Vec<_>) = places.partition(|&place| is_far(place));
        assert!(near.iter().all(|&place| cloud.holds(place)));
        assert!(!far.iter().any(|&place| place[0] > 0.6 + CELL && cloud.holds(place)));
    }

    #[test]
    fn too_many_voxels_become_larger_ones() {
        let mut cloud = ObjectCloud::new([0.5; 3], 0.01);
        for seed in 0..20 {
            let patch = cloud.patch(&points(seed), 1, &Pose::identity(), &SensorModel::kinect(), |_| true);
            cloud.add(&patch, 300);
        }
        assert!(cloud.len() <= 300 && cloud.level > 0);
        let total: u32 = cloud.points().map(|(_, observations)| observations).sum();
        assert!(total > 1000);
        assert!(cloud.points().all(|(place, _)| place.iter().all(|c| c.abs() <= 0.41)));
    }

    /// Regression: the cells of large voxels were reduced to one a voxel, and a table that was carried was
    /// no longer found where it stood.
    #[test]
    fn what_is_moved_or_merged_holds_its_surface_however_large_its_voxels_are() {
        // The upper side of a table, read each centimetre.
        let side: Vec<Point> =
            (0..200 * 160).map(|k| [0.01 * (k % 200) as f32, 0.01 * (k / 200) as f32, 1.013]).collect();
        let mut cloud = ObjectCloud::new([1.0, 0.8, 1.0], 0.01);
        let patch = cloud.patch(&side, 1, &Pose::identity(), &SensorModel::kinect(), |_| true);
        cloud.add(&patch, 700);
        assert!(cloud.level >= 3, "{}", cloud.level);
        let motion = Pose::new([3.0, -1.0, 0.2], [0.0, 0.1, 0.15, 0.983_615_779]).unwrap();
        let mut merged = ObjectCloud::new([1.33, 0.81, 1.02], 0.01);
        merged.merge(&cloud, 700);
        let moved = cloud.moved(&motion);
        let held = |cloud: &ObjectCloud, motion: Pose| {
            let places = side.iter().map(|point| motion.transform_point(point.map(f64::from)));
            places.filter(|&place| cloud.holds(place)).count() as f64 / side.len() as f64
        };
        for share in [held(&merged, Pose::identity()), held(&moved, motion)] {
            assert!(share > 0.97, "{share}");
        }
    }

    /// Regression: the sums of weights of what a person carried about, seen from all sides for days,
    /// overflowed, and above a limit were saved but not loaded.
    #[test]
    fn what_is_seen_for_ever_is_counted_to_a_limit() {
        let mut cloud = ObjectCloud::new([0.5; 3], 0.01);
        let patch = cloud.patch(&points(1), 1024, &Pose::identity(), &SensorModel::kinect(), |_| true);
        cloud.add(&patch, 100_000);
        cloud.voxels.values_mut().for_each(|voxel| voxel.observations = u32::MAX - 1);
        cloud.cells.values_mut().for_each(|count| *count = MOST_COUNTED);
        let mut cloud = cloud.moved(&Pose::identity());
        cloud.add(&patch, 100_000);
        assert!(cloud.cells.values().all(|&count| count == MOST_COUNTED));
        #[cfg(feature = "state")]
        assert!(cloud.is_possible());
    }

    #[test]
    fn absurd_points_are_passed_over() {
        let cloud = ObjectCloud::new([0.0; 3], 0.01);
        let patch = cloud.patch(
            &[[f32::NAN, 0.0, 1.0], [1e30, 0.0, 1.0]],
            1,
            &Pose::identity(),
            &SensorModel::kinect(),
            |_| true,
        );
        assert!(patch.voxels.is_empty());
    }
}
