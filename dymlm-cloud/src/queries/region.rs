use dymlm_core::vector3::{bounds, boxes_touch, difference, dot};
use dymlm_geometry::OrientedBox;

use super::{StaticPoint, StaticPoints};
use crate::block_store::{BLOCK_SIDE, BlockKey};

/// Corners of a box, lowest and highest, metres.
pub(super) type Corners = [[f64; 3]; 2];

impl StaticPoints<'_> {
    /// The points in a box, in the order of the [cloud](crate::CloudMap::point_cloud); they replace what
    /// `found` holds. [`OrientedBox::between`] makes a box along the axes. O(blocks of the box around it, at
    /// most those of the map, + points in the blocks that it touches).
    pub fn in_box(&self, region: &OrientedBox, found: &mut Vec<StaticPoint>) {
        found.clear();
        // As a matrix the rotation is faster for many points.
        let (axes, center) = (region.world_from_box().inverse().rotation_matrix(), region.center());
        let half = region.lengths().map(|c| 0.5 * c);
        let beyond = |place: [f64; 3], rim: f64| {
            let offset = difference(place, center);
            (0..3).any(|axis| dot(axes[axis], offset).abs() > half[axis] + rim)
        };
        let block_radius = 0.5 * 3.0_f64.sqrt() * self.block_side();
        self.for_each_block(bounds(region.corners()), |slot, [low, high]| {
            // A block whose ball lies beyond one of the sides has no point in the box.
            let middle = [0, 1, 2].map(|axis| f64::midpoint(low[axis], high[axis]));
            if !beyond(middle, block_radius + self.slack()) {
                found
                    .extend(self.points_of(slot).filter(|point| !beyond(point.position.map(f64::from), 0.0)));
            }
        });
    }

    /// Calls `visit` for the slot and the corners of each block with static points that may reach into a box,
    /// in the order of the cloud.
    pub(super) fn for_each_block(&self, region: Corners, mut visit: impl FnMut(usize, Corners)) {
        let [low, high] = [self.block_at(region[0], -1.0), self.block_at(region[1], 1.0)];
        let side = |axis: usize| (i64::from(high[axis]) - i64::from(low[axis]) + 1).max(0) as u64;
        let count = side(0).saturating_mul(side(1)).saturating_mul(side(2));
        let (voxels, voxel_size) = (&self.map.voxels, self.voxel_size());
        if count > voxels.keys().len() as u64 {
            let grown = self.grown(region);
            for slot in self.cloud.order(voxels) {
                let corners = voxels.keys()[slot].bounds(voxel_size);
                if boxes_touch(corners, grown) && !self.cloud.points(slot).is_empty() {
                    visit(slot, corners);
                }
            }
            return;
        }
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let key = BlockKey::new([x, y, z]);
                    if let Some(slot) = self.slot_with_points(key) {
                        visit(slot, key.bounds(voxel_size));
                    }
                }
            }
        }
    }

    /// The slot of a block with static points.
    #[inline]
    pub(super) fn slot_with_points(&self, key: BlockKey) -> Option<usize> {
        self.map.voxels.slot(key).filter(|&slot| !self.cloud.points(slot).is_empty())
    }

    /// The points of a block, in order.
    #[inline]
    pub(super) fn points_of(&self, slot: usize) -> impl Iterator<Item = StaticPoint> {
        let colors = self.cloud.colors(slot);
        let points = self.cloud.points(slot).iter().enumerate();
        points.map(|(rank, &position)| StaticPoint { position, color: colors.get(rank).copied() })
    }

    /// Side of a voxel, metres.
    pub(super) fn voxel_size(&self) -> f64 {
        self.map.config.voxel_size
    }

    /// Side of a block, metres.
    pub(super) fn block_side(&self) -> f64 {
        BLOCK_SIDE as f64 * self.voxel_size()
    }

    /// How far a point may lie outside its block, metres, since coordinates of [`Point`](dymlm_core::Point)
    /// are rounded: by not quite a voxel at the map's border.
    pub(super) fn slack(&self) -> f64 {
        self.voxel_size()
    }

    /// A box, larger by the slack on each side.
    #[inline]
    pub(super) fn grown(&self, [low, high]: Corners) -> Corners {
        [low.map(|c| c - self.slack()), high.map(|c| c + self.slack())]
    }

    /// Block coordinates of a place that is moved outward by the slack; beyond the map's border, those of the
    /// nearest block.
    pub(super) fn block_at(&self, place: [f64; 3], outward: f64) -> [i32; 3] {
        let limit = f64::from(BlockKey::LIMIT) / BLOCK_SIDE as f64;
        place.map(|c| {
            let block = ((c + outward * self.slack()) / self.block_side()).floor();
            // The cast turns NaN into 0.
            block.clamp(-limit, limit - 1.0) as i32
        })
    }
}
