use std::num::NonZero;

use dymlm_core::{ConfigError, Point, check_range};
use kiddo::{ImmutableKdTree, SquaredEuclidean};

use crate::nearest::Neighbors;

/// What a cloud or an occupancy map is scored against: where static surface is, where movers have been, and
/// which of the surface could be seen. All in the frame of the map, metres.
///
/// `dymlm_sim::Truth` knows it exactly. Whoever has scans of the empty room has [`PointTruth`].
pub trait SpaceTruth {
    /// Distance of a point to the nearest static surface, from outside or from within a body, metres;
    /// infinite for a point that is not finite.
    fn surface_distance(&self, point: Point) -> f32;

    /// Whether a point lies in the volume that movers filled at the times of the frames.
    fn swept_by_movers(&self, point: Point) -> bool;

    /// Points of the static surface that a map of these frames is asked for, evenly spread.
    fn visible_points(&self) -> Vec<Point>;
}

/// Truth from measured points: a scan of the static world, and the readings of movers.
///
/// Surface is as dense as the points: those of a scan should be no further apart than 2 cm, a third of the 6
/// cm at which a point of a map counts as off all surface.
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
    /// No tree of no points.
    tree: Option<ImmutableKdTree<f32, 3>>,
    movers: Neighbors,
}

impl PointTruth {
    /// The static `surface`, and what movers filled: everything within `margin` metres, 0..=10, of their
    /// readings. Points that are not finite are passed over.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] when the margin is outside its range.
    pub fn new(mut surface: Vec<Point>, movers: &[Point], margin: f64) -> Result<Self, ConfigError> {
        check_range("margin", margin, 0.0..=10.0)?;
        let is_finite = |point: &Point| point.iter().all(|c| c.is_finite());
        surface.retain(is_finite);
        let movers: Vec<Point> = movers.iter().copied().filter(is_finite).collect();
        let tree = if surface.is_empty() { None } else { ImmutableKdTree::new_from_slice(&surface).ok() };
        Ok(Self { surface, tree, movers: Neighbors::of(&movers, margin as f32) })
    }
}

impl SpaceTruth for PointTruth {
    fn surface_distance(&self, point: Point) -> f32 {
        let Some(tree) = self.tree.as_ref().filter(|_| point.iter().all(|c| c.is_finite())) else {
            return f32::INFINITY;
        };
        let nearest = tree.query(&point).nearest_n::<SquaredEuclidean<f32>>(NonZero::<usize>::MIN).execute();
        nearest.first().map_or(f32::INFINITY, |found| found.distance.sqrt())
    }

    fn swept_by_movers(&self, point: Point) -> bool {
        point.iter().all(|c| c.is_finite()) && self.movers.reach(point)
    }

    fn visible_points(&self) -> Vec<Point> {
        self.surface.clone()
    }
}
