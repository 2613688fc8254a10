use std::collections::HashSet;

use dymlm::core::{Point, Rgb};

/// The points and colours on the page, and their spacing.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ThinnedPoints {
    pub(super) points: Vec<Point>,
    pub(super) colors: Option<Vec<Rgb>>,
    /// Side of the voxels that contain at most one point each, metres.
    pub(super) spacing: f64,
}

/// Thins the points to at most `most`: the first point in each voxel of a grid is kept, and the voxel's side
/// is doubled from `spacing` until the points are few enough.
pub(super) fn thinned(points: &[Point], colors: Option<&[Rgb]>, spacing: f64, most: usize) -> ThinnedPoints {
    let mut kept: Vec<usize> = (0..points.len()).collect();
    let mut side = spacing;
    // By doubling, one voxel covers any map in the end, so one point is reached, but never zero.
    while kept.len() > most.max(1) && side < 1e6 {
        side *= 2.0;
        // The set only answers whether it holds a voxel: its order does not affect the result.
        let mut taken = HashSet::with_capacity(kept.len());
        kept.retain(|&index| taken.insert(points[index].map(|c| (f64::from(c) / side).floor() as i64)));
    }
    ThinnedPoints {
        points: kept.iter().map(|&index| points[index]).collect(),
        colors: colors.map(|colors| kept.iter().map(|&index| colors[index]).collect()),
        spacing: side,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(side: usize) -> Vec<Point> {
        (0..side * side).map(|i| [0.01 * (i % side) as f32, 0.01 * (i / side) as f32, 0.0]).collect()
    }

    #[test]
    fn few_points_are_all_kept() {
        let points = square(20);
        let colors = vec![[1, 2, 3]; 400];
        let all = thinned(&points, Some(&colors), 0.01, 400);
        assert_eq!((all.points, all.colors, all.spacing), (points, Some(colors), 0.01));
        assert_eq!(thinned(&[], None, 0.01, 0).points.len(), 0);
    }

    #[test]
    fn many_are_thinned_evenly() {
        let points = square(100);
        let colors: Vec<Rgb> = (0..10_000_usize).map(|i| [(i % 100) as u8, (i / 100) as u8, 0]).collect();
        let thin = thinned(&points, Some(&colors), 0.01, 3_000);
        assert_eq!(thin.spacing, 0.02);
        assert!((2_000..=3_000).contains(&thin.points.len()), "{}", thin.points.len());
        for (point, color) in thin.points.iter().zip(thin.colors.unwrap()) {
            assert_eq!([(point[0] * 100.0).round() as u8, (point[1] * 100.0).round() as u8], color[..2]);
        }
    }
}
