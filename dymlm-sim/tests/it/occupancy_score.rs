//! Scores of occupancy maps with known errors.
use std::collections::BTreeSet;
use std::sync::LazyLock;

use dymlm_core::{Error, Mask, PinholeCamera, Point, Pose};
use dymlm_metrics::{
    FreeSpaceScore, Occupancy, OccupancyScore, OccupancyScorer, OccupiedCell, OccupiedCellScore, SpaceTruth,
    SurfaceScore,
};
use dymlm_sim::{Sequence, SequenceConfig, SimulatedFrame, Truth, TruthConfig};

const RESOLUTION: f64 = 0.05;

struct Recorded {
    frames: Vec<SimulatedFrame>,
    truth: Truth,
    scorer: OccupancyScorer,
    /// Cells of the static surface without noise.
    exact: Map,
    /// The points that the scorer looks up as free space.
    asked: Vec<Point>,
}

/// Occupied cells of one size; all other cells are free.
#[derive(Debug, Clone, Default)]
struct Map(BTreeSet<[i32; 3]>);

impl Map {
    fn of(points: impl IntoIterator<Item = Point>) -> Self {
        Self(points.into_iter().map(key).collect())
    }

    fn at(&self, point: Point) -> Occupancy {
        if self.0.contains(&key(point)) { Occupancy::Occupied } else { Occupancy::Free }
    }

    fn cells(&self) -> Vec<OccupiedCell> {
        self.0.iter().map(|&key| OccupiedCell { center: center(key), size: RESOLUTION }).collect()
    }

    fn score(&self) -> OccupancyScore {
        RECORDED.scorer.score(&RECORDED.truth, RESOLUTION, &self.cells(), |point| self.at(point)).unwrap()
    }
}

fn key(point: Point) -> [i32; 3] {
    point.map(|c| (f64::from(c) / RESOLUTION).floor() as i32)
}

fn center(key: [i32; 3]) -> [f64; 3] {
    key.map(|k| (f64::from(k) + 0.5) * RESOLUTION)
}

fn observe(scorer: &mut OccupancyScorer, frame: &SimulatedFrame) {
    scorer.observe(&frame.frame, &frame.true_depth, &frame.mover_mask, &frame.world_from_camera).unwrap();
}

fn record(world_from_scene: Pose) -> (Vec<SimulatedFrame>, Truth, OccupancyScorer) {
    let mut config = SequenceConfig::default();
    config.frames = 16;
    config.frame_rate = 2.0;
    config.camera = Some(PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5).unwrap());
    config.world_from_scene = world_from_scene;
    let sequence = Sequence::new(&config).unwrap();
    let mut truth = Truth::new(&sequence, &TruthConfig::default()).unwrap();
    let mut scorer = OccupancyScorer::new(0.5..=4.0);
    let frames: Vec<SimulatedFrame> = sequence.frames().collect();
    for frame in &frames {
        truth.observe(frame);
        observe(&mut scorer, frame);
    }
    (frames, truth, scorer)
}

/// Sixteen small frames in a world that is turned on purpose.
static RECORDED: LazyLock<Recorded> = LazyLock::new(|| {
    let (frames, truth, scorer) = record(Pose::new([3.0, -7.0, 1.0], [0.5, -0.5, 0.5, 0.5]).unwrap());
    let exact = Map::of(frames.iter().flat_map(|frame| points(frame, false)));
    let asked = asked(&scorer, &truth, &exact);
    Recorded { frames, truth, scorer, exact, asked }
});

/// The exact points of a frame within 0.5 to 4 m, either of movers or of everything else.
fn points(frame: &SimulatedFrame, movers: bool) -> Vec<Point> {
    let camera = frame.frame.camera();
    let depth = &frame.true_depth;
    (0..camera.width() * camera.height())
        .map(|pixel| (pixel % camera.width(), pixel / camera.width()))
        .filter(|&(u, v)| frame.mover_mask.at(u, v) == movers && (0.5..=4.0).contains(&depth.at(u, v)))
        .map(|(u, v)| {
            let point = camera.back_project([u as f64, v as f64], depth.at(u, v).into());
            frame.world_from_camera.transform_point(point).map(|c| c as f32)
        })
        .collect()
}

/// The points that the scorer looks up in a map; when the map covers all surface, all of them are free space.
fn asked(scorer: &OccupancyScorer, truth: &Truth, complete: &Map) -> Vec<Point> {
    let mut asked = Vec::new();
    let ask = |point| {
        asked.push(point);
        Occupancy::Free
    };
    scorer.score(truth, RESOLUTION, &complete.cells(), ask).unwrap();
    asked
}

fn free_space(score: OccupancyScore) -> FreeSpaceScore {
    score.free_space.unwrap()
}

fn surface(score: OccupancyScore) -> SurfaceScore {
    score.surface.unwrap()
}

fn cells(score: OccupancyScore) -> OccupiedCellScore {
    score.cells.unwrap()
}

#[test]
fn the_exact_map_is_faultless() {
    let score = RECORDED.exact.score();
    let free = free_space(score);
    assert_eq!((free.ghosts, free.stray, free.unknown, free.free), (Some(0.0), 0.0, 0.0, 1.0));
    assert!(free.points > 20_000 && free.swept_points > 500, "{free:?}");
    let surface = surface(score);
    assert_eq!((surface.completeness, surface.false_free, surface.unknown), (1.0, 0.0, 0.0));
    let cells = cells(score);
    assert_eq!((cells.residue, cells.stray), (0.0, 0.0));
    assert_eq!(cells.cells, RECORDED.exact.0.len() as u64);
    // A cell's centre is up to half a diagonal from the surface in the cell.
    assert!((0.005..0.02).contains(&cells.median_distance), "{cells:?}");
    assert!(cells.p95_distance < 0.044, "{cells:?}");
}

/// Each point looked up as free is on the ray to a reading: some frame sees it at the centre of a pixel
/// without a mover, before both the reading and the exact surface.
#[test]
fn free_space_was_seen_through_and_is_clear_of_surfaces() {
    let clearance = 0.06 + 3.0_f32.sqrt() * RESOLUTION as f32;
    let seen_through = |frame: &SimulatedFrame, point: Point| {
        let in_camera = frame.world_from_camera.inverse().transform_point(point.map(f64::from));
        let Some(pixel) = frame.frame.camera().project(in_camera) else { return false };
        let [u, v] = pixel.map(f64::round);
        let nearest = |u: f64, v: f64| {
            let depths = [&frame.true_depth, frame.frame.depth()].map(|d| d.at(u as usize, v as usize));
            depths.into_iter().all(|z| f64::from(z) > in_camera[2] && (0.5..=4.0).contains(&z))
        };
        frame.frame.camera().sees(pixel)
            && (pixel[0] - u).abs() + (pixel[1] - v).abs() < 0.02
            && !frame.mover_mask.at(u as usize, v as usize)
            && nearest(u, v)
    };
    for &point in RECORDED.asked.iter().step_by(7) {
        assert!(RECORDED.truth.surface_distance(point) > clearance);
        assert!(RECORDED.frames.iter().any(|frame| seen_through(frame, point)), "{point:?}");
    }
}

#[test]
fn one_answer_for_all_space() {
    let (truth, scorer, asked) = (&RECORDED.truth, &RECORDED.scorer, &RECORDED.asked);
    let swept = asked.iter().filter(|&&point| truth.swept_by_movers(point)).count();
    let share = swept as f64 / asked.len() as f64;

    let full = free_space(scorer.score(truth, RESOLUTION, &[], |_| Occupancy::Occupied).unwrap());
    assert_eq!((full.points, full.swept_points), (asked.len(), swept));
    assert_eq!((full.false_occupied, full.ghosts), (1.0, Some(1.0)));
    assert!((full.stray - (1.0 - share)).abs() < 1e-12 && full.free == 0.0 && full.unknown == 0.0);

    let unknown = scorer.score(truth, RESOLUTION, &[], |_| Occupancy::Unknown).unwrap();
    assert_eq!((free_space(unknown).unknown, free_space(unknown).free), (1.0, 0.0));
    assert_eq!(free_space(unknown).ghosts, Some(0.0));
    assert_eq!((surface(unknown).unknown, surface(unknown).completeness), (1.0, 0.0));
    assert_eq!(unknown.cells, None);

    let free = scorer.score(truth, RESOLUTION, &[], |_| Occupancy::Free).unwrap();
    assert_eq!((free_space(free).free, surface(free).false_free), (1.0, 1.0));
}

#[test]
fn a_ghost_is_false_occupied_where_movers_were() {
    let ghost = Map::of(RECORDED.frames.iter().flat_map(|frame| points(frame, true)));
    let mut map = RECORDED.exact.clone();
    map.0.extend(&ghost.0);
    let score = map.score();

    let hit = RECORDED.asked.iter().filter(|&&point| map.0.contains(&key(point))).count();
    assert!(hit > 50, "{hit} points of free space in the ghosts");
    let free = free_space(score);
    assert_eq!(free.ghosts, Some(hit as f64 / free.swept_points as f64), "{free:?}");
    assert!((free.false_occupied - hit as f64 / free.points as f64).abs() < 1e-12 && free.stray == 0.0);
    assert!((free.false_occupied + free.free - 1.0).abs() < 1e-12);

    let off = |key: &[i32; 3]| {
        let middle = center(*key).map(|c| c as f32);
        RECORDED.truth.surface_distance(middle) > 0.06 + 0.5 * 3.0_f32.sqrt() * RESOLUTION as f32
    };
    let residue = ghost.0.iter().filter(|key| off(key)).count() as f64 / map.0.len() as f64;
    let cells = cells(score);
    assert!(residue > 0.02 && (cells.residue - residue).abs() < 1e-12 && cells.stray == 0.0, "{cells:?}");
    assert_eq!(surface(score).completeness, 1.0);
}

#[test]
fn cells_in_the_air_are_stray() {
    // A block of 4x4x4 cells in free space, far from surfaces and from everybody's way.
    let truth = &RECORDED.truth;
    let block = |corner: [i32; 3]| {
        (0..64).map(move |i| [corner[0] + i / 16, corner[1] + i / 4 % 4, corner[2] + i % 4])
    };
    let in_the_air = |key: [i32; 3]| {
        let middle = center(key).map(|c| c as f32);
        truth.surface_distance(middle) > 0.2 && !truth.swept_by_movers(middle)
    };
    let clear = |corner: &[i32; 3]| block(*corner).all(in_the_air);
    let air = RECORDED.asked.iter().map(|&point| key(point)).find(clear).unwrap();
    let mut map = RECORDED.exact.clone();
    map.0.extend(block(air));
    assert_eq!(map.0.len(), RECORDED.exact.0.len() + 64);
    let score = map.score();
    assert!((cells(score).stray - 64.0 / map.0.len() as f64).abs() < 1e-12, "{score:?}");
    assert_eq!((cells(score).residue, free_space(score).ghosts), (0.0, Some(0.0)));
    let hit = RECORDED.asked.iter().filter(|&&point| map.0.contains(&key(point))).count();
    assert!(hit > 0 && (free_space(score).stray - hit as f64 / RECORDED.asked.len() as f64).abs() < 1e-12);
}

/// Whether a cell of the map is within half a diagonal of a point, by testing all cells around it.
fn covered(map: &Map, point: Point) -> bool {
    let [x, y, z] = key(point);
    let range = || -2..=2;
    range().flat_map(|i| range().flat_map(move |j| range().map(move |k| [x + i, y + j, z + k]))).any(|key| {
        let beyond = |axis: usize| {
            let low = f64::from(key[axis]) * RESOLUTION;
            let c = f64::from(point[axis]);
            (low - c).max(c - low - RESOLUTION).max(0.0)
        };
        let squared: f64 = (0..3).map(|axis| beyond(axis).powi(2)).sum();
        map.0.contains(&key) && squared <= 0.75 * RESOLUTION * RESOLUTION
    })
}

#[test]
fn a_hole_is_incomplete_and_false_free_or_unknown() {
    let scene_from_world = Pose::new([3.0, -7.0, 1.0], [0.5, -0.5, 0.5, 0.5]).unwrap().inverse();
    let left = |key: &[i32; 3]| scene_from_world.transform_point(center(*key))[0] < 0.0;
    let mut map = RECORDED.exact.clone();
    map.0.retain(left);
    let visible = RECORDED.truth.visible_points();
    let kept = visible.iter().filter(|&&point| covered(&map, point)).count() as f64 / visible.len() as f64;
    assert!((0.2..0.8).contains(&kept), "{kept}");

    let score = map.score();
    // (In f32, a point exactly at half a diagonal may count either way.)
    assert!((surface(score).completeness - kept).abs() < 2e-4, "{score:?}, not {kept}");
    assert!((surface(score).false_free + surface(score).completeness - 1.0).abs() < 1e-12);
    assert_eq!((surface(score).unknown, free_space(score).free), (0.0, 1.0));

    // The right half was never mapped.
    let unmapped = |point: Point| if left(&key(point)) { map.at(point) } else { Occupancy::Unknown };
    let score = RECORDED.scorer.score(&RECORDED.truth, RESOLUTION, &map.cells(), unmapped).unwrap();
    assert_eq!(surface(score).completeness, surface(map.score()).completeness);
    assert!(surface(score).unknown > surface(score).false_free * 20.0, "{score:?}");
    let right = RECORDED.asked.iter().filter(|&&point| !left(&key(point))).count();
    assert!((free_space(score).unknown - right as f64 / RECORDED.asked.len() as f64).abs() < 1e-12);
}

#[test]
fn a_shifted_map_is_off_by_the_shift() {
    // The map is shifted by 0, 1, 2 and 6 cells along the scene's z, which is one of the world's axes: floor
    // and desk are off by the shift, walls not at all.
    let up =
        Pose::new([0.0; 3], [0.5, -0.5, 0.5, 0.5]).unwrap().rotate([0.0, 0.0, 1.0]).map(|c| c.round() as i32);
    let shifted = |cells: i32| {
        let move_up = |key: &[i32; 3]| std::array::from_fn(|axis| key[axis] + cells * up[axis]);
        Map(RECORDED.exact.0.iter().map(move_up).collect()).score()
    };
    let [none, one, two, six] = [0, 1, 2, 6].map(shifted);
    let p95 = |score| cells(score).p95_distance;
    assert!(p95(none) < 0.044 && (0.08..0.15).contains(&p95(two)), "{} {}", p95(none), p95(two));
    assert!((0.25..0.35).contains(&p95(six)), "{}", p95(six));
    // A shift of one cell is within the tolerance.
    let off = |score| cells(score).stray + cells(score).residue;
    assert_eq!((off(none), off(one)), (0.0, 0.0));
    assert!(off(two) > 0.1 && off(six) > off(two), "{} {}", off(two), off(six));
    assert!(surface(none).completeness > surface(two).completeness);
    assert!(free_space(six).false_occupied > 0.002, "{:?}", free_space(six));
}

#[test]
fn one_cell_alone() {
    let center = [RECORDED.asked[0], RECORDED.asked[999]].map(|point| point.map(f64::from));
    for center in center {
        let distance = RECORDED.truth.surface_distance(center.map(|c| c as f32)).into();
        let cell = OccupiedCell { center, size: RESOLUTION };
        let score = RECORDED.scorer.score(&RECORDED.truth, RESOLUTION, &[cell], |_| Occupancy::Free).unwrap();
        let cells = cells(score);
        assert_eq!((cells.median_distance, cells.p95_distance, cells.cells), (distance, distance, 1));
        assert_eq!(cells.residue + cells.stray, 1.0);
    }
}

#[test]
fn pruned_cells_count_as_their_smallest_ones() {
    // Blocks of two, four and forty cells a side; the scorer splits the last into pieces of 4x4x4.
    let block = |corner: [i32; 3], side: i32| -> Vec<OccupiedCell> {
        let cell =
            move |i: i32| [corner[0] + i / side / side, corner[1] + i / side % side, corner[2] + i % side];
        (0..side.pow(3)).map(|i| OccupiedCell { center: center(cell(i)), size: RESOLUTION }).collect()
    };
    let pruned = |corner: [i32; 3], side: i32| OccupiedCell {
        center: corner.map(|k| (f64::from(k) + 0.5 * f64::from(side)) * RESOLUTION),
        size: f64::from(side) * RESOLUTION,
    };
    let corner = *RECORDED.exact.0.first().unwrap();
    let score = |cells: &[OccupiedCell]| {
        RECORDED.scorer.score(&RECORDED.truth, RESOLUTION, cells, |point| RECORDED.exact.at(point)).unwrap()
    };
    for side in [2, 4, 40] {
        let mut large = RECORDED.exact.cells();
        let mut small = large.clone();
        large.push(pruned(corner, side));
        small.extend(block(corner, side));
        let (large, small) = (score(&large), score(&small));
        assert_eq!(cells(large).cells, cells(small).cells);
        let near =
            |a: f64, b: f64, tolerance: f64| assert!((a - b).abs() <= tolerance, "{a} and {b} at {side}");
        let tolerance = if side > 16 { 0.06 } else { 1e-6 };
        near(cells(large).median_distance, cells(small).median_distance, tolerance);
        near(cells(large).p95_distance, cells(small).p95_distance, tolerance);
        if side <= 16 {
            near(cells(large).stray, cells(small).stray, tolerance);
        }
        near(surface(large).completeness, surface(small).completeness, 1e-12);
    }
}

#[test]
fn neither_the_order_of_cells_nor_what_is_none_matters() {
    let score = |cells: &[OccupiedCell]| {
        RECORDED.scorer.score(&RECORDED.truth, RESOLUTION, cells, |point| RECORDED.exact.at(point)).unwrap()
    };
    let mut cells = RECORDED.exact.cells();
    cells.extend(
        RECORDED.asked.iter().step_by(50).map(|p| OccupiedCell { center: p.map(f64::from), size: 0.1 }),
    );
    let expected = score(&cells);
    let count = cells.len();
    let mut permuted: Vec<OccupiedCell> = (0..count).map(|i| cells[(i * 7919 + 13) % count]).collect();
    assert!(!count.is_multiple_of(7919) && permuted != cells);
    assert_eq!(score(&permuted), expected);

    for (center, size) in [
        ([f64::NAN; 3], 0.1),
        ([0.0, f64::INFINITY, 0.0], 0.1),
        ([0.0; 3], 0.0),
        ([0.0; 3], -1.0),
        ([0.0; 3], f64::NAN),
    ] {
        permuted.push(OccupiedCell { center, size });
    }
    assert_eq!(score(&permuted), expected);
}

#[test]
fn absurd_cells_do_no_harm() {
    let far = OccupiedCell { center: [1e8, -1e8, 1e8], size: RESOLUTION };
    let world = OccupiedCell { center: [0.0; 3], size: 65536.0 * RESOLUTION };
    let score = RECORDED
        .scorer
        .score(&RECORDED.truth, RESOLUTION, &[far, world, world], |_| Occupancy::Free)
        .unwrap();
    assert_eq!(cells(score).cells, 2 * 65536_u64.pow(3) + 1);
    assert_eq!(surface(score).completeness, 1.0);
    assert!(cells(score).p95_distance > 100.0);
}

#[test]
fn a_turned_world_scores_alike() {
    let (_, truth, scorer) = record(Pose::identity());
    let scene_from_world = Pose::new([3.0, -7.0, 1.0], [0.5, -0.5, 0.5, 0.5]).unwrap().inverse();
    // The rotation swaps axes and the shift is a whole number of cells, so that cells map to cells.
    let mut map = RECORDED.exact.clone();
    map.0.extend(RECORDED.frames[3..9].iter().flat_map(|frame| points(frame, true)).map(key));
    map.0.retain(|key| scene_from_world.transform_point(center(*key))[0] < 1.0);
    let turned: Map = Map(map
        .0
        .iter()
        .map(|&k| key(scene_from_world.transform_point(center(k)).map(|c| c as f32)))
        .collect());
    let score = scorer.score(&truth, RESOLUTION, &turned.cells(), |point| turned.at(point)).unwrap();
    let expected = map.score();
    assert_eq!(turned.0.len(), map.0.len());
    let near = |a: f64, b: f64, tolerance: f64| assert!((a - b).abs() < tolerance, "{score:?} {expected:?}");
    near(free_space(score).false_occupied, free_space(expected).false_occupied, 5e-4);
    let [ghosts, expected_ghosts] = [score, expected].map(|score| free_space(score).ghosts.unwrap());
    near(ghosts, expected_ghosts, 0.05 * expected_ghosts);
    near(
        free_space(score).points as f64,
        free_space(expected).points as f64,
        0.03 * free_space(expected).points as f64,
    );
    near(surface(score).completeness, surface(expected).completeness, 3e-3);
    near(cells(score).median_distance, cells(expected).median_distance, 1e-5);
    near(cells(score).p95_distance, cells(expected).p95_distance, 1e-5);
    near(cells(score).residue, cells(expected).residue, 2e-3);
}

#[test]
fn nothing_seen_is_nothing_scored() {
    let sequence = Sequence::new(&SequenceConfig::default()).unwrap();
    let truth = Truth::new(&sequence, &TruthConfig::default()).unwrap();
    let scorer = OccupancyScorer::new(0.5..=4.0);
    let score = scorer.score(&truth, RESOLUTION, &[], |_| Occupancy::Unknown).unwrap();
    assert_eq!((score.free_space, score.surface, score.cells), (None, None, None));
    let error = scorer.score(&truth, f64::NAN, &[], |_| Occupancy::Free).unwrap_err();
    assert_eq!(error.field, "resolution");
}

#[test]
fn space_that_too_few_frames_saw_through_is_not_asked_for() {
    let mut scorer = OccupancyScorer::new(0.5..=4.0);
    let mut asked = |frame: usize| {
        observe(&mut scorer, &RECORDED.frames[frame]);
        let score = scorer.score(&RECORDED.truth, RESOLUTION, &[], |_| Occupancy::Free).unwrap();
        score.free_space.map_or(0, |score| score.points)
    };
    assert_eq!([asked(0), asked(1)], [0, 0]);
    assert!(asked(2) > 0);
}

#[test]
fn a_frame_whose_images_differ_in_size_is_refused() {
    let mut scorer = OccupancyScorer::new(0.5..=4.0);
    let frame = &RECORDED.frames[0];
    let small = Mask::filled(3, 3, false).unwrap();
    let error =
        scorer.observe(&frame.frame, &frame.true_depth, &small, &frame.world_from_camera).unwrap_err();
    assert!(matches!(error, Error::SizeMismatch { actual_width: 3, width: 160, .. }), "{error}");
}
