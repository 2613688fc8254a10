use dymlm_core::Point;
use dymlm_geometry::PointTree;

/// Distance within which a map's content matches the truth, metres: the tolerance of the `DynamicMap`
/// benchmark, and the distance at which planes are associated.
pub(crate) const MATCHED: f32 = 0.05;
/// The same for the surface of thin things, which is close to other surfaces.
pub(crate) const MATCHED_THIN: f32 = 0.02;
/// Distance beyond which a point of a map is off all surfaces, metres: three standard deviations of a
/// Kinect's noise at 3.5 m.
pub(crate) const OFF_SURFACE: f32 = 0.06;

/// Side of the cells in which surface is counted, metres: areas of planes, readings of a label. Smaller cells
/// are more exact and take more memory; at this side, shares are off by less than 2 %.
pub(crate) const CELL: f64 = 0.02;

pub(crate) fn is_finite(point: &Point) -> bool {
    point.iter().all(|c| c.is_finite())
}

/// Share of the `asked` points that have one of `points` within `reach` metres; `None` when `asked` is empty.
pub(crate) fn share_within(asked: &[Point], points: &[Point], reach: f32) -> Option<f64> {
    let tree = PointTree::new(points);
    let covered = asked.iter().filter(|&&point| tree.nearest_within(point, reach).is_some()).count();
    crate::share::share(covered as u64, asked.len() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_what_is_within_reach() {
        let points = [[0.0; 3], [1.0, 0.0, 0.0]];
        assert_eq!(
            share_within(&[[0.25, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.125, 0.0]], &points, 0.25),
            Some(2.0 / 3.0)
        );
        assert_eq!(share_within(&[[0.0; 3]], &[], 1.0), Some(0.0));
        assert_eq!(share_within(&[], &points, 1.0), None);
    }

    #[test]
    fn points_on_one_plane_and_all_alike_are_no_trouble() {
        let plane: Vec<Point> =
            (0..5000).map(|i| [(i % 70) as f32 * 0.02, (i / 70) as f32 * 0.02, 1.0]).collect();
        assert_eq!(share_within(&plane, &plane, 0.0), Some(1.0));
        assert_eq!(share_within(&[[0.0; 3], [2.0; 3]], &[[2.0; 3]; 1000], 0.1), Some(0.5));
    }
}
