use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::vector3::bounds;
use dymlm_core::{Point, Pose};

use crate::CloudMap;
use crate::block_store::{BLOCK_SIDE, BlockKey, split};
use crate::voxel::{SUBVOXELS, Voxel};
use dymlm_geometry::OrientedBox;

/// What [`CloudMap::move_body`] has moved.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct BodyMotion {
    /// Where the body's points were, metres, world.
    pub from: Vec<Point>,
    /// Where they are now, in the same order.
    pub to: Vec<Point>,
}

/// A voxel that is being moved.
struct Moved {
    /// The voxel where it was.
    cell: [i32; 3],
    to: [f64; 3],
    voxel: Voxel,
    /// Number of frames that read its cell of the evidence.
    support: u32,
}

impl CloudMap {
    /// Moves the voxels in `region` for which `is_body` is true (asked with the voxel's mean position in the
    /// world) to where `new_from_old` takes them, with their colours, weights and observations. At the new
    /// place the evidence of earlier frames, which looked through it, is forgotten; at the old place nothing
    /// is left.
    ///
    /// The map knows a moved voxel by its place, no longer by the frames that saw it: earlier frames that
    /// read it cannot be [removed](Self::remove) any more ([`NotInserted`](crate::Error::NotInserted)), nor can
    /// those that looked through its new place.
    /// Voxels that would leave the lattice are dropped. O(voxels of the region's blocks).
    pub fn move_body(
        &mut self,
        region: &OrientedBox,
        new_from_old: &Pose,
        is_body: impl Fn([f64; 3]) -> bool,
    ) -> BodyMotion {
        let mut motion = BodyMotion::default();
        let moved = self.take_body(region, new_from_old, is_body, &mut motion.from);
        self.forget_support(region, &moved);
        // A cell of the evidence holds many voxels, and is as certain as the best of them.
        let mut by_block: BTreeMap<_, BTreeMap<usize, u32>> = BTreeMap::new();
        for body in moved {
            motion.to.push(body.to.map(|c| c as f32));
            if let Some(voxel) = self.put_voxel(&body) {
                let (block, index) = self.evidence.cell_of(voxel);
                let support = by_block.entry(block).or_default().entry(index).or_default();
                *support = body.support.max(*support).max(1);
            }
        }
        for (block, cells) in by_block {
            self.evidence.give_support(block, &cells);
        }
        motion
    }

    /// Mean positions of the voxels in a box that enough frames have read and that their own cell of the
    /// evidence takes for static: much like the [static](crate::Selection::Static) cloud there, but without
    /// the neighbours' votes and without thinning, and at the cost of the box alone. In the order of
    /// [`Self::voxels`]. O(voxels of the box's blocks).
    pub fn static_points_in(&self, region: &OrientedBox) -> Vec<Point> {
        let least = self.config.min_observations;
        let mut points = Vec::new();
        for key in self.blocks_about(region) {
            let Some(block) = self.voxels.get(key) else { continue };
            for (place, voxel) in block.iter() {
                let cell = key.cell(place);
                let point = voxel.mean_position(cell, self.config.voxel_size);
                if voxel.observations >= least
                    && region.contains(point.map(f64::from))
                    && !self.evidence.is_outvoted(cell, self.config.looks_per_reading as f32)
                {
                    points.push(point);
                }
            }
        }
        points
    }

    fn take_body(
        &mut self,
        region: &OrientedBox,
        new_from_old: &Pose,
        is_body: impl Fn([f64; 3]) -> bool,
        from: &mut Vec<Point>,
    ) -> Vec<Moved> {
        let mut moved = Vec::new();
        let (stamp, seen) = (self.next_stamp(), self.kept.stamp());
        for key in self.blocks_about(region) {
            let Some((slot, block)) = self.voxels.slot(key).zip(self.voxels.get(key)) else { continue };
            let inside: Vec<(usize, Point)> = block
                .iter()
                .map(|(place, voxel)| (place, voxel.mean_position(key.cell(place), self.config.voxel_size)))
                .filter(|(_, point)| {
                    let place = point.map(f64::from);
                    region.contains(place) && is_body(place)
                })
                .collect();
            if inside.is_empty() {
                continue;
            }
            let Some(block) = self.voxels.begin_change(slot, stamp, seen) else { continue };
            block.lowered = stamp;
            for (place, point) in inside {
                let voxel = block.take(place);
                let cell = key.cell(place);
                let support = self.evidence.of_voxel(cell).support;
                from.push(point);
                let to = new_from_old.transform_point(point.map(f64::from));
                moved.push(Moved { cell, to, voxel, support });
            }
            self.voxel_count -= block.drop_empty();
        }
        moved
    }

    /// Removes the surface readings of cells of the evidence in which no voxel is left.
    fn forget_support(&mut self, region: &OrientedBox, moved: &[Moved]) {
        let around = region.with_rim(2.0 * self.evidence.cell_size());
        let mut left = BTreeSet::new();
        for key in self.blocks_about(&around.unwrap_or(*region)) {
            if let Some(block) = self.voxels.get(key) {
                left.extend(block.iter().map(|(place, _)| self.evidence.cell_of(key.cell(place))));
            }
        }
        let moved: BTreeSet<_> = moved.iter().map(|moved| self.evidence.cell_of(moved.cell)).collect();
        let gone: Vec<_> = moved.difference(&left).copied().collect();
        for of_block in gone.chunk_by(|a, b| a.0 == b.0) {
            self.evidence.clear_support(of_block[0].0, of_block.iter().map(|&(_, index)| index));
        }
    }

    /// Puts a voxel where it has moved; returns its new place.
    fn put_voxel(&mut self, &Moved { to, ref voxel, .. }: &Moved) -> Option<[i32; 3]> {
        let side = self.config.voxel_size / f64::from(SUBVOXELS);
        let limit = f64::from(BlockKey::LIMIT.min(i32::MAX / SUBVOXELS));
        if !to.iter().all(|c| (c / self.config.voxel_size).abs() < limit - 1.0) {
            return None;
        }
        let units = to.map(|c| (c / side).floor() as i64);
        let cell = units.map(|c| c.div_euclid(i64::from(SUBVOXELS)) as i32);
        let within = units.map(|c| c.rem_euclid(i64::from(SUBVOXELS)) as u64);
        let (block, place) = split(cell);
        let slot = self.voxels.slot_or_insert(BlockKey::new(block));
        let (stamp, seen) = (self.next_stamp(), self.kept.stamp());
        if let Some(block) = self.voxels.begin_change(slot, stamp, seen) {
            self.voxel_count += usize::from(block.make(place));
            block.merge(place, &voxel.placed(within));
        }
        Some(cell)
    }

    /// Keys of the blocks whose voxels may lie in a box, in their order. O(blocks that fit in the box, or all
    /// blocks if these are fewer).
    fn blocks_about(&self, region: &OrientedBox) -> Vec<BlockKey> {
        let side = self.config.voxel_size * BLOCK_SIDE as f64;
        let [low, high] = bounds(region.corners()).map(|corner| corner.map(|c| (c / side).floor()));
        let all = self.voxels.keys();
        let count: f64 = (0..3).map(|axis| high[axis] - low[axis] + 1.0).product();
        if count > all.len() as f64 {
            let is_about = |key: &BlockKey| {
                let block = key.block();
                (0..3).all(|axis| (low[axis]..=high[axis]).contains(&f64::from(block[axis])))
            };
            let mut keys: Vec<BlockKey> = all.iter().copied().filter(is_about).collect();
            keys.sort_unstable();
            return keys;
        }
        // In the order of keys, x is the fastest.
        let [xs, ys, zs] = [0, 1, 2].map(|axis| {
            let span = low[axis] as i32..=high[axis] as i32;
            span.filter(|c| BlockKey::has_block(*c))
        });
        let rows = zs.flat_map(|z| ys.clone().map(move |y| (y, z)));
        let blocks = rows.flat_map(|(y, z)| xs.clone().map(move |x| BlockKey::new([x, y, z])));
        blocks.filter(|key| self.voxels.slot(*key).is_some()).collect()
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::{DepthImage, Frame, PinholeCamera, SensorModel};

    use super::*;
    use crate::CloudMapConfig;

    #[test]
    fn the_blocks_about_a_box_are_those_that_a_look_at_all_finds() {
        let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
        let camera = PinholeCamera::new(48, 36, 40.0, 40.0, 23.5, 17.5).unwrap();
        let depth = (0..48 * 36).map(|pixel| 1.0 + 0.01 * (pixel % 200) as f32).collect();
        let frame = Frame::new(0.0, camera, DepthImage::new(48, 36, depth).unwrap(), None).unwrap();
        map.insert(&frame, None, &Pose::identity()).unwrap();
        let side = map.config.voxel_size * BLOCK_SIDE as f64;
        for center in [[0.0, 0.0, 1.0], [-0.3, 0.2, 1.5], [1e5, 0.0, 0.0], [-1e9, 0.0, 1.0]] {
            for length in [0.0, 0.05, 0.3, 1.0, 50.0, 1e9] {
                let pose = Pose::new(center, [0.0, 0.6, 0.0, 0.8]).unwrap();
                let region = OrientedBox::new(pose, [length, 0.5 * length, length]).unwrap();
                let [low, high] = bounds(region.corners());
                let is_about = |key: &BlockKey| {
                    let block = key.block().map(f64::from);
                    (0..3).all(|axis| {
                        ((low[axis] / side).floor()..=(high[axis] / side).floor()).contains(&block[axis])
                    })
                };
                let mut all: Vec<BlockKey> = map.voxels.keys().iter().copied().filter(is_about).collect();
                all.sort_unstable();
                assert_eq!(map.blocks_about(&region), all, "{length} m about {center:?}");
            }
        }
    }
}
