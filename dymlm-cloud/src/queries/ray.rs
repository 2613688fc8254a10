use dymlm_core::vector3::{along, bounds, crossing, difference, dot, unit};

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
        // Its own unit, so that no square of a length is too small or too large for a number.
        let longest = direction.iter().fold(0.0_f64, |longest, c| longest.max(c.abs()));
        let direction = unit(direction.map(|c| c / longest))?;
        let are_numbers = origin.iter().all(|c| c.is_finite()) && radius.is_finite() && !max_range.is_nan();
        if !are_numbers || radius < 0.0 {
            return None;
        }
        // The ray need not be followed outside of the map's box.
        let [first, last] = self.cloud.bounds()?.map(|block| BlockKey::new(block).bounds(self.voxel_size()));
        let margin = radius + self.slack();
        let grown = [first[0].map(|c| c - margin), last[1].map(|c| c + margin)];
        let [from, end] = crossing(origin, direction, grown)?;
        // However far beside the ray they may lie, no points are before the box or behind it.
        let (mut nearest, mut farthest) = (0.0, 0.0);
        for axis in 0..3 {
            let [a, b] = [first[0][axis] - self.slack(), last[1][axis] + self.slack()]
                .map(|c| (c - origin[axis]) * direction[axis]);
            nearest += a.min(b);
            farthest += a.max(b);
        }
        let (mut from, end) = (from.max(nearest), end.min(farthest).min(max_range));
        // In parts as long as a block, or as a wider ray is wide.
        while from <= end {
            let to = from + self.block_side().max(radius);
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
