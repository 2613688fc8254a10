//! Grids of floors: heights count from the floor beneath, on ramps, over low steps, in several storeys.

use crate::common::fine_camera;
use dymlm::core::{Frame, PinholeCamera, Pose};
use dymlm::octree::{CellState, GridRegion, OccupancyGrid};
use dymlm::{Error, FloorGrid, FloorGridConfig, MapBuilder, MapConfig, MultiLevelMap};
use dymlm_metrics::SpaceTruth;
use dymlm_sim::{Sequence, SequenceConfig, Truth, TruthConfig};
use dymlm_test_support::{Cuboid, Rectangle, World, look_at};

const UP: [f64; 3] = [0.0, 0.0, 1.0];
const RISE: f64 = 0.35;

/// From where, and where to.
type View = [[f64; 3]; 2];

/// The frames of exact bodies, three from each place, in a world that `moved` takes the bodies' to.
fn insert(builder: &mut MapBuilder, world: &World, views: &[View], moved: &Pose) {
    let camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5).unwrap();
    let start = builder.map().revision().get();
    for (number, [eye, target]) in views.iter().enumerate() {
        for step in 0..3_u32 {
            let eye = look_at([eye[0] + 0.01 * f64::from(step), eye[1], eye[2]], *target);
            let time = start as f64 + f64::from(3 * number as u32 + step);
            let frame = Frame::new(time, camera, world.depth(&camera, &eye), None).unwrap();
            builder.insert(&frame, &[], &(*moved * eye)).unwrap();
        }
    }
}

fn mapped(world: &World, views: &[View]) -> MultiLevelMap {
    let mut builder = MapBuilder::new(MapConfig::offline()).unwrap();
    insert(&mut builder, world, views, &Pose::identity());
    builder.into_map()
}

/// A crate on the floor.
fn crate_at(x: f64, y: f64, floor: f64) -> Cuboid {
    Cuboid {
        world_from_cuboid: Pose::new([x, y, floor + 0.2], [0.0, 0.0, 0.0, 1.0]).unwrap(),
        lengths: [0.4; 3],
    }
}

/// A floor up to x = 3, a ramp of 5 degrees up to x = 7, and the floor that it leads to: on each a crate.
fn ramped() -> World {
    let mut world = World::of(&[
        Rectangle::level([0.0, 0.0, 0.0], 3.0, 3.0),
        Rectangle { center: [5.0, 0.0, 0.5 * RISE], half_sides: [[2.0, 0.0, 0.5 * RISE], [0.0, 1.2, 0.0]] },
        Rectangle::level([9.0, 0.0, RISE], 2.0, 3.0),
    ]);
    world.cuboids = vec![crate_at(1.5, 1.0, 0.0), crate_at(5.0, 0.7, 0.5 * RISE), crate_at(9.5, -1.0, RISE)];
    world
}

const ALONG_THE_RAMP: [View; 6] = [
    [[-2.0, 0.0, 1.4], [0.5, 0.0, 0.0]],
    [[0.0, 0.0, 1.4], [2.5, 0.3, 0.0]],
    [[2.0, 0.0, 1.4], [4.5, 0.0, 0.1]],
    [[4.0, 0.0, 1.5], [6.5, 0.0, 0.3]],
    [[6.0, 0.0, 1.7], [8.5, 0.0, 0.35]],
    [[10.9, 0.0, 1.8], [8.0, -0.3, 0.35]],
];

fn state(grid: &OccupancyGrid, place: [f64; 2]) -> CellState {
    grid.cell_of(place).map_or(CellState::Unknown, |[x, y]| grid.at(x, y))
}

/// Whether a cell within one of the place is occupied.
fn is_blocked(grid: &OccupancyGrid, [x, y]: [f64; 2]) -> bool {
    let around = [-0.05, 0.0, 0.05];
    around.iter().any(|dx| around.iter().any(|dy| state(grid, [x + dx, y + dy]) == CellState::Occupied))
}

/// How many occupied cells are farther than that from all of the places.
fn occupied_beside(grid: &OccupancyGrid, places: &[[f64; 2]], distance: f64) -> usize {
    let cells = (0..grid.height()).flat_map(|y| (0..grid.width()).map(move |x| (x, y)));
    let occupied = cells.filter(|&(x, y)| grid.at(x, y) == CellState::Occupied);
    let is_beside = |&(x, y): &(usize, usize)| {
        let own = grid.center(x, y);
        places.iter().all(|place| (own[0] - place[0]).hypot(own[1] - place[1]) > distance)
    };
    occupied.filter(is_beside).count()
}

#[test]
fn a_ramp_and_the_floor_that_it_leads_to_are_one_floor() {
    let map = mapped(&ramped(), &ALONG_THE_RAMP);
    let config = FloorGridConfig::default();
    let floor = map.floor_grid([0.0, 0.0, 1.4], UP, &config).unwrap();
    // Ramp and floors may be fewer planes than three: few degrees part them.
    assert!(floor.planes().len() > 1, "{:?}", floor.planes());
    for (x, height) in [(0.0, 0.0), (5.0, 0.5 * RISE), (9.0, RISE)] {
        let own = floor.floor_height([x, 0.0]).unwrap();
        // To a voxel of the plane map.
        assert!((own - height).abs() < 0.03, "{own} m at {x}");
    }
    // Nothing but the crates is in the way, on the ramp and behind it neither.
    let crates = [[1.5, 1.0], [5.0, 0.7], [9.5, -1.0]];
    let near_sides = [[1.3, 0.9], [4.8, 0.6], [9.7, -1.0]];
    for place in near_sides {
        assert!(is_blocked(floor.grid(), place), "{place:?}");
    }
    assert_eq!(occupied_beside(floor.grid(), &crates, 0.45), 0);
    for place in [[1.0, 0.0], [5.0, 0.0], [6.5, 0.0], [8.5, 0.0]] {
        assert_eq!(state(floor.grid(), place), CellState::Free, "{place:?}");
    }
    // Heights from the lower floor alone have the upper one in the way.
    let level = map.octree().project(UP, 0.1, 1.5).unwrap();
    assert!(occupied_beside(&level, &crates, 0.45) > 500);
    // The same floor, whoever asks, and the only one.
    let from_above = map.floor_grid([9.0, 0.0, 1.8], UP, &config).unwrap();
    let mut planes = [floor.planes().to_vec(), from_above.planes().to_vec()];
    for planes in &mut planes {
        planes.sort_unstable();
    }
    assert_eq!(planes[0], planes[1]);
    assert_eq!(map.floor_grids(UP, &config).unwrap().len(), 1);
}

/// A floor, and one 0.3 m higher beyond y = 2, seen from both.
fn stepped() -> MultiLevelMap {
    let world = World::of(&[
        Rectangle::level([0.0, 0.0, 0.0], 2.0, 2.0),
        Rectangle::upright([0.0, 2.0, 0.15], 2.0, 0.15),
        Rectangle::level([0.0, 4.0, 0.3], 2.0, 2.0),
    ]);
    mapped(
        &world,
        &[
            [[0.0, -1.9, 1.3], [0.0, 0.5, 0.0]],
            [[0.0, 0.0, 1.3], [0.0, 2.4, 0.1]],
            [[0.0, 2.2, 1.6], [0.0, 4.6, 0.3]],
        ],
    )
}

#[test]
fn a_step_is_in_the_way_unless_it_may_be_taken() {
    let map = stepped();
    let mut config = FloorGridConfig::default();
    let lower = map.floor_grid([0.0, 0.0, 1.3], UP, &config).unwrap();
    let upper = map.floor_grid([0.0, 4.0, 1.6], UP, &config).unwrap();
    assert!(lower.planes().len() == 1 && upper.planes().len() == 1 && lower.planes() != upper.planes());
    // From below the landing is in the way, from above it is floor.
    assert!(is_blocked(lower.grid(), [0.0, 2.0]) && is_blocked(lower.grid(), [0.0, 3.5]));
    assert_eq!(state(upper.grid(), [0.0, 3.5]), CellState::Free);
    assert_eq!(occupied_beside(upper.grid(), &[], 0.0), 0);
    let heights = map
        .floor_grids(UP, &config)
        .unwrap()
        .iter()
        .map(|floor| floor.floor_height([0.0, 1.0]).unwrap())
        .collect::<Vec<_>>();
    assert_eq!(heights.len(), 2);
    assert!(heights[0].abs() < 0.02 && (heights[1] - 0.3).abs() < 0.02, "{heights:?}");

    config.max_step = 0.35;
    let both = map.floor_grid([0.0, 0.0, 1.3], UP, &config).unwrap();
    assert_eq!(both.planes().len(), 2);
    assert!((both.floor_height([0.0, 3.5]).unwrap() - 0.3).abs() < 0.02);
    assert_eq!(occupied_beside(both.grid(), &[], 0.0), 0);
}

/// Regression: for a robot that is lower than the step, nothing counted beside it, and a strip was unknown.
#[test]
fn beside_a_step_that_a_low_robot_may_take_the_grid_is_known() {
    let map = stepped();
    let mut config = FloorGridConfig::default();
    (config.max_step, config.min_height, config.max_height) = (0.35, 0.05, 0.2);
    let both = map.floor_grid([0.0, 0.0, 1.3], UP, &config).unwrap();
    for y in [1.6, 1.94, 1.99, 2.1, 2.5] {
        assert_eq!(state(both.grid(), [0.0, y]), CellState::Free, "{y}");
    }
}

#[test]
fn storeys_have_grids_of_their_own_and_tables_have_none() {
    let mut world = World::of(&[
        Rectangle::level([0.0, 0.0, 0.0], 3.0, 3.0),
        Rectangle::level([0.0, 0.0, 2.8], 3.0, 3.0),
        // A long table on each: larger than what may be a floor.
        Rectangle::level([0.8, 1.0, 0.75], 1.2, 0.5),
        Rectangle::level([-0.8, -1.0, 3.55], 1.2, 0.5),
    ]);
    world.cuboids = vec![crate_at(-1.5, 1.0, 0.0)];
    let views = |floor: f64| {
        [
            [[-2.5, -2.0, floor + 1.4], [0.0, 0.0, floor]],
            [[2.5, -2.5, floor + 1.4], [0.0, 0.5, floor]],
            [[2.5, 2.5, floor + 1.5], [0.0, 0.5, floor]],
            [[-2.5, 2.5, floor + 1.5], [0.0, -0.5, floor]],
        ]
    };
    let map = mapped(&world, &[views(0.0), views(2.8)].concat());
    let config = FloorGridConfig::default();
    let floors = map.floor_grids(UP, &config).unwrap();
    assert_eq!(floors.len(), 2);
    for (floor, (height, blocked, free)) in
        floors.iter().zip([(0.0, [0.8, 1.0], [-0.8, -1.0]), (2.8, [-0.8, -1.0], [0.8, 1.0])])
    {
        assert!((floor.floor_height([0.0, 0.0]).unwrap() - height).abs() < 0.02);
        assert!(
            is_blocked(floor.grid(), blocked) && state(floor.grid(), free) == CellState::Free,
            "{height}"
        );
        let asked = map.floor_grid([0.0, 0.0, height + 1.2], UP, &config).unwrap();
        assert_eq!(asked.planes()[0], floor.planes()[0]);
        assert_eq!(asked.grid(), floor.grid());
    }
    assert!(is_blocked(floors[0].grid(), [-1.5, 0.85]) && !is_blocked(floors[1].grid(), [-1.5, 0.85]));
}

fn assert_same(updated: &FloorGrid, anew: &FloorGrid) {
    assert_eq!(updated.planes()[0], anew.planes()[0]);
    assert_eq!(updated.grid().region(), anew.grid().region());
    for y in 0..anew.grid().height() {
        for x in 0..anew.grid().width() {
            let place = anew.grid().center(x, y);
            assert_eq!(updated.floor_height(place), anew.floor_height(place), "{place:?}");
        }
    }
    assert_eq!(updated.grid(), anew.grid());
}

#[test]
fn an_updated_grid_is_the_one_made_anew() {
    let world = ramped();
    let (at, mut config) = ([-2.0, 0.0, 1.4], FloorGridConfig::default());
    let mut builder = MapBuilder::new(MapConfig::offline()).unwrap();
    insert(&mut builder, &world, &ALONG_THE_RAMP[..1], &Pose::identity());
    let mut earlier = builder.map().clone();
    let mut grid = earlier.floor_grid(at, UP, &config).unwrap();
    config.region = Some(GridRegion { min: [-1.0, -1.0], max: [8.0, 2.0] });
    let mut of_region = earlier.floor_grid(at, UP, &config).unwrap();
    for view in &ALONG_THE_RAMP[1..] {
        insert(&mut builder, &world, &[*view], &Pose::identity());
        let now = builder.map().clone();
        let update = grid.update(&earlier, &now).unwrap();
        assert!(update.projected > 0 && update.projected < grid.grid().cells().len());
        of_region.update(&earlier, &now).unwrap();
        assert_same(&of_region, &now.floor_grid(at, UP, &config).unwrap());
        let mut over_all = config.clone();
        over_all.region = Some(grid.grid().region());
        assert_same(&grid, &now.floor_grid(at, UP, &over_all).unwrap());
        earlier = now;
    }
    // Nothing that is known is left out.
    let whole = earlier.floor_grid(at, UP, &FloorGridConfig::default()).unwrap();
    let [own, all] = [grid.grid(), whole.grid()].map(|grid| occupied_beside(grid, &[], 0.0));
    assert!(own.abs_diff(all) < 5, "{own} and {all}");
    assert!(grid.planes().len() > 1);
    let untouched = grid.update(&earlier, &earlier).unwrap();
    assert_eq!((untouched.projected, untouched.changed), (0, 0));
}

#[test]
fn the_grid_turns_with_the_world() {
    let moved = Pose::new([3.0, -20.0, 7.0], [0.5, -0.1, 0.7, 0.5]).unwrap();
    let mut builder = MapBuilder::new(MapConfig::offline()).unwrap();
    insert(&mut builder, &ramped(), &ALONG_THE_RAMP, &moved);
    let (map, up) = (builder.into_map(), moved.rotate(UP));
    let floor =
        map.floor_grid(moved.transform_point([0.0, 0.0, 1.4]), up, &FloorGridConfig::default()).unwrap();
    let grid_from_world = floor.grid().world_from_grid().inverse();
    let place = |x: f64, y: f64, z: f64| {
        let [x, y, _] = grid_from_world.transform_point(moved.transform_point([x, y, z]));
        [x, y]
    };
    let crates = [place(1.5, 1.0, 0.2), place(5.0, 0.7, 0.4), place(9.5, -1.0, 0.55)];
    assert!(floor.planes().len() > 1);
    for own in crates {
        assert!((0..8).any(|k| {
            let angle = f64::from(k) * std::f64::consts::FRAC_PI_4;
            is_blocked(floor.grid(), [own[0] + 0.2 * angle.cos(), own[1] + 0.2 * angle.sin()])
        }));
    }
    assert!(occupied_beside(floor.grid(), &crates, 0.5) <= 3);
}

#[test]
fn what_is_no_floor_is_refused() {
    let map = mapped(&ramped(), &ALONG_THE_RAMP[..2]);
    let config = FloorGridConfig::default();
    let error = map.floor_grid([0.0, 0.0, -1.0], UP, &config).unwrap_err();
    assert!(
        matches!(error, Error::NoFloor { .. }) && error.to_string().contains("[0.0, 0.0, -1.0]"),
        "{error}"
    );
    let empty = MapBuilder::new(MapConfig::default()).unwrap().into_map();
    assert!(matches!(empty.floor_grid([0.0; 3], UP, &config), Err(Error::NoFloor { .. })));
    assert!(empty.floor_grids(UP, &config).unwrap().is_empty());
    for odd in [f64::NAN, f64::INFINITY] {
        assert!(matches!(map.floor_grid([0.0, odd, 1.0], UP, &config), Err(Error::NoFloor { .. })));
        assert!(matches!(map.floor_grid([0.0; 3], [0.0, odd, 1.0], &config), Err(Error::Octree(_))));
    }
    assert!(matches!(map.floor_grids([0.0; 3], &config), Err(Error::Octree(_))));
    let unbounded = GridRegion { min: [-1e300, 0.0], max: [1e300, 0.0] };
    let mut endless = config.clone();
    endless.region = Some(unbounded);
    assert_eq!(map.floor_grid([0.0, 0.0, 1.4], UP, &endless).unwrap().grid().width(), 0);
    for length in [1e-13, 1e200] {
        let up = UP.map(|c| c * length);
        assert!(map.floor_grid([0.0, 0.0, 1.4], up, &config).is_ok(), "an up of length {length}");
    }
    let refused = |change: fn(&mut FloorGridConfig)| {
        let mut config = FloorGridConfig::default();
        change(&mut config);
        map.floor_grid([0.0, 0.0, 1.4], UP, &config).unwrap_err().to_string()
    };
    assert_eq!(
        refused(|c| c.max_height = 0.1),
        "floor_grid.max_height = 0.1 is outside its range 0.10000000000000002..=1000000"
    );
    assert!(refused(|c| c.max_slope_deg = 50.0).contains("floor_grid.max_slope_deg = 50"));
    assert!(refused(|c| c.max_step = f64::NAN).contains("floor_grid.max_step = NaN"));
    assert!(
        refused(|c| c.region = Some(GridRegion { min: [1.0; 2], max: [0.0; 2] })).contains("no grid from")
    );
    assert!(
        refused(|c| c.region = Some(GridRegion { min: [0.0; 2], max: [1e7; 2] })).contains("larger than")
    );
    // The update of a grid whose floor is gone changes nothing.
    let mut grid = map.floor_grid([0.0, 0.0, 1.4], UP, &config).unwrap();
    let before = grid.grid().clone();
    assert!(matches!(grid.update(&map, &empty), Err(Error::NoFloor { .. })));
    assert_eq!(grid.grid(), &before);
}

/// How a grid compares with the simulator's room, as shares of cells.
#[derive(Debug)]
struct PlanScore {
    /// Of the cells with a visible surface well between the two heights: those at most one cell from an
    /// occupied one.
    obstacles_found: f64,
    /// Of the occupied cells: those with a static surface in or near their column.
    true_obstacles: f64,
    /// Of the cells whose floor was seen: those that are known.
    floor_known: f64,
    /// Of the cells whose floor was seen and over which people walked: those that are free.
    free_where_people_walked: f64,
}

impl PlanScore {
    fn new(grid: &OccupancyGrid, truth: &Truth) -> Self {
        let places: Vec<[usize; 2]> =
            (0..grid.height()).flat_map(|y| (0..grid.width()).map(move |x| [x, y])).collect();
        let mut has_obstacle = vec![false; places.len()];
        let mut has_floor = vec![false; places.len()];
        for [x, y, z] in truth.visible_points() {
            if let Some([column, row]) = grid.cell_of([x.into(), y.into()]) {
                let cell = row * grid.width() + column;
                // Away from the two heights, where noise decides.
                has_obstacle[cell] |= (0.2..1.4).contains(&z);
                has_floor[cell] |= z.abs() < 0.02;
            }
        }
        let column = |cell: usize| {
            let [x, y] = grid.center(places[cell][0], places[cell][1]).map(|c| c as f32);
            (4..29).map(move |step| [x, y, 0.05 * step as f32])
        };
        let near = 1.5 * grid.resolution() as f32;
        let is_solid = |cell: usize| column(cell).any(|point| truth.surface_distance(point) < near);
        let is_swept = |cell: usize| column(cell).any(|point| truth.swept_by_movers(point));
        let is = |cell: usize, state| grid.at(places[cell][0], places[cell][1]) == state;
        let is_blocked = |cell: usize| is_blocked(grid, grid.center(places[cell][0], places[cell][1]));
        let share = |counts: &dyn Fn(usize) -> bool, holds: &dyn Fn(usize) -> bool| {
            let counted = (0..places.len()).filter(|&cell| counts(cell));
            let all = counted.clone().count();
            counted.filter(|&cell| holds(cell)).count() as f64 / all as f64
        };
        Self {
            obstacles_found: share(&|cell| has_obstacle[cell], &is_blocked),
            true_obstacles: share(&|cell| is(cell, CellState::Occupied), &is_solid),
            floor_known: share(&|cell| has_floor[cell], &|cell| !is(cell, CellState::Unknown)),
            free_where_people_walked: share(
                &|cell| has_floor[cell] && !has_obstacle[cell] && is_swept(cell) && !is_solid(cell),
                &|cell| is(cell, CellState::Free),
            ),
        }
    }
}

#[test]
fn the_grid_of_a_room_is_its_floor_plan() {
    let mut config = SequenceConfig::random_room(216);
    (config.frames, config.frame_rate) = (50, 3.0);
    config.camera = Some(fine_camera());
    let sequence = Sequence::new(&config).unwrap();
    let mut truth = Truth::new(&sequence, &TruthConfig::default()).unwrap();
    let mut builder = MapBuilder::new(MapConfig::default()).unwrap();
    for frame in sequence.frames() {
        truth.observe(&frame);
        builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
    }
    let floors = builder.into_map().floor_grids(UP, &FloorGridConfig::default()).unwrap();
    assert_eq!(floors.len(), 1);
    let score = PlanScore::new(floors[0].grid(), &truth);
    assert!(score.obstacles_found > 0.98 && score.true_obstacles > 0.9, "{score:?}");
    assert!(score.floor_known > 0.99 && score.free_where_people_walked > 0.98, "{score:?}");
}
