use dymlm_core::PlaneId;
use dymlm_core::vector3::{along, difference, norm, unit};
use dymlm_octree::{CellState, RayEnd, UnknownCells};
use dymlm_planes::LevelUnder;

use crate::MultiLevelMap;

/// Thickness of a surface with the noise of its readings, in cells of the octree. A lower value takes the
/// readings of a floor for obstacles before it or for holes in it
/// (`the_floor_goes_on_to_the_feet_of_the_camera`); a higher one overlooks steps and posts of that height
/// (`a_landing_does_not_go_on_where_one_looks_past_its_edge`).
const SURFACE_CELLS: f64 = 2.0;

/// What something at a point stands on, or would fall onto.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct FloorUnder {
    /// The plane of the map.
    pub plane: PlaneId,
    /// Point of the plane straight under the point asked for, metres, world.
    pub point: [f64; 3],
    /// Distance from the point asked for to `point`, metres.
    pub distance: f64,
    /// Distance from `point` to where the plane was read, metres: 0 where it was read at `point` itself. Else
    /// the plane is extended by this length, and `point` is as uncertain as the plane's tilt times it.
    pub extended_by: f64,
}

impl MultiLevelMap {
    /// A unit vector that points up in the world, once it is known: given in the config of the objects, or
    /// learnt from what things rest on.
    pub fn up(&self) -> Option<[f64; 3]> {
        self.objects.vertical()
    }

    /// The first level surface under a point, a floor or a table, at most `max_distance` metres away against
    /// `up`. A point less than a cell of the octree below a surface is on it: that of a robot's feet is as often
    /// below the floor's plane as above it.
    ///
    /// A plane that was read straight under the point is the answer. A camera that looks ahead does not see
    /// the floor at its feet, though: without such a plane, one that was read within `reach` metres of there
    /// is extended, by no more than its own size (the root of its area), unless the octree speaks against it:
    /// something lies between (cells are occupied on the way straight down, or on the way to where the plane
    /// was read), or the plane ends (cells below it are free on the way from there). Of several planes the
    /// first met counts.
    ///
    /// `None` where no plane is known, for an `up` without length, for a point that is not finite and for lengths
    /// that are negative or NaN.
    /// O(planes near, their voxels within reach, and cells on the ways): some 10 us, and 100 us where much of
    /// a floor is within reach but not near.
    ///
    /// ```
    /// use dymlm::{MapBuilder, MapConfig};
    /// use dymlm::core::{DepthImage, Frame, PinholeCamera, Pose};
    ///
    /// // A camera 1 m above a floor looks ahead along y; its image begins 1.7 m before it.
    /// let camera = PinholeCamera::new(160, 120, 100.0, 100.0, 79.5, 59.5)?;
    /// let row = |v: usize| if v > 84 { 100.0 / (v as f32 - 59.5) } else { 0.0 };
    /// let depth = DepthImage::new(160, 120, (0..160 * 120).map(|i| row(i / 160)).collect())?;
    /// let rows = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]];
    /// let eye = Pose::from_rotation_matrix(rows, [0.0, 0.0, 1.0])?;
    /// let mut builder = MapBuilder::new(MapConfig::offline())?;
    /// for time in 0..4 {
    ///     builder.insert(&Frame::new(f64::from(time), camera, depth.clone(), None)?, &[], &eye)?;
    /// }
    ///
    /// let (map, up) = (builder.map(), [0.0, 0.0, 1.0]);
    /// let floor = map.floor_under([0.0, 0.0, 1.0], up, 2.0, 3.0).ok_or("it goes on")?;
    /// assert!((floor.distance - 1.0).abs() < 0.02 && (1.5..2.0).contains(&floor.extended_by));
    /// let ahead = map.floor_under([0.0, 2.5, 1.0], up, 2.0, 0.0).ok_or("it was read")?;
    /// assert_eq!(ahead.extended_by, 0.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn floor_under(
        &self,
        point: [f64; 3],
        up: [f64; 3],
        max_distance: f64,
        reach: f64,
    ) -> Option<FloorUnder> {
        let up = unit(up).filter(|_| max_distance >= 0.0)?;
        let lift = self.octree.resolution();
        let levels = self.planes.levels_under(along(point, lift, up), up, max_distance + lift, reach);
        let read = levels.iter().find(|level| level.extended_by == 0.0);
        let goes_on = |level: &&LevelUnder| self.is_clear_to(point, level) && self.does_not_end(level, up);
        let level = read.or_else(|| levels.iter().find(goes_on))?;
        let LevelUnder { plane, point, distance, extended_by, .. } = *level;
        Some(FloorUnder { plane, point, distance: (distance - lift).max(0.0), extended_by })
    }

    /// Whether nothing is known to lie between a point and a plane: straight down, and on the way to where
    /// the plane was read.
    fn is_clear_to(&self, point: [f64; 3], level: &LevelUnder) -> bool {
        let mut accessor = self.octree.accessor();
        let thickness = SURFACE_CELLS * self.octree.resolution();
        [level.point, level.nearest_inlier].into_iter().all(|end| {
            let way = difference(end, point);
            let length = norm(way) - thickness;
            let hit = (length > 0.0).then(|| accessor.cast_ray(point, way, length, UnknownCells::Pass));
            hit.flatten().is_none_or(|hit| hit.end != RayEnd::Occupied)
        })
    }

    /// Whether no space is known to be free below a plane, from where it was read to the place straight under
    /// the point asked for.
    fn does_not_end(&self, level: &LevelUnder, up: [f64; 3]) -> bool {
        let mut accessor = self.octree.accessor();
        let resolution = self.octree.resolution();
        let way = difference(level.point, level.nearest_inlier);
        let steps = (norm(way) / resolution).ceil() as u32;
        (0..=steps).all(|step| {
            let place = along(level.nearest_inlier, f64::from(step) / f64::from(steps.max(1)), way);
            accessor.state(along(place, -SURFACE_CELLS * resolution, up)) != CellState::Free
        })
    }
}
