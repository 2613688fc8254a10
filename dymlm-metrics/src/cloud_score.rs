use dymlm_core::{Point, PointCloud};

use crate::nearest::{MATCHED, MATCHED_THIN, OFF_SURFACE, is_finite, share_within};
use crate::share::share;
use crate::{SpaceTruth, Spread};

/// Distances between a cloud and the truth. With d(p) the distance of a point p of the cloud to the nearest
/// static surface, and n the number of finite points:
///
/// - residue = #{p: d(p) > 6 cm, p in the volume swept by movers} / n,
/// - unseen residue = #{p of the residue: no frame looked through p} / n: nobody can know that it is gone,
/// - stray = #{p: d(p) > 6 cm, p outside that volume} / n,
/// - completeness = #{s: some p within 5 cm of s} / #{s} over the visible surface points s of the truth,
/// - completeness near people: the same over those points s that are near people according to the truth,
/// - completeness of thin things: the same over those points s that are on thin things according to the
///   truth, and within 2 cm,
/// - median and 95 % quantile of d over the n points (the smallest d that this share of the points does not
///   exceed).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct CloudScore {
    /// Share of the points further than 6 cm from every static surface and within the volume swept by movers,
    /// 0..=1.
    pub residue: f64,
    /// The part of the residue at places that no frames have looked through
    /// ([`SpaceTruth::was_looked_through`]), 0..=`residue`: no map can know that nothing is there.
    pub unseen_residue: f64,
    /// Share of the points further than 6 cm from every static surface and outside the volume swept by
    /// movers, 0..=1.
    pub stray: f64,
    /// Share of the visible surface points with a point of the cloud within 5 cm, 0..=1; 1 when there are no
    /// visible points.
    pub completeness: f64,
    /// The same share of the visible points near people ([`SpaceTruth::near_people`]), 0..=1; `None` when
    /// there are none.
    pub completeness_near_people: Option<f64>,
    /// Share of the visible points on thin things ([`SpaceTruth::on_thin_things`]) with a point of the cloud
    /// within 2 cm, 0..=1; `None` when there are none.
    pub completeness_of_thin_things: Option<f64>,
    /// Median distance of the points to the nearest static surface, metres.
    pub median_distance: f64,
    /// 95 % quantile of that distance, metres.
    pub p95_distance: f64,
    /// Number of points scored: only finite points.
    pub points: usize,
    /// Number of visible surface points compared.
    pub visible_points: usize,
}

/// Scores a cloud in the world frame against the truth; `None` when it has no finite point.
///
/// O(n log n) in the number of points; a million takes about a second.
pub fn score_cloud(cloud: &PointCloud, truth: &(impl SpaceTruth + ?Sized)) -> Option<CloudScore> {
    let points: Vec<Point> = cloud.points().iter().copied().filter(is_finite).collect();
    let distances: Vec<f32> = points.iter().map(|&point| truth.surface_distance(point)).collect();

    let off_surface = || points.iter().zip(&distances).filter(|&(_, &distance)| distance > OFF_SURFACE);
    let in_swept = || off_surface().filter(|&(&point, _)| truth.swept_by_movers(point));
    let residue = in_swept().count();
    let unseen = in_swept().filter(|&(&point, _)| !truth.was_looked_through(point)).count();
    let share = |count: usize| share(count as u64, points.len() as u64);
    let (residue, unseen_residue, stray) =
        (share(residue)?, share(unseen)?, share(off_surface().count() - residue)?);

    let visible = truth.visible_points();
    let those = |is_meant: &dyn Fn(Point) -> bool| -> Vec<Point> {
        visible.iter().copied().filter(|&point| is_meant(point)).collect()
    };
    let near_people = those(&|point| truth.near_people(point));
    let on_thin_things = those(&|point| truth.on_thin_things(point));
    let distance = Spread::of(distances.into_iter().map(f64::from).collect())?;
    Some(CloudScore {
        residue,
        unseen_residue,
        stray,
        completeness: share_within(&visible, &points, MATCHED).unwrap_or(1.0),
        completeness_near_people: share_within(&near_people, &points, MATCHED),
        completeness_of_thin_things: share_within(&on_thin_things, &points, MATCHED_THIN),
        median_distance: distance.median,
        p95_distance: distance.p95,
        points: points.len(),
        visible_points: visible.len(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A floor, above which everything was swept; only what is at x > 0 was looked through.
    struct Floor;

    impl SpaceTruth for Floor {
        fn surface_distance(&self, point: Point) -> f32 {
            point[2].abs()
        }

        fn swept_by_movers(&self, _: Point) -> bool {
            true
        }

        fn was_looked_through(&self, point: Point) -> bool {
            point[0] > 0.0
        }

        fn visible_points(&self) -> Vec<Point> {
            Vec::new()
        }
    }

    #[test]
    fn residue_that_nobody_looked_through_is_told_apart() {
        let cloud =
            PointCloud::new(vec![[1.0, 0.0, 1.0], [-1.0, 0.0, 1.0], [-1.0, 0.0, 2.0], [-1.0, 0.0, 0.0]]);
        let score = score_cloud(&cloud, &Floor).unwrap();
        assert_eq!((score.residue, score.unseen_residue, score.stray), (0.75, 0.5, 0.0));
    }
}
