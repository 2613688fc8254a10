use dymlm_core::{ConfigError, Point, check_range};
use dymlm_geometry::PointTree;

use crate::nearest::is_finite;

/// The truth for a cloud or an occupancy map: where static surface is, where movers have been, and which
/// surface could be seen. All in the frame of the map, metres.
///
/// `dymlm_sim::Truth` knows it exactly. With scans of the empty room, use [`PointTruth`].
pub trait SpaceTruth {
    /// Distance of a point to the nearest static surface, from outside or from inside a body, metres;
    /// infinite for a point that is not finite.
    fn surface_distance(&self, point: Point) -> f32;

    /// Whether a point is in the volume that movers filled at the times of the frames.
    fn swept_by_movers(&self, point: Point) -> bool;

    /// Whether frames have looked through a point in the swept volume. Of a place that was only ever read
    /// while something stood there, no map can know that it became empty. The default is `true`: all is asked.
    fn was_looked_through(&self, _point: Point) -> bool {
        true
    }

    /// Whether a point is so near to a person that it would be lost to too large a mask or too much removal.
    /// The default is `false`.
    fn near_people(&self, _point: Point) -> bool {
        false
    }

    /// Whether a point is on something thin, which a map that smooths its surfaces may lose. The default is
    /// `false`.
    fn on_thin_things(&self, _point: Point) -> bool {
        false
    }

    /// Points of the static surface that a map of these frames should contain, evenly spread.
    fn visible_points(&self) -> Vec<Point>;
}

/// A truth made of measured points: a scan of the static world, and the readings of movers.
///
/// The points stand for the surface: those of a scan should be at most 2 cm apart, a third of the 6 cm beyond
/// which a point of a map is off all surfaces.
///
/// ```
/// use dymlm_core::PointCloud;
/// use dymlm_metrics::{PointTruth, score_cloud};
///
/// let wall: Vec<[f32; 3]> = (0..100).map(|i| [0.02 * i as f32, 0.0, 2.0]).collect();
/// let person = vec![[1.0, 0.0, 1.0]];
/// let truth = PointTruth::new(wall.clone(), &person, 0.1)?;
///
/// let mut map = wall;
/// map.extend([[1.0, 0.05, 1.0], [0.0, 0.0, 1.0]]);
/// let score = score_cloud(&PointCloud::new(map), &truth).ok_or("an empty map")?;
/// assert_eq!((score.residue, score.stray), (1.0 / 102.0, 1.0 / 102.0));
/// assert_eq!(score.completeness, 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct PointTruth {
    surface: Vec<Point>,
    nearest: PointTree,
    movers: PointTree,
    margin: f32,
}

impl PointTruth {
    /// A truth with the static `surface`, and a volume of movers within `margin` metres, 0..=10, of their
    /// readings. Points that are not finite are ignored.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] when the margin is outside its range.
    pub fn new(mut surface: Vec<Point>, movers: &[Point], margin: f64) -> Result<Self, ConfigError> {
        check_range("margin", margin, 0.0..=10.0)?;
        surface.retain(is_finite);
        let (nearest, movers) = (PointTree::new(&surface), PointTree::new(movers));
        Ok(Self { surface, nearest, movers, margin: margin as f32 })
    }
}

impl SpaceTruth for PointTruth {
    fn surface_distance(&self, point: Point) -> f32 {
        self.nearest.nearest(point).map_or(f32::INFINITY, |(_, distance)| distance)
    }

    fn swept_by_movers(&self, point: Point) -> bool {
        self.movers.nearest_within(point, self.margin).is_some()
    }

    fn visible_points(&self) -> Vec<Point> {
        self.surface.clone()
    }
}
