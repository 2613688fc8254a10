use super::block::{BlockKey, REACH, local, visit_in, voxel_at};
use super::voxel_box::VoxelBox;
use super::voxel_lists::VoxelLists;
use crate::shared_map::SharedMap;

/// The voxels of a plane's inliers, in blocks, with the number of samples in each. Counts can be added and
/// subtracted; the cost depends on what is added or subtracted, not on the size of the plane.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Patch {
    blocks: SharedMap<BlockKey, Vec<Counted>>,
    voxels: usize,
    bounds: VoxelBox,
}

/// A voxel's place in its block, and its number of samples. Blocks keep them sorted by place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
struct Counted {
    local: u16,
    count: u32,
}

/// A voxel and the number of samples in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PatchVoxel {
    /// Lattice coordinates.
    pub(crate) cell: [i32; 3],
    pub(crate) count: u32,
}

impl PatchVoxel {
    /// Its place in its block; in the order of voxels.
    pub(crate) fn place_in_block(self) -> u16 {
        local(self.cell)
    }

    /// Centre, metres.
    pub(crate) fn center(self, voxel_size: f64) -> [f64; 3] {
        self.cell.map(|c| (f64::from(c) + 0.5) * voxel_size)
    }
}

/// A cube of 2^level voxels a side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct CoarseCell([i32; 3]);

impl CoarseCell {
    /// Replaces cells by those of twice the size that contain them.
    pub(crate) fn double(cells: &mut Vec<Self>) {
        for cell in cells.iter_mut() {
            cell.0 = cell.0.map(|c| c >> 1);
        }
        cells.sort_unstable();
        cells.dedup();
    }

    /// Centre, in voxels.
    pub(crate) fn center(self, level: u32) -> [f64; 3] {
        self.0.map(|c| (f64::from(c) + 0.5) * f64::from(1_u32 << level))
    }

    /// Square of the distance between two centres, in cells.
    pub(crate) fn square_distance(self, other: Self) -> i64 {
        (0..3).map(|axis| i64::from(self.0[axis] - other.0[axis]).pow(2)).sum()
    }
}

/// The largest integer that is not greater; processors without an instruction for it spend a call on
/// [`f64::floor`].
#[inline]
fn floor(x: f64) -> i32 {
    let toward_zero = x as i32;
    toward_zero.saturating_sub(i32::from(f64::from(toward_zero) > x))
}

/// Largest coordinate of voxels along each axis, metres.
pub(crate) fn reach(voxel_size: f64) -> f64 {
    f64::from(REACH) * voxel_size
}

impl Patch {
    /// The voxels of some points (world, metres); points that are not finite are ignored.
    pub(crate) fn of_points(
        points: impl Iterator<Item = [f64; 3]>,
        voxel_size: f64,
        lists: &mut VoxelLists,
    ) -> Self {
        let scale = 1.0 / voxel_size;
        lists.clear();
        // A loop inside the iterator, which is faster than one that asks for each point.
        points
            .filter(|point| point.iter().all(|x| x.is_finite()))
            .for_each(|point| lists.add(point.map(|x| floor(x * scale))));
        let mut patch = Self::default();
        for (block, counted) in lists.counted() {
            let voxels: Vec<_> = counted.into_iter().map(|(local, count)| Counted { local, count }).collect();
            patch.voxels += voxels.len();
            patch.blocks.insert(block, voxels);
        }
        patch.measure();
        patch
    }

    /// Computes the box around the voxels anew. O(n).
    fn measure(&mut self) {
        let around = |bounds: VoxelBox, voxel: PatchVoxel| {
            bounds.union(&VoxelBox { min: voxel.cell, max: voxel.cell })
        };
        self.bounds = self.voxels().fold(VoxelBox::default(), around);
    }

    /// Number of voxels.
    pub(crate) fn len(&self) -> usize {
        self.voxels
    }

    /// The voxels, in a fixed order.
    pub(crate) fn voxels(&self) -> impl Iterator<Item = PatchVoxel> {
        self.blocks.iter().flat_map(|(&block, voxels)| in_block(block, voxels))
    }

    /// The voxels of one block.
    pub(crate) fn voxels_of(&self, block: BlockKey) -> impl Iterator<Item = PatchVoxel> {
        self.blocks.get(&block).into_iter().flat_map(move |voxels| in_block(block, voxels))
    }

    /// The voxels in a box, in a fixed order. O(blocks in the box).
    pub(crate) fn voxels_in<'a>(&'a self, region: &VoxelBox) -> impl Iterator<Item = PatchVoxel> + use<'a> {
        let region = region.intersection(&self.bounds);
        let mut found = Vec::new();
        visit_in(&self.blocks, &region, 0, |block, voxels| found.push((block, voxels)));
        let voxels = found.into_iter().flat_map(|(block, voxels)| in_block(block, voxels));
        voxels.filter(move |voxel| region.contains(voxel.cell))
    }

    /// The blocks that have voxels.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = BlockKey> {
        self.blocks.keys().copied()
    }

    /// Visits the blocks with voxels that a box touches.
    pub(crate) fn visit_blocks_in(&self, region: &VoxelBox, mut visit: impl FnMut(BlockKey)) {
        visit_in(&self.blocks, region, 0, |block, _| visit(block));
    }

    /// Adds the counts of another patch; calls `is_new` for each block that is new. O(blocks of the other).
    pub(crate) fn add(&mut self, other: &Self, mut is_new: impl FnMut(BlockKey)) {
        for (&block, theirs) in other.blocks.iter() {
            let ours = self.blocks.get_or_insert_with(block, || {
                is_new(block);
                Vec::new()
            });
            self.voxels -= ours.len();
            add_counts(ours, theirs);
            self.voxels += ours.len();
        }
        self.bounds = self.bounds.union(&other.bounds);
    }

    /// Subtracts the counts of a patch that was added before; calls `is_gone` for each block that becomes
    /// empty. O(blocks of the other), and O(n) when the other reached to the end of the plane.
    pub(crate) fn subtract(&mut self, other: &Self, mut is_gone: impl FnMut(BlockKey)) {
        for (&block, theirs) in other.blocks.iter() {
            let Some(ours) = self.blocks.get_mut(&block) else { continue };
            self.voxels -= ours.len();
            let mut theirs = theirs.iter().peekable();
            ours.retain_mut(|voxel| {
                while theirs.next_if(|other| other.local < voxel.local).is_some() {}
                if let Some(other) = theirs.next_if(|other| other.local == voxel.local) {
                    voxel.count = voxel.count.saturating_sub(other.count);
                }
                voxel.count > 0
            });
            self.voxels += ours.len();
            if ours.is_empty() {
                self.blocks.remove(&block);
                is_gone(block);
            }
        }
        let inside = |axis: usize| {
            other.bounds.min[axis] > self.bounds.min[axis] && other.bounds.max[axis] < self.bounds.max[axis]
        };
        if !(0..3).all(inside) {
            self.measure();
        }
    }

    /// The cells of 2^level voxels a side that hold voxels in a box, each once, in a fixed order.
    pub(crate) fn coarse_cells_in(&self, region: &VoxelBox, level: u32) -> Vec<CoarseCell> {
        let mut cells: Vec<CoarseCell> = Vec::new();
        for voxel in self.voxels_in(region) {
            let cell = CoarseCell(voxel.cell.map(|c| c >> level));
            if cells.last() != Some(&cell) {
                cells.push(cell);
            }
        }
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    /// The voxels in a box that two patches have in common.
    pub(crate) fn common_voxels<'a>(
        &'a self,
        other: &'a Self,
        region: &VoxelBox,
    ) -> impl Iterator<Item = PatchVoxel> + use<'a> {
        let here = |voxel: &PatchVoxel| {
            let block = other.blocks.get(&BlockKey::of(voxel.cell));
            block.is_some_and(|block| block.binary_search_by_key(&local(voxel.cell), |v| v.local).is_ok())
        };
        self.voxels_in(&region.intersection(&other.bounds)).filter(here)
    }

    /// Whether the voxel of a point or one of its neighbours is occupied.
    pub(crate) fn is_near(&self, point: [f64; 3], voxel_size: f64) -> bool {
        let beside = VoxelBox::around([point, point], voxel_size).grown(1);
        let mut found = false;
        visit_in(&self.blocks, &beside.intersection(&self.bounds), 0, |block, voxels| {
            let part = beside.intersection(&block.voxels());
            found = found
                || (part.min[0]..=part.max[0]).any(|x| {
                    (part.min[1]..=part.max[1]).any(|y| {
                        let [first, last] = [part.min[2], part.max[2]].map(|z| local([x, y, z]));
                        let from = voxels.partition_point(|voxel| voxel.local < first);
                        voxels.get(from).is_some_and(|voxel| voxel.local <= last)
                    })
                });
        });
        found
    }

    /// The box around the voxels.
    pub(crate) fn bounds(&self) -> VoxelBox {
        self.bounds
    }

    /// Bytes that another patch does not share.
    pub(crate) fn memory_bytes_beside(&self, other: Option<&Self>) -> usize {
        let voxels = |voxels: &Vec<Counted>, _: Option<&_>| voxels.capacity() * size_of::<Counted>();
        self.blocks.memory_bytes_beside(other.map(|other| &other.blocks), voxels)
    }
}

/// The voxels of a block in the form in which they are saved.
#[cfg(feature = "state")]
#[derive(serde::Serialize, serde::Deserialize)]
pub(crate) struct SavedBlock {
    block: BlockKey,
    voxels: Vec<Counted>,
}

#[cfg(feature = "state")]
impl SavedBlock {
    /// The cube that contains it.
    pub(crate) fn cube(&self) -> u64 {
        self.block.cube()
    }
}

#[cfg(feature = "state")]
impl Patch {
    /// The cubes of the blocks that are new or changed since an earlier state of the patch, and of those that
    /// have gone since.
    pub(crate) fn blocks_that_differ(&self, earlier: Option<&Self>) -> Vec<u64> {
        let none = SharedMap::default();
        let earlier = earlier.map_or(&none, |earlier| &earlier.blocks);
        let changed = self.blocks.changed_since(earlier).map(|(block, _)| block);
        changed.chain(earlier.gone_from(&self.blocks)).map(|block| block.cube()).collect()
    }

    /// The blocks in the cubes for which `is_wanted` holds, each with its cube.
    pub(crate) fn saved_blocks(&self, is_wanted: impl Fn(u64) -> bool) -> Vec<(u64, SavedBlock)> {
        let blocks = self.blocks.iter().map(|(block, voxels)| (block.cube(), *block, voxels));
        let wanted = blocks.filter(|(cube, ..)| is_wanted(*cube));
        wanted.map(|(cube, block, voxels)| (cube, SavedBlock { block, voxels: voxels.clone() })).collect()
    }

    /// Adds a saved block; returns false, and adds nothing, when it is invalid or already present. Afterwards
    /// call [`Self::finish_restoring`].
    pub(crate) fn restore(&mut self, saved: SavedBlock) -> bool {
        let SavedBlock { block, voxels } = saved;
        let is_possible = block.is_possible()
            && !voxels.is_empty()
            && voxels.is_sorted_by(|a, b| a.local < b.local)
            && voxels.iter().all(|voxel| voxel.local < 1 << 12 && voxel.count > 0)
            && !self.blocks.contains_key(&block);
        if is_possible {
            self.voxels += voxels.len();
            self.blocks.insert(block, voxels);
        }
        is_possible
    }

    /// Computes the bounds of the restored blocks.
    pub(crate) fn finish_restoring(&mut self) {
        self.measure();
    }
}

fn in_block(block: BlockKey, voxels: &[Counted]) -> impl Iterator<Item = PatchVoxel> {
    voxels.iter().map(move |voxel| PatchVoxel { cell: voxel_at(block, voxel.local), count: voxel.count })
}

/// Adds counts to a list, which grows by exactly the places that are missing in it.
fn add_counts(ours: &mut Vec<Counted>, theirs: &[Counted]) {
    let mut lacking = Vec::new();
    let mut place = 0;
    for voxel in theirs {
        while ours.get(place).is_some_and(|own| own.local < voxel.local) {
            place += 1;
        }
        match ours.get_mut(place) {
            Some(own) if own.local == voxel.local => own.count = own.count.saturating_add(voxel.count),
            _ => lacking.push(*voxel),
        }
    }
    if !lacking.is_empty() {
        ours.reserve_exact(lacking.len());
        ours.extend(lacking);
        ours.sort_unstable_by_key(|voxel| voxel.local);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn patch(points: &[[f64; 3]]) -> Patch {
        Patch::of_points(points.iter().copied(), 0.1, &mut VoxelLists::default())
    }

    #[test]
    fn keys_keep_cells() {
        let patch = patch(&[[-0.05, 0.25, 1000.0], [f64::NAN, 0.0, 0.0]]);
        let voxels: Vec<PatchVoxel> = patch.voxels().collect();
        assert_eq!((voxels.len(), patch.len(), voxels[0].cell), (1, 1, [-1, 2, 10000]));
        let center = voxels[0].center(0.1);
        assert!((center[0] + 0.05).abs() < 1e-12 && (center[2] - 1000.05).abs() < 1e-9);
    }

    proptest! {
        #[test]
        fn each_voxel_counts_the_points_in_it(
            points in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 0..200),
        ) {
            // Several points in many voxels, and several blocks.
            let mut expected = std::collections::BTreeMap::new();
            for point in &points {
                *expected.entry(point.map(|x| (x * (1.0 / 0.1)).floor() as i32)).or_insert(0) += 1;
            }
            let patch = patch(&points);
            let counted: std::collections::BTreeMap<_, _> =
                patch.voxels().map(|voxel| (voxel.cell, voxel.count)).collect();
            prop_assert_eq!(counted, expected);
            let in_order = |voxels: &[Counted]| voxels.is_sorted_by(|a, b| a.local < b.local);
            prop_assert!(patch.blocks.values().all(|voxels| in_order(voxels)));
        }

        #[test]
        fn numbers_are_rounded_down(x in prop_oneof![-1e4..1e4_f64, -1e12..1e12_f64, Just(-0.0), Just(-3.0)]) {
            prop_assert_eq!(floor(x), x.floor() as i32);
        }

        #[test]
        fn what_was_added_can_be_taken_out(
            a in prop::collection::vec(prop::array::uniform3(-3.0..3.0_f64), 0..60),
            b in prop::collection::vec(prop::array::uniform3(-3.0..3.0_f64), 0..60),
        ) {
            let (a, b) = (patch(&a), patch(&b));
            let (mut sum, mut added) = (a.clone(), a.blocks().collect::<Vec<_>>());
            sum.add(&b, |block| added.push(block));
            added.sort_unstable();
            prop_assert!(added.iter().copied().eq(sum.blocks()));
            let mut other_way = b.clone();
            other_way.add(&a, |_| ());
            prop_assert_eq!(&sum, &other_way);
            let bounds = sum.bounds();
            prop_assert!(sum.voxels().all(|voxel| bounds.contains(voxel.cell)));
            prop_assert_eq!(sum.voxels().count(), sum.len());
            let shared = a.voxels().filter(|v| b.voxels().any(|w| w.cell == v.cell)).count();
            prop_assert_eq!(a.common_voxels(&b, &bounds).count(), shared);
            sum.subtract(&b, |block| added.retain(|added| *added != block));
            prop_assert_eq!(&sum, &a);
            prop_assert!(added.into_iter().eq(a.blocks()));
        }

        #[test]
        fn a_box_holds_its_voxels(
            points in prop::collection::vec(prop::array::uniform3(-3.0..3.0_f64), 0..60),
            low in prop::array::uniform3(-40..40_i32),
            size in 0..30_i32,
        ) {
            let patch = patch(&points);
            let region = VoxelBox { min: low, max: low.map(|c| c + size) };
            let expected: Vec<_> = patch.voxels().filter(|voxel| region.contains(voxel.cell)).collect();
            prop_assert_eq!(patch.voxels_in(&region).collect::<Vec<_>>(), expected);
        }
    }
}
