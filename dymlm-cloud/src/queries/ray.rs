use dymlm_core::vector3::{along, bounds, difference, distances_to_box, dot, unit};

use super::{StaticPoint, StaticPoints};
use crate::block_store::BlockKey;

/// A static point that a ray meets.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PointHit {
    /// The point.
    pub point: StaticPoint,
    /// Distance along the ray to where it passes the point, metres.
    pub distance: f64,
}

impl StaticPoints<'_> {
    /// The first static point along a ray, within `max_range` metres and at most `radius` metres beside the
    /// ray; of points equally far the first of the cloud. `direction` may have any length. `None` also for a
    /// direction without length and for arguments that are not finite (`max_range` may be infinite).
    ///
    /// With a radius of less than a voxel and a half a ray may slip between the points of a surface. On a
    /// surface met at an angle the point comes up to radius / tan(angle) early. O(blocks along the ray, at
    /// most those of the map).
    pub fn cast_ray(
        &self,
        origin: [f64; 3],
        direction: [f64; 3],
        max_range: f64,
        radius: f64,
    ) -> Option<PointHit> {
        let direction = unit(direction)?;
        let are_numbers = origin.iter().all(|c| c.is_finite()) && radius.is_finite() && !max_range.is_nan();
        if !are_numbers || radius < 0.0 {
            return None;
        }
        // The ray need not be followed beyond the map's box.
        let bounds_of_map = self.cloud.bounds()?.map(|block| BlockKey::new(block).bounds(self.voxel_size()));
        let [nearest, farthest] = distances_to_box(origin, [bounds_of_map[0][0], bounds_of_map[1][1]]);
        let end = max_range.min(farthest + self.slack());
        // In parts as long as a block.
        let mut from = (nearest - radius - self.slack()).max(0.0);
        while from <= end {
            let to = from + self.block_side();
            if to <= from {
                // So far out that adding the side of a block changes nothing.
                return None;
            }
            let ends = bounds([from, to].map(|distance| along(origin, distance, direction)));
            let region = [ends[0].map(|c| c - radius), ends[1].map(|c| c + radius)];
            let mut first: Option<PointHit> = None;
            self.for_each_block(region, |slot, _| {
                for point in self.points_of(slot) {
                    let offset = difference(point.position.map(f64::from), origin);
                    let distance = dot(offset, direction);
                    let beside = difference(offset, direction.map(|c| c * distance));
                    let is_met = (from..=to.min(max_range)).contains(&distance)
                        && dot(beside, beside) <= radius * radius;
                    if is_met && first.is_none_or(|first| distance < first.distance) {
                        first = Some(PointHit { point, distance });
                    }
                }
            });
            if first.is_some() {
                return first;
            }
            from = to;
        }
        None
    }
}
