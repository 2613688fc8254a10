//! The distance field against brute force over all obstacles, under motions of the lattice, and for invalid
//! regions.

use dymlm_core::SplitMix64;
use dymlm_core::vector3::{along, difference, norm};
use dymlm_octree::{CellState, Error, Extent, Octree, OctreeConfig, UnknownCells};
use proptest::prelude::*;

const RESOLUTION: f64 = 0.1;

/// A map of cells at integer places, each occupied or free.
fn map_of(cells: impl IntoIterator<Item = ([i32; 3], bool)>) -> Octree {
    let mut config = OctreeConfig::default();
    config.resolution = RESOLUTION;
    let mut map = Octree::new(config).unwrap();
    for (cell, is_occupied) in cells {
        map.set_log_odds(center(cell), Some(if is_occupied { 2.0 } else { -1.0 }));
    }
    map
}

fn center(cell: [i32; 3]) -> [f64; 3] {
    cell.map(|c| (f64::from(c) + 0.5) * RESOLUTION)
}

/// Occupied and free cells within 14 cells of the origin; some free ones fill cubes that become one leaf.
fn random_cells(seed: u64) -> Vec<([i32; 3], bool)> {
    let mut random = SplitMix64::new(seed);
    let mut cells = Vec::new();
    for corner in [[-8, -8, -8], [0, -8, 0], [-8, 0, 0]] {
        let cube = (0..512).map(|i| [0, 1, 2].map(|axis| corner[axis] + (i >> (3 * axis) & 7)));
        cells.extend(cube.map(|cell| (cell, false)));
    }
    for _ in 0..300 {
        let cell = [(); 3].map(|()| (random.fraction() * 28.0) as i32 - 14);
        cells.push((cell, random.fraction() < 0.15));
    }
    cells
}

/// The distance by brute force over all cells around.
fn brute_force(map: &Octree, place: [f64; 3], max_distance: f64, unknown: UnknownCells) -> f64 {
    let reach = (max_distance / RESOLUTION).ceil() as i32 + 1;
    let own = place.map(|c| (c / RESOLUTION).floor() as i32);
    let mut nearest = max_distance;
    for z in -reach..=reach {
        for y in -reach..=reach {
            for x in -reach..=reach {
                let obstacle = center([own[0] + x, own[1] + y, own[2] + z]);
                let is_obstacle = match map.state(obstacle) {
                    CellState::Occupied => true,
                    CellState::Free => false,
                    CellState::Unknown => unknown == UnknownCells::Stop,
                };
                if is_obstacle {
                    nearest = nearest.min(norm(difference(obstacle, place)));
                }
            }
        }
    }
    nearest
}

fn random_in(region: &Extent, random: &mut SplitMix64) -> [f64; 3] {
    [0, 1, 2].map(|axis| region.min[axis] + random.fraction() * (region.max[axis] - region.min[axis]))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn distances_at_centres_are_exact_and_between_them_near(
        seed in 0..1000_u64,
        corner in prop::array::uniform3(-1.2..0.8_f64),
        size in prop::array::uniform3(0.0..1.0_f64),
        max_distance in 0.02..0.7_f64,
        stops in any::<bool>(),
    ) {
        let map = map_of(random_cells(seed));
        let unknown = if stops { UnknownCells::Stop } else { UnknownCells::Pass };
        let region = Extent { min: corner, max: [0, 1, 2].map(|axis| corner[axis] + size[axis]) };
        let field = map.distance_field(region, max_distance, unknown).unwrap();
        let mut random = SplitMix64::new(seed);
        for _ in 0..40 {
            let place = random_in(&region, &mut random);
            let found = field.at(place).unwrap();
            let exact = brute_force(&map, place, max_distance, unknown);
            prop_assert!((found.distance - exact).abs() < 0.87 * RESOLUTION + 1e-6);
            prop_assert!(norm(found.gradient) < 1.8);
            let cell = center(place.map(|c| (c / RESOLUTION).floor() as i32));
            if let Some(found) = field.at(cell) {
                let exact = brute_force(&map, cell, max_distance, unknown);
                prop_assert!((found.distance - exact).abs() < 1e-6, "{} {exact}", found.distance);
            }
        }
    }

    #[test]
    fn gradients_are_the_slopes_of_distances(seed in 0..1000_u64) {
        let map = map_of(random_cells(seed));
        let region = Extent { min: [-1.0; 3], max: [1.0; 3] };
        let field = map.distance_field(region, 0.5, UnknownCells::Pass).unwrap();
        let mut random = SplitMix64::new(seed);
        for _ in 0..60 {
            let place = random_in(&region, &mut random);
            let gradient = field.at(place).unwrap().gradient;
            for axis in 0..3 {
                let mut step = [0.0; 3];
                step[axis] = 1e-4;
                let sides = [1.0, -1.0].map(|side| field.at(along(place, side, step)));
                let [Some(ahead), Some(behind)] = sides else { continue };
                // At a centre the slope along an axis jumps: places near one are left out.
                let in_cell = (place[axis] / RESOLUTION - 0.5).rem_euclid(1.0);
                if (0.01..0.99).contains(&in_cell) {
                    let slope = (ahead.distance - behind.distance) / 2e-4;
                    prop_assert!((slope - gradient[axis]).abs() < 1e-3);
                }
            }
        }
    }

    #[test]
    fn the_field_moves_and_turns_with_the_lattice(
        seed in 0..1000_u64,
        shift in prop::array::uniform3(-300..300_i32),
        axes in Just([0, 1, 2]).prop_shuffle(),
        flips in prop::array::uniform3(any::<bool>()),
    ) {
        let turned = |cell: [i32; 3]| [0, 1, 2].map(|axis| {
            let c = cell[axes[axis]];
            shift[axis] + if flips[axis] { -1 - c } else { c }
        });
        let cells = random_cells(seed);
        let map = map_of(cells.iter().copied());
        let other = map_of(cells.into_iter().map(|(cell, is_occupied)| (turned(cell), is_occupied)));
        let region = Extent { min: [-1.0; 3], max: [1.0; 3] };
        let place_of = |place: [f64; 3]| [0, 1, 2].map(|axis| {
            let c = place[axes[axis]];
            f64::from(shift[axis]) * RESOLUTION + if flips[axis] { -c } else { c }
        });
        let corners = [place_of(region.min), place_of(region.max)];
        let moved = Extent {
            min: [0, 1, 2].map(|axis| corners[0][axis].min(corners[1][axis])),
            max: [0, 1, 2].map(|axis| corners[0][axis].max(corners[1][axis])),
        };
        let field = map.distance_field(region, 0.6, UnknownCells::Stop).unwrap();
        let others = other.distance_field(moved, 0.6, UnknownCells::Stop).unwrap();
        let mut random = SplitMix64::new(seed);
        for _ in 0..40 {
            let place = random_in(&Extent { min: [-0.99; 3], max: [0.99; 3] }, &mut random);
            let (one, two) = (field.at(place).unwrap(), others.at(place_of(place)).unwrap());
            prop_assert!((one.distance - two.distance).abs() < 1e-6);
        }
    }
}

#[test]
fn an_empty_map_is_free_or_full() {
    let map = map_of([]);
    let region = Extent { min: [-0.3; 3], max: [0.4; 3] };
    let free = map.distance_field(region, 0.5, UnknownCells::Pass).unwrap().at([0.1; 3]).unwrap();
    assert!((free.distance - 0.5).abs() < 1e-6 && free.gradient == [0.0; 3]);
    let full = map.distance_field(region, 0.5, UnknownCells::Stop).unwrap().at([0.1; 3]).unwrap();
    assert_eq!((full.distance, full.gradient), (0.0, [0.0; 3]));
}

#[test]
fn a_field_that_is_made_anew_is_the_same_and_a_refused_one_stays() {
    let map = map_of(random_cells(3));
    let [large, small] = [1.0, 0.4].map(|half| Extent { min: [-half; 3], max: [half; 3] });
    let mut field = map.distance_field(large, 0.5, UnknownCells::Stop).unwrap();
    field.update(&map, small, 0.3, UnknownCells::Pass).unwrap();
    let bytes = field.memory_bytes();
    let fresh = map.distance_field(small, 0.3, UnknownCells::Pass).unwrap();
    let mut random = SplitMix64::new(9);
    for _ in 0..100 {
        let place = random_in(&small, &mut random);
        assert_eq!(field.at(place), fresh.at(place));
    }
    field.update(&map, large, 0.5, UnknownCells::Stop).unwrap();
    assert_eq!(field.memory_bytes(), bytes);
    let before = field.at([0.2; 3]);
    assert!(field.update(&map, small, f64::NAN, UnknownCells::Pass).is_err());
    assert_eq!((field.at([0.2; 3]), field.region(), field.max_distance()), (before, large, 0.5));
}

#[test]
fn what_is_no_region_is_refused() {
    let map = map_of(random_cells(3));
    let good = Extent { min: [-0.3; 3], max: [0.4; 3] };
    let mut bad = vec![(Extent { min: [0.4; 3], max: [-0.3; 3] }, 0.5), (good, 1e9)];
    for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e30] {
        bad.extend([(Extent { min: [odd, 0.0, 0.0], ..good }, 0.5), (Extent { max: [odd; 3], ..good }, 0.5)]);
    }
    bad.extend([(good, f64::INFINITY), (good, 1e30)]);
    bad.push((Extent { min: [-500.0; 3], max: [500.0; 3] }, 0.5));
    for (region, max_distance) in bad {
        let refused = map.distance_field(region, max_distance, UnknownCells::Pass);
        let text = refused.as_ref().unwrap_err().to_string();
        assert!(matches!(refused, Err(Error::Region { .. })), "{region:?} {max_distance}: {text}");
        assert!(
            text.contains(&format!("{max_distance} m around")) && text.ends_with("too far out"),
            "{text}"
        );
    }
    for max_distance in [0.0, -1.0, f64::NAN, f64::NEG_INFINITY] {
        let error = map.distance_field(good, max_distance, UnknownCells::Pass).unwrap_err().to_string();
        let expected = format!("no distance field up to {max_distance} m: not positive");
        assert_eq!(error, expected, "the distance is at fault, not the region");
    }
    let field = map.distance_field(good, 0.5, UnknownCells::Pass).unwrap();
    for odd in [f64::NAN, f64::INFINITY, 0.41, -0.31] {
        assert_eq!(field.at([0.0, odd, 0.0]), None);
    }
    // A single place, and one beyond the map's border, where all is unknown.
    let place = Extent { min: [0.2; 3], max: [0.2; 3] };
    assert!(map.distance_field(place, 0.5, UnknownCells::Pass).unwrap().at([0.2; 3]).is_some());
    let beyond = Extent { min: [3276.0; 3], max: [3277.5; 3] };
    for (unknown, expected) in [(UnknownCells::Pass, 0.5), (UnknownCells::Stop, 0.0)] {
        let field = map.distance_field(beyond, 0.5, unknown).unwrap();
        assert!((field.at([3277.0; 3]).unwrap().distance - expected).abs() < 1e-6);
    }
}

/// Regression: single precision rounded it up.
#[test]
fn no_distance_exceeds_the_greatest() {
    let map = Octree::new(OctreeConfig::default()).unwrap();
    let region = Extent { min: [0.0; 3], max: [0.1; 3] };
    for max_distance in [0.1, 0.3, 0.7] {
        let field = map.distance_field(region, max_distance, UnknownCells::Pass).unwrap();
        assert!(field.at([0.05; 3]).unwrap().distance <= max_distance);
    }
}
