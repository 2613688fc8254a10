//! Searches by distance find what comparing all points finds.

use dymlm_core::Point;
use dymlm_geometry::PointTree;
use proptest::prelude::*;

fn squared_distance(a: Point, b: Point) -> f32 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    x * x + y * y + z * z
}

proptest! {
    /// Points on a small lattice: many are equal, on a line, in a plane, or as near as another.
    #[test]
    fn searches_find_what_one_by_one_finds(
        points in prop::collection::vec(prop::array::uniform3(-6..7_i8), 0..300),
        exponent in -40..40_i32,
        place in prop::array::uniform3(-9..9_i8),
        reach in 0..16_u8,
    ) {
        let scale = 2.0_f32.powi(exponent);
        // What is at the border of the lattice is not finite.
        let scaled = |x: i8| if x == 6 { f32::NAN } else { f32::from(x) * scale };
        let points: Vec<Point> = points.into_iter().map(|p| p.map(scaled)).collect();
        let place = place.map(|x| f32::from(x) * scale);
        let reach = f32::from(reach) * scale;
        let finite = || points.iter().enumerate().filter(|(_, p)| p.iter().all(|x| x.is_finite()));

        let tree = PointTree::new(&points);
        prop_assert_eq!(tree.len(), finite().count());
        let nearest = finite().map(|(_, &p)| squared_distance(place, p)).min_by(f32::total_cmp);
        let found = tree.nearest(place);
        prop_assert_eq!(found.map(|(_, distance)| distance), nearest.map(f32::sqrt));
        prop_assert_eq!(found.map(|(index, _)| squared_distance(place, points[index])), nearest);
        prop_assert_eq!(tree.nearest_within(place, reach), found.filter(|(_, distance)| *distance <= reach));

        let near = finite().filter(|&(_, &p)| squared_distance(place, p) <= reach * reach);
        let mut within: Vec<usize> = tree.within(place, reach).collect();
        within.sort_unstable();
        prop_assert_eq!(within, near.map(|(index, _)| index).collect::<Vec<_>>());
    }
}

#[test]
fn nothing_is_near_a_place_or_within_a_distance_that_is_none() {
    let tree = PointTree::new(&[[0.0; 3], [1.0, 0.0, f32::INFINITY]]);
    assert_eq!((tree.len(), tree.is_empty()), (1, false));
    for place in [[f32::NAN, 0.0, 0.0], [0.0, f32::INFINITY, 0.0], [f32::MAX; 3]] {
        assert_eq!(tree.nearest(place), None);
        assert_eq!(tree.within(place, 1.0).count(), 0);
    }
    for reach in [-1.0, f32::NAN] {
        assert_eq!(tree.nearest_within([0.0; 3], reach), None);
        assert_eq!(tree.within([0.0; 3], reach).count(), 0);
    }
    assert_eq!(tree.nearest_within([0.0; 3], 0.0), Some((0, 0.0)));
    for none in [PointTree::new(&[]), PointTree::new(&[[f32::NAN; 3]]), PointTree::default()] {
        assert!(none.is_empty());
        assert_eq!(none.nearest([0.0; 3]), None);
    }
}

#[test]
fn a_heap_of_equal_points_is_searched_as_one() {
    let tree = PointTree::new(&vec![[1.0; 3]; 100_000]);
    assert_eq!(tree.nearest([1.0, 1.0, 3.0]).map(|(_, distance)| distance), Some(2.0));
    assert_eq!(tree.within([1.0; 3], 0.0).count(), 100_000);
}
