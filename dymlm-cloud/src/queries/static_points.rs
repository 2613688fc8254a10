use std::sync::Arc;

use dymlm_core::{Point, Rgb};

use crate::block_store::BlockKey;
use crate::static_cloud::StaticCloud;
use crate::{CloudBlock, CloudMap};

/// The static cloud, for queries about places ([`CloudMap::static_points`]).
///
/// Its points are those of [`Selection::Static`](crate::Selection::Static): no ghosts, no noise. They are
/// found by the map's blocks of 8^3 voxels, 8 cm at the default voxel size, so that a query costs what is
/// near, whatever the size of the map. Lengths in metres, places in the world. Nothing is near a place that
/// is not finite.
#[derive(Debug, Clone)]
pub struct StaticPoints<'a> {
    pub(super) map: &'a CloudMap,
    pub(super) cloud: Arc<StaticCloud>,
}

/// A point of the static cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct StaticPoint {
    /// Weighted mean of its voxel's readings, on their surface where they are
    /// [fused](crate::CloudMapConfig::fuse_surfaces); metres, world.
    pub position: Point,
    /// Its colour, if the map has colours there.
    pub color: Option<Rgb>,
}

impl CloudMap {
    /// The static cloud as it is now, for many queries. Making it costs what has changed since the last
    /// query, and a short look at each block. Threads may each have their own.
    ///
    /// ```
    /// use dymlm_cloud::{CloudMap, CloudMapConfig};
    /// use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose, SensorModel};
    /// use dymlm_geometry::OrientedBox;
    ///
    /// // A wall, 2 m ahead, seen by frames 1 s apart.
    /// let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5)?;
    /// let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect())?;
    /// for time in 0..3 {
    ///     let depth = DepthImage::new(64, 48, vec![2.0; 64 * 48])?;
    ///     map.insert(&Frame::new(f64::from(time), camera, depth, None)?, None, &Pose::identity())?;
    /// }
    ///
    /// let points = map.static_points();
    /// let nearest = points.nearest([0.0, 0.0, 1.7], 0.5).ok_or("there is a wall")?;
    /// assert!((nearest.position[2] - 2.0).abs() < 1e-4);
    /// // The wall faces the camera.
    /// let normal = points.normal_at(nearest.position, 0.08).ok_or("there are points around")?;
    /// assert!(normal.is_oriented && normal.direction[2] < -0.99);
    ///
    /// let mut found = Vec::new();
    /// points.in_box(&OrientedBox::between([-0.2, -0.2, 1.9], [0.2, 0.2, 2.1])?, &mut found);
    /// assert!(found.len() > 50 && points.nearest([0.0, 0.0, 1.0], 0.5).is_none());
    ///
    /// let hit = points.cast_ray([0.0; 3], [0.0, 0.0, 1.0], 5.0, 0.05).ok_or("it meets the wall")?;
    /// assert!((hit.distance - 2.0).abs() < 1e-3);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn static_points(&self) -> StaticPoints<'_> {
        StaticPoints { map: self, cloud: self.kept_cloud() }
    }
}

impl StaticPoints<'_> {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.cloud.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether any point has a colour.
    pub fn has_colors(&self) -> bool {
        self.cloud.has_colors()
    }

    /// Calls `visit` with all points, in the order of [`CloudMap::point_cloud`], those of some cube of 8^3
    /// voxels at a time, and with the colours of the first of them, as many as have one. Nothing is copied, and of a
    /// paged map one such cube is in memory at a time.
    ///
    /// # Errors
    ///
    /// The first one of `visit`, which ends the calls.
    ///
    /// ```
    /// use std::convert::Infallible;
    ///
    /// use dymlm_cloud::{CloudMap, CloudMapConfig};
    /// use dymlm_core::SensorModel;
    ///
    /// let map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect())?;
    /// let (points, mut highest) = (map.static_points(), f32::NEG_INFINITY);
    /// points.try_for_each_block(|points, _colors| {
    ///     highest = points.iter().map(|point| point[2]).fold(highest, f32::max);
    ///     Ok::<(), Infallible>(())
    /// })?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn try_for_each_block<E>(
        &self,
        visit: impl FnMut(&[Point], &[Rgb]) -> Result<(), E>,
    ) -> Result<(), E> {
        self.cloud.try_for_each_block(&self.map.voxels, visit)
    }

    /// The static points of a cube of 8^3 voxels, by its [place](CloudBlock::place); none where the map has
    /// none.
    pub fn block(&self, place: [i32; 3]) -> CloudBlock {
        let has_key = place.iter().all(|c| BlockKey::has_block(*c));
        let slot = if has_key { self.map.voxels.slot(BlockKey::new(place)) } else { None };
        let (points, colors) = slot.map(|slot| self.cloud.copied(slot)).unwrap_or_default();
        CloudBlock { place, points, colors }
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use dymlm_core::{ColorImage, DepthImage, Frame, PinholeCamera, Pose, SensorModel};

    use super::*;
    use crate::{CloudMapConfig, Selection};

    /// Two walls, of which the first is seen in colour where `colored` says so.
    fn map(colored: [bool; 2]) -> CloudMap {
        let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5).unwrap();
        let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
        for time in 0..6 {
            let wall = time % 2;
            let depth = DepthImage::new(64, 48, vec![2.0; 64 * 48]).unwrap();
            let color = ColorImage::new(64, 48, vec![[9, 90, wall as u8]; 64 * 48]).unwrap();
            let frame = Frame::new(time as f64, camera, depth, colored[wall].then_some(color)).unwrap();
            let pose = Pose::new([0.0, 0.0, 5.0 * wall as f64], [0.0, 0.0, 0.0, 1.0]).unwrap();
            map.insert(&frame, None, &pose).unwrap();
        }
        map
    }

    #[test]
    fn block_by_block_the_points_are_those_of_the_point_cloud() {
        for colored in [[false; 2], [true, false], [false, true], [true; 2]] {
            let map = map(colored);
            let (points, whole) = (map.static_points(), map.point_cloud(Selection::Static));
            let (mut own, mut colors) = (Vec::new(), Vec::new());
            let Ok(()) = points.try_for_each_block(|some, some_colors| {
                own.extend_from_slice(some);
                colors.extend_from_slice(some_colors);
                colors.resize(own.len(), Rgb::default());
                Ok::<(), Infallible>(())
            });
            assert_eq!((own.as_slice(), points.len()), (whole.points(), whole.len()));
            assert_eq!(points.has_colors(), colored.contains(&true));
            assert_eq!(points.has_colors().then_some(colors.as_slice()), whole.colors());
            assert!(points.len() > 2000 && !points.is_empty());
        }
        let mut visits = 0;
        let error = map([true; 2]).static_points().try_for_each_block(|_, _| {
            visits += 1;
            Err("enough")
        });
        assert_eq!((error, visits), (Err("enough"), 1));
    }
}
