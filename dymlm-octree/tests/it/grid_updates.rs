//! Grids of regions, grids brought up to date, grids with heights for each cell, inflated grids: each cell is
//! what a new projection of the whole map gives.

use crate::common::changes::{apply, changes};
use crate::common::{Random, config, double};
use dymlm_octree::{CellState, Error, GridRegion, OccupancyGrid, Octree};
use proptest::prelude::*;

const RESOLUTION: f64 = 0.25;

/// Directions; columns along the first three run along borders of cells, or through their edges.
fn any_up() -> impl Strategy<Value = [f64; 3]> {
    prop_oneof![
        Just([0.0, 0.0, 1.0]),
        Just([0.0, -1.0, 0.0]),
        Just([0.0, 1.0, 1.0]),
        [-1.0..1.0, -1.0..1.0, -1.0..1.0_f64]
            .prop_filter("a direction", |up| up.iter().any(|c| c.abs() > 0.1)),
    ]
}

fn scanned(map: &mut Octree, random: &mut Random, scale: f32) {
    let points: Vec<_> = (0..20).map(|_| random.point(scale)).collect();
    map.insert_scan(double(random.point(0.5 * scale)), &points).unwrap();
}

/// The whole projection at the place of a grid's cell.
fn at_same_place(whole: &OccupancyGrid, grid: &OccupancyGrid, x: usize, y: usize) -> CellState {
    whole.cell_of(grid.center(x, y)).map_or(CellState::Unknown, |[x, y]| whole.at(x, y))
}

fn assert_shows(grid: &OccupancyGrid, whole: &OccupancyGrid) {
    for y in 0..grid.height() {
        for x in 0..grid.width() {
            assert_eq!(grid.at(x, y), at_same_place(whole, grid, x, y), "({x}, {y})");
        }
    }
}

/// Both grids show the same wherever either has cells.
fn assert_equal(grid: &OccupancyGrid, whole: &OccupancyGrid) {
    assert_shows(grid, whole);
    assert_shows(whole, grid);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Scans, forgetting, single cells, merged maps: after each, the grids are updated by what it has
    /// changed.
    #[test]
    fn updated_grids_are_projected_ones(
        up in any_up(),
        seed in any::<u64>(),
        heights in prop_oneof![Just([f64::NEG_INFINITY, f64::INFINITY]), Just([-0.5, 0.75]), Just([0.1, 2.0])],
        steps in changes(),
        corner in [-2.0..1.0, -2.0..1.0_f64],
        size in [0.0..3.0, 0.0..3.0_f64],
    ) {
        let mut random = Random(seed);
        let mut map = Octree::new(config(RESOLUTION, 6.0)).unwrap();
        scanned(&mut map, &mut random, 1.0);
        let [min_height, max_height] = heights;
        let region = GridRegion { min: corner, max: [0, 1].map(|axis| corner[axis] + size[axis]) };
        let whole = |map: &Octree| map.project(up, min_height, max_height).unwrap();
        let part = |map: &Octree| map.project_region(up, min_height, max_height, &region).unwrap();
        let slope = |[x, y]: [f64; 2]| {
            let floor = 0.3 * x - 0.1 * y;
            (x + y > -2.0).then_some([floor + min_height, floor + max_height])
        };
        let sloped = |map: &Octree| map.project_between(up, &region, slope).unwrap();
        let (mut grid, mut of_region, mut on_slope) = (whole(&map), part(&map), sloped(&map));
        let before = of_region.cells().to_vec();
        for step in steps {
            let earlier = map.clone();
            apply(&mut map, &step);
            let changes = map.changes_since(&earlier);
            let updates = [
                grid.update(&map, &changes).unwrap(),
                of_region.update(&map, &changes).unwrap(),
                on_slope.update(&map, &changes).unwrap(),
            ];
            for update in updates {
                prop_assert!(update.changed <= update.projected);
                prop_assert_eq!(update.bounds.is_some(), update.changed > 0);
                prop_assert!(!changes.is_empty() || update.projected == 0);
            }
        }
        assert_equal(&grid, &whole(&map));
        assert_shows(&of_region, &grid);
        prop_assert_eq!(&of_region, &part(&map));
        // NaN heights differ from themselves: only the cells are compared.
        let anew = sloped(&map);
        prop_assert_eq!(on_slope.cells(), anew.cells());
        prop_assert_eq!(before.len(), of_region.cells().len());
    }

    /// Heights that change, in a region that grows.
    #[test]
    fn heights_may_change(up in any_up(), seed in any::<u64>(), tilts in [-0.5..0.5, -0.5..0.5_f64]) {
        let mut random = Random(seed);
        let mut map = Octree::new(config(RESOLUTION, 6.0)).unwrap();
        scanned(&mut map, &mut random, 1.0);
        let tilted = |tilt: f64| move |[x, _]: [f64; 2]| Some([tilt * x, tilt * x + 0.5]);
        let small = GridRegion { min: [-0.5, -0.5], max: [0.5, 1.0] };
        let large = GridRegion { min: [-1.5, -0.5], max: [0.5, 2.0] };
        let mut grid = map.project_between(up, &small, tilted(tilts[0])).unwrap();
        let earlier = map.clone();
        scanned(&mut map, &mut random, 1.0);
        let changes = map.changes_since(&earlier);
        let update = grid.update_between(&map, &changes, Some(&large), tilted(tilts[1])).unwrap();
        prop_assert!(update.has_grown);
        prop_assert_eq!(&grid, &map.project_between(up, &large, tilted(tilts[1])).unwrap());
        let again = grid.update_between(&map, &[], None, tilted(tilts[1])).unwrap();
        prop_assert_eq!(again.projected, 0);
    }

    /// A grid of one pair of heights for all cells gets heights for each cell, which may be the same.
    #[test]
    fn a_grid_of_the_same_heights_may_grow_with_them(up in any_up(), seed in any::<u64>()) {
        let mut random = Random(seed);
        let mut map = Octree::new(config(RESOLUTION, 6.0)).unwrap();
        scanned(&mut map, &mut random, 1.0);
        let small = GridRegion { min: [-0.5, -0.5], max: [0.5, 1.0] };
        let large = GridRegion { min: [-1.5, -0.5], max: [0.5, 2.0] };
        let anew = map.project_region(up, 0.1, 1.8, &large).unwrap();
        let nowhere = GridRegion { min: [0.0; 2], max: [0.0; 2] };
        for grid in [
            map.project_region(up, 0.1, 1.8, &small),
            map.project_region(up, 0.1, 1.8, &nowhere),
            map.project_between(up, &small, |_| Some([0.1, 1.8])),
        ] {
            let mut grid = grid.unwrap();
            let update = grid.update_between(&map, &[], Some(&large), |_| Some([0.1, 1.8])).unwrap();
            prop_assert!(update.has_grown);
            prop_assert_eq!(grid.region(), anew.region());
            prop_assert_eq!(grid.cells(), anew.cells());
        }
    }

    /// Against every pair of cells.
    #[test]
    fn inflation_is_exact(seed in any::<u64>(), radius in 0.0..3.0_f64, whole_cells in any::<bool>()) {
        let mut random = Random(seed);
        let mut map = Octree::new(config(RESOLUTION, 6.0)).unwrap();
        scanned(&mut map, &mut random, 1.5);
        let radius = if whole_cells { (radius * 4.0).floor() * RESOLUTION } else { radius };
        let grid = map.project([0.0, 0.0, 1.0], -0.5, 0.5).unwrap();
        let inflated = grid.inflated(radius).unwrap();
        let cells = || (0..grid.height()).flat_map(|y| (0..grid.width()).map(move |x| (x, y)));
        let occupied: Vec<_> = cells().filter(|&(x, y)| grid.at(x, y) == CellState::Occupied).collect();
        for (x, y) in cells() {
            let is_near = occupied.iter().any(|&(other_x, other_y)| {
                let squared = (x.abs_diff(other_x).pow(2) + y.abs_diff(other_y).pow(2)) as f64;
                squared.sqrt() * RESOLUTION <= radius + 1e-9
            });
            let expected = if is_near { CellState::Occupied } else { grid.at(x, y) };
            prop_assert_eq!(inflated.at(x, y), expected);
        }
        prop_assert_eq!(inflated.region(), grid.region());
    }

    /// A region that is larger by the radius, inflated and cropped, is a part of the whole inflated grid; what is
    /// cropped can be updated like a grid of the region.
    #[test]
    fn a_cropped_grid_is_a_part_of_the_whole(
        up in any_up(), seed in any::<u64>(), radius in 0.0..1.0_f64, corner in [-2.0..1.0, -2.0..1.0_f64],
        size in [0.0..2.0, 0.0..2.0_f64],
    ) {
        let mut random = Random(seed);
        let mut map = Octree::new(config(RESOLUTION, 6.0)).unwrap();
        scanned(&mut map, &mut random, 1.5);
        let region = |beside: f64| GridRegion {
            min: corner.map(|c| c - beside),
            max: [0, 1].map(|axis| corner[axis] + size[axis] + beside),
        };
        let whole = map.project_region(up, -0.5, 0.5, &region(8.0)).unwrap();
        let wide = map.project_region(up, -0.5, 0.5, &region(radius)).unwrap();
        let cropped = wide.inflated(radius).unwrap().cropped(&region(0.0)).unwrap();
        prop_assert_eq!(&cropped, &whole.inflated(radius).unwrap().cropped(&region(0.0)).unwrap());
        let inflated = whole.inflated(radius).unwrap();
        for y in 0..cropped.height() {
            for x in 0..cropped.width() {
                let [own_x, own_y] = inflated.cell_of(cropped.center(x, y)).unwrap();
                prop_assert_eq!(cropped.at(x, y), inflated.at(own_x, own_y));
            }
        }
        let small = map.project_region(up, -0.5, 0.5, &region(0.0)).unwrap();
        prop_assert_eq!(&whole.cropped(&region(0.0)).unwrap(), &small);
        // Beyond the grid nothing is known.
        let beyond = small.cropped(&region(1.0)).unwrap();
        prop_assert_eq!(&beyond.cropped(&region(0.0)).unwrap(), &small);
        prop_assert!(beyond.cells().len() > small.cells().len());
        prop_assert_eq!(beyond.at(0, 0), CellState::Unknown);
    }
}

/// The cost follows the change: only cells over the changed cubes are projected again.
#[test]
fn few_cells_are_projected_again() {
    let mut map = Octree::new(config(0.05, 30.0)).unwrap();
    let ring: Vec<[f32; 3]> = (0..3600)
        .map(|i| f64::from(i) * 0.1_f64.to_radians())
        .map(|angle| [(20.0 * angle.cos()) as f32, (20.0 * angle.sin()) as f32, 1.0])
        .collect();
    map.insert_scan([0.0, 0.0, 1.0], &ring).unwrap();
    let mut grid = map.project([0.0, 0.0, 1.0], 0.5, 1.5).unwrap();
    assert!(grid.cells().len() > 600_000);
    let earlier = map.clone();
    map.insert_scan([5.0, 5.0, 1.0], &[[6.0, 5.0, 1.0]]).unwrap();
    let update = grid.update(&map, &map.changes_since(&earlier)).unwrap();
    assert!((20..400).contains(&update.projected), "{update:?}");
    assert!((1..30).contains(&update.changed), "{update:?}");
    let [[x_first, x_last], [y_first, y_last]] = update.bounds.unwrap();
    let ends = [grid.center(x_first, y_first), grid.center(x_last, y_last)];
    assert!(ends.iter().all(|end| (4.9..6.2).contains(&end[0]) && (4.9..5.1).contains(&end[1])), "{ends:?}");
}

#[test]
fn refuses_what_is_no_region_radius_or_map() {
    let map = Octree::new(config(RESOLUTION, 6.0)).unwrap();
    let up = [0.0, 0.0, 1.0];
    for (min, max) in [
        ([0.0, 0.0], [1.0, -1.0]),
        ([f64::NAN, 0.0], [1.0, 1.0]),
        ([0.0, f64::NEG_INFINITY], [1.0, 1.0]),
        ([0.0, 0.0], [f64::INFINITY, 1.0]),
    ] {
        let region = GridRegion { min, max };
        assert!(
            matches!(map.project_region(up, 0.0, 1.0, &region), Err(Error::GridRegion { .. })),
            "{region:?}"
        );
        assert!(matches!(map.project_between(up, &region, |_| None), Err(Error::GridRegion { .. })));
        let mut grid = map.project(up, 0.0, 1.0).unwrap();
        let error = grid.update_between(&map, &[], Some(&region), |_| None).unwrap_err();
        assert!(error.to_string().contains("no grid from"), "{error}");
    }
    let mut grid = map.project_region(up, 0.0, 1.0, &GridRegion { min: [0.0; 2], max: [1.0; 2] }).unwrap();
    let before = grid.clone();
    let error = grid.update_between(&map, &[], Some(&GridRegion { min: [0.0; 2], max: [1e6; 2] }), |_| None);
    assert!(matches!(error, Err(Error::GridSize { .. })), "{error:?}");
    assert_eq!(grid, before);
    let huge = GridRegion { min: [0.0; 2], max: [1e6; 2] };
    assert!(matches!(map.project_region(up, 0.0, 1.0, &huge), Err(Error::GridSize { width: 4_000_000, .. })));
    let endless = GridRegion { min: [-1e300; 2], max: [1e300; 2] };
    assert!(matches!(map.project_region(up, 0.0, 1.0, &endless), Err(Error::GridSize { .. })));
    let empty = map.project_region(up, 0.0, 1.0, &GridRegion { min: [0.5; 2], max: [0.5; 2] }).unwrap();
    assert_eq!((empty.width(), empty.height(), empty.cells().len()), (0, 0, 0));
    assert!(empty.inflated(1.0).unwrap().cells().is_empty());

    let mut grid = map.project_region(up, 0.0, 1.0, &GridRegion { min: [0.0; 2], max: [1.0; 2] }).unwrap();
    assert_eq!((grid.width(), grid.height()), (4, 4));
    for radius in [-0.1, f64::NAN, f64::INFINITY] {
        assert!(matches!(grid.inflated(radius), Err(Error::Inflation { .. })), "{radius}");
    }
    for radius in [1e9, 1e160] {
        assert_eq!(grid.inflated(radius).unwrap().cells(), grid.cells());
    }
    let far = GridRegion { min: [-1e300, 0.0], max: [-((1_u64 << 63) as f64 - 2048.0) * 0.25, 0.25] };
    let cropped = grid.cropped(&far).unwrap();
    assert!(cropped.cells().iter().all(|&cell| cell == CellState::Unknown));
    let before = grid.clone();
    let fine = Octree::new(config(0.1, 6.0)).unwrap();
    let error = grid.update(&fine, &[]).unwrap_err();
    assert_eq!(error.to_string(), "a grid of 0.25 m cells cannot be updated by an octree of 0.1 m cells");
    assert_eq!(grid, before);
}

/// A new projection knows no margin: it would free the cells beside obstacles, without a word.
#[test]
fn an_inflated_grid_is_not_updated() {
    let mut map = Octree::new(config(RESOLUTION, 6.0)).unwrap();
    map.insert_scan([0.0; 3], &[[2.0, 0.1, 0.1]]).unwrap();
    let grid = map.project([0.0, 0.0, 1.0], -0.5, 0.5).unwrap();
    let earlier = map.clone();
    map.insert_scan([0.0; 3], &[[2.0, 0.6, 0.1]]).unwrap();
    let changes = map.changes_since(&earlier);
    let margin = grid.inflated(0.5).unwrap();
    // A further inflation by nothing does not make it updatable.
    for inflated in [margin.clone(), margin.inflated(0.0).unwrap()] {
        let mut updated = inflated.clone();
        let error = updated.update(&map, &changes).unwrap_err();
        assert!(matches!(error, Error::Inflated), "{error}");
        let error = updated.update_between(&map, &changes, None, |_| Some([-0.5, 0.5])).unwrap_err();
        assert!(error.to_string().contains("update the grid that was inflated"), "{error}");
        assert_eq!(updated, inflated);
    }
    // The grid itself follows the map, and so does one without a margin.
    for mut grid in [grid.inflated(0.0).unwrap(), grid] {
        assert!(grid.update(&map, &changes).unwrap().changed > 0);
        assert_equal(&grid, &map.project([0.0, 0.0, 1.0], -0.5, 0.5).unwrap());
    }
}

/// Lines of any direction at the border of the map, and heights beyond it.
#[test]
fn the_border_of_the_map_is_shown() {
    let mut map = Octree::new(config(1e-3, 6.0)).unwrap();
    let border = 32.7675;
    for place in [[0.0, 0.0, border], [0.0, 0.0, -border], [border, 0.0, 0.0]] {
        map.set_log_odds(place, Some(1.0));
    }
    let region = |x: f64, y: f64| GridRegion { min: [x - 1e-4, y - 1e-4], max: [x + 1e-4, y + 1e-4] };
    let shown = |up, heights: [f64; 2], x, y| {
        let grid = map.project_region(up, heights[0], heights[1], &region(x, y)).unwrap();
        grid.cells().contains(&CellState::Occupied)
    };
    let z = [0.0, 0.0, 1.0];
    assert!(shown(z, [1.0, f64::INFINITY], 0.0, 0.0) && shown(z, [f64::NEG_INFINITY, -1.0], 0.0, 0.0));
    assert!(shown(z, [1.0, 1e9], 0.0, 0.0) && !shown(z, [-1.0, 1.0], 0.0, 0.0));
    assert!(shown(z, [-1.0, 1.0], border, 0.0));
    assert!(!shown(z, [100.0, 200.0], 0.0, 0.0));
    assert!(shown([0.0, 0.0, -1.0], [1.0, f64::INFINITY], 0.0, 0.0));
}

/// Regression: the difference of the first indices overflowed.
#[test]
fn an_empty_grid_may_grow_anywhere() {
    let map = Octree::new(config(0.25, 6.0)).unwrap();
    let nowhere = GridRegion { min: [0.0; 2], max: [0.0; 2] };
    let far = GridRegion { min: [-1e300, 0.0], max: [-((1_u64 << 63) as f64 - 2048.0) * 0.25, 0.25] };
    let mut grid = map.project_region([0.0, 0.0, 1.0], 0.0, 1.0, &nowhere).unwrap();
    grid.update_between(&map, &[], Some(&far), |_| Some([0.0, 1.0])).unwrap();
    assert_eq!(grid.height(), 1);
}
