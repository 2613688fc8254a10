//! Tests of buildings made from floor plans: walls stand exactly where the plan says, the camera stays on free
//! floor, a seed always gives the same building, and what is no plan is refused.

use dymlm_core::PinholeCamera;
use dymlm_sim::{
    BuildingPlan, CameraPath, CarriedObject, DetectorConfig, PlanCell, PlanError, PlanGrid, SensorConfig,
    Sequence, SequenceConfig, Truth, TruthConfig,
};

const RESOLUTION: f64 = 0.1;
const ORIGIN: [f64; 2] = [-3.0, 2.0];

/// A plan in which the cells of some rectangles (from, to) are occupied.
fn plan(size: [usize; 2], occupied: &[[[usize; 2]; 2]]) -> PlanGrid {
    let [width, height] = size;
    let is_in = |[x, y]: [usize; 2]| {
        let holds = |[low, high]: &[[usize; 2]; 2]| x >= low[0] && y >= low[1] && x < high[0] && y < high[1];
        occupied.iter().any(holds)
    };
    let places = (0..width * height).map(|k| [k % width, k / width]);
    let cells = places.map(|at| if is_in(at) { PlanCell::Occupied } else { PlanCell::Free }).collect();
    PlanGrid { width, height, resolution: RESOLUTION, origin: ORIGIN, cells }
}

/// Two rooms of 6.8 x 5.6 m with walls of two cells, a door of 1 m between them, and a block.
fn two_rooms() -> PlanGrid {
    plan(
        [142, 60],
        &[
            [[0, 0], [142, 2]],
            [[0, 58], [142, 60]],
            [[0, 0], [2, 60]],
            [[140, 0], [142, 60]],
            [[70, 0], [72, 20]],
            [[70, 30], [72, 60]],
            [[110, 20], [120, 34]],
        ],
    )
}

fn config(grid: &PlanGrid, seed: u64) -> SequenceConfig {
    let plan = BuildingPlan::new(grid, 2.6).unwrap();
    let mut config = SequenceConfig::planned_building(plan, seed, 5.0, 2000);
    config.camera = Some(PinholeCamera::new(160, 120, 131.25, 131.25, 79.5, 59.5).unwrap());
    config.sensor = SensorConfig::ideal();
    config.detector = DetectorConfig::ideal();
    config
}

#[test]
fn walls_stand_where_the_plan_says() {
    let config = config(&two_rooms(), 3);
    let plan = config.plan.clone().unwrap();
    assert_eq!(plan.grid(), &two_rooms());
    // Around the rooms four walls, of which two are parted; three faces of each stub, four of the block.
    assert_eq!(plan.wall_count(), 6 + 6 + 4);
    let sequence = Sequence::new(&config).unwrap();
    let truth = Truth::new(&sequence, &TruthConfig::default()).unwrap();
    let faces = truth.faces();
    // Normal, distance from the origin, and extent along the wall, metres.
    for (normal, at, [from, to]) in [
        ([0.0, 1.0], 2.2, [-2.8, 4.0]),
        ([0.0, 1.0], 2.2, [4.2, 11.0]),
        ([0.0, -1.0], 7.8, [-2.8, 4.0]),
        ([0.0, -1.0], 7.8, [4.2, 11.0]),
        ([1.0, 0.0], -2.8, [2.2, 7.8]),
        ([-1.0, 0.0], 11.0, [2.2, 7.8]),
        ([-1.0, 0.0], 4.0, [2.2, 4.0]),
        ([1.0, 0.0], 4.2, [2.2, 4.0]),
        ([-1.0, 0.0], 4.0, [5.0, 7.8]),
        ([1.0, 0.0], 4.2, [5.0, 7.8]),
        ([0.0, 1.0], 4.0, [4.0, 4.2]),
        ([0.0, -1.0], 5.0, [4.0, 4.2]),
        ([-1.0, 0.0], 8.0, [4.0, 5.4]),
        ([1.0, 0.0], 9.0, [4.0, 5.4]),
        ([0.0, -1.0], 4.0, [8.0, 9.0]),
        ([0.0, 1.0], 5.4, [8.0, 9.0]),
    ] {
        let [nx, ny] = normal;
        let along = [ny, -nx].map(f64::abs);
        let is_it = |face: &&dymlm_metrics::TrueFace| {
            let plane = face.plane;
            let is_same = plane.normal()[0] * nx + plane.normal()[1] * ny > 1.0 - 1e-6
                && (plane.d() + (nx + ny) * at).abs() < 1e-5;
            let ends = face.outline.iter().flatten().map(|c| c[0] * along[0] + c[1] * along[1]);
            let [low, high] =
                ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], c| [low.min(c), high.max(c)]);
            let heights = face.outline.iter().flatten().map(|c| c[2]);
            let top = heights.clone().fold(f64::NEG_INFINITY, f64::max);
            is_same
                && face.label.is_none()
                && (low - from).abs() < 2e-3
                && (high - to).abs() < 2e-3
                && (top - 2.6).abs() < 1e-5
                && heights.fold(f64::INFINITY, f64::min).abs() < 1e-5
        };
        assert_eq!(faces.iter().filter(is_it).count(), 1, "{normal:?} {at} {from} {to}");
    }
}

#[test]
fn rooms_are_furnished_and_people_are_in_them() {
    let sequence = Sequence::new(&config(&two_rooms(), 4)).unwrap();
    let truth = Truth::new(&sequence, &TruthConfig::default()).unwrap();
    assert!(truth.objects().len() > 10, "{}", truth.objects().len());
    let frames = (0..sequence.len()).step_by(20).filter_map(|index| sequence.frame(index));
    let with_people = frames.filter(|frame| frame.mover_mask.count() > 100).count();
    assert!(with_people > 3, "{with_people}");
}

/// Number of steps of `step` metres along the straight line between two points.
fn between(a: [f64; 2], b: [f64; 2], step: f64) -> impl Iterator<Item = [f64; 2]> {
    let steps = ((b[0] - a[0]).hypot(b[1] - a[1]) / step).ceil().max(1.0);
    (0..=steps as usize).map(move |k| {
        let share = k as f64 / steps;
        [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]
    })
}

#[test]
fn the_camera_stays_on_free_floor_and_sees_all_of_it() {
    for path in [CameraPath::Handheld, CameraPath::Robot] {
        let mut config = config(&two_rooms(), 5);
        config.path = path;
        let sequence = Sequence::new(&config).unwrap();
        let plan = config.plan.unwrap();
        let mut last: Option<[f64; 2]> = None;
        let mut visited = [false; 2];
        for index in 0..sequence.len() {
            let [x, y, _] = sequence.world_from_camera(index).translation();
            for point in between(last.unwrap_or([x, y]), [x, y], 0.02) {
                for (dx, dy) in [(0.25, 0.0), (-0.25, 0.0), (0.0, 0.25), (0.0, -0.25)] {
                    let near = [point[0] + dx, point[1] + dy];
                    assert_eq!(plan.grid().at(near), PlanCell::Free, "{path:?}: {point:?}, frame {index}");
                }
            }
            assert!(
                last.is_none_or(|last| (x - last[0]).hypot(y - last[1]) < 0.3),
                "a jump at frame {index}"
            );
            visited[usize::from(x > 4.2)] |= !(3.8..4.4).contains(&x);
            last = Some([x, y]);
        }
        assert!(visited[0] && visited[1], "{visited:?}");
        // It comes back to where it began.
        let [start, end] =
            [0, sequence.len() - 1].map(|index| sequence.world_from_camera(index).translation());
        assert!((start[0] - end[0]).hypot(start[1] - end[1]) < 0.5, "{start:?} {end:?}");
    }
}

#[test]
fn a_tour_is_as_short_as_asked_for() {
    let plan = BuildingPlan::new(&two_rooms(), 2.6).unwrap();
    let lengths = [2000, 200, 60, 1].map(|most| {
        let config = SequenceConfig::planned_building(plan.clone(), 1, 5.0, most);
        assert!(config.frames <= most && Sequence::new(&config).is_ok(), "{} of {most}", config.frames);
        config.frames
    });
    assert!(lengths[0] > 300 && lengths[1] > 100 && lengths[2] > 40, "{lengths:?}");
}

#[test]
fn a_seed_is_a_building() {
    let depths = |seed: u64| {
        let sequence = Sequence::new(&config(&two_rooms(), seed)).unwrap();
        let frames = [0, 40, 80].into_iter().filter_map(|index| sequence.frame(index));
        frames
            .flat_map(|frame| frame.true_depth.data().iter().map(|z| z.to_bits()).collect::<Vec<_>>())
            .collect()
    };
    let of: Vec<Vec<u32>> = [8, 8, 9].map(depths).into();
    assert!(of[0] == of[1] && of[0] != of[2]);
}

#[test]
fn nothing_of_other_rooms_is_in_it() {
    let mut config = config(&two_rooms(), 2);
    config.carried = Some(CarriedObject::default());
    assert!(Sequence::new(&config).unwrap().carried_thing(10).is_none());
    // On some of the other days, things stand elsewhere; the walls stay.
    let first = Sequence::new(&config).unwrap();
    let on_day = |day: u64| {
        Sequence::new(&{
            let mut config = config.clone();
            config.day = day;
            config
        })
        .unwrap()
    };
    assert!((1..8).any(|day| !on_day(day).differences_from(&first).is_empty()));
    assert!(format!("{config:?}").len() < 4000);
}

#[test]
fn what_walls_enclose_is_solid_and_specks_are_not() {
    let mut grid = two_rooms();
    // The block is hollow and unknown inside, with a free cell in its middle; there is a speck, too.
    for y in 22..32 {
        (112..118).for_each(|x| grid.cells[y * 142 + x] = PlanCell::Unknown);
    }
    grid.cells[25 * 142 + 115] = PlanCell::Free;
    grid.cells[40 * 142 + 30] = PlanCell::Occupied;
    let plan = BuildingPlan::new(&grid, 2.6).unwrap();
    assert_eq!(plan.grid(), &two_rooms());
}

#[test]
fn rough_walls_become_one_face_each() {
    let mut grid = two_rooms();
    for x in (5..140).step_by(7) {
        // Bumps and notches of a cell.
        grid.cells[2 * 142 + x] = PlanCell::Occupied;
        grid.cells[142 + x + 3] = PlanCell::Free;
    }
    let plan = BuildingPlan::new(&grid, 2.6).unwrap();
    assert_eq!(plan.grid(), &two_rooms());
    assert_eq!(plan.wall_count(), 16);
}

#[test]
fn what_is_no_plan_is_refused() {
    let refused = |grid: &PlanGrid| BuildingPlan::new(grid, 2.6).unwrap_err();
    let all = |cell: PlanCell, width: usize, height: usize| PlanGrid {
        cells: vec![cell; width * height],
        ..plan([width, height], &[])
    };
    assert_eq!(refused(&all(PlanCell::Occupied, 50, 50)), PlanError::NothingFree);
    assert_eq!(refused(&all(PlanCell::Unknown, 50, 50)), PlanError::NothingFree);
    assert_eq!(refused(&all(PlanCell::Free, 50, 50)), PlanError::NoWalls);
    assert_eq!(refused(&all(PlanCell::Occupied, 1, 1)), PlanError::NothingFree);
    assert_eq!(refused(&all(PlanCell::Free, 1, 1)), PlanError::NoWalls);
    assert_eq!(refused(&all(PlanCell::Free, 0, 0)), PlanError::Size { width: 0, height: 0 });
    assert_eq!(refused(&all(PlanCell::Free, 5, 0)), PlanError::Size { width: 5, height: 0 });
    // A cupboard: nobody gets in.
    assert!(matches!(refused(&plan([9, 9], &[[[0, 0], [9, 2]], [[0, 7], [9, 9]]])), PlanError::NoWay(_)));
    let huge = PlanGrid { width: usize::MAX, height: 3, ..two_rooms() };
    assert_eq!(refused(&huge), PlanError::Size { width: usize::MAX, height: 3 });
    let large = PlanGrid { width: 1 << 13, height: 1 << 13, cells: Vec::new(), ..two_rooms() };
    assert_eq!(refused(&large), PlanError::Size { width: 1 << 13, height: 1 << 13 });
    let wide = PlanGrid { resolution: 0.5, ..all(PlanCell::Free, 300, 300) };
    assert!(matches!(refused(&wide), PlanError::Config(_)));
    let short = PlanGrid { cells: vec![PlanCell::Free; 3], ..two_rooms() };
    assert_eq!(refused(&short), PlanError::CellCount { cells: 3, width: 142, height: 60 });
    for resolution in [0.0, -0.1, f64::NAN, f64::INFINITY, 2.0] {
        assert!(
            matches!(refused(&PlanGrid { resolution, ..two_rooms() }), PlanError::Config(_)),
            "{resolution}"
        );
    }
    for origin in [[f64::NAN, 0.0], [0.0, f64::INFINITY], [1e9, 0.0]] {
        assert!(matches!(refused(&PlanGrid { origin, ..two_rooms() }), PlanError::Config(_)), "{origin:?}");
    }
    for height in [0.0, -1.0, f64::NAN, 100.0] {
        assert!(matches!(BuildingPlan::new(&two_rooms(), height), Err(PlanError::Config(_))), "{height}");
    }
    assert_eq!(two_rooms().at([f64::NAN, 3.0]), PlanCell::Unknown);
}
