//! Parts of one surface that no frame shows together: they are one where key frames see that something nearer
//! hides what joins them, and two where key frames look through between them.

use crate::common::{World, camera, level, look_at};
use std::sync::OnceLock;

use dymlm_core::{DepthImage, Frame, Pose, SensorModel};
use dymlm_planes::{DetectedPlane, MapPlane, PlaneConfig, PlaneMap, PlaneMapper};
use proptest::prelude::*;

/// A board over the floor, as deep as a bench. From the eye of [`near`] and [`far`] it hides the floor from y
/// = 1.38 to 1.82.
fn board() -> crate::common::Rectangle {
    level([0.0, 0.1, 0.75], 2.5, 0.1)
}

/// A floor that goes on behind the board.
fn floor() -> World {
    World::of(&[board(), level([0.0, 0.5, 0.0], 2.5, 3.5)])
}

/// Two desks of one height, a lower floor between them, and the board before the gap.
fn desks() -> World {
    let (near, far) = (level([0.0, -0.808, 0.0], 2.5, 2.192), level([0.0, 2.908, 0.0], 2.5, 1.092));
    World::of(&[board(), near, far, level([0.0, 0.5, -0.75], 4.0, 4.5)])
}

fn eye(k: u32) -> [f64; 3] {
    [0.01 * f64::from(k), -1.2, 1.4]
}

/// Down at what is before and under the board, its far rim out of view.
fn near(k: u32) -> Pose {
    look_at(eye(k), [0.0, -0.07, 0.0])
}

/// Over the board at what is behind it, its near rim out of view.
fn far(k: u32) -> Pose {
    look_at(eye(k), [0.0, 0.0, 1.337])
}

/// Into the gap and at what is behind it, from before it: what is before it is out of view.
fn into_gap(k: u32) -> Pose {
    look_at([0.01 * f64::from(k), 1.0, 1.2], [0.0, 2.2, 0.0])
}

fn map_of(world: &World, views: &[Pose]) -> PlaneMap {
    let mut mapper = crate::common::mapper();
    for (k, view) in views.iter().enumerate() {
        let frame = world.frame(camera(), view, k as u64);
        mapper.insert(&frame, None, &[], view).unwrap();
        // What the tests are about: all that this frame sees of the floor or the desks is on one side of the
        // gap.
        let seen = mapper.detector().planes().iter();
        let seen = seen.filter(|plane| plane.plane.transformed(view).normal()[2] > 0.99);
        let places: Vec<[f64; 3]> = seen.map(|plane| view.transform_point(plane.centroid)).collect();
        let is_part = |far: bool| places.iter().any(|at| at[2].abs() < 0.02 && (at[1] > 1.6) == far);
        assert!(!(is_part(true) && is_part(false)), "frame {k} sees both parts: {places:?}");
    }
    mapper.into_map()
}

fn is_level_at_0(plane: &MapPlane) -> bool {
    is_level_at_0_in(plane, &Pose::identity())
}

fn is_level_at_0_in(plane: &MapPlane, new_from_old: &Pose) -> bool {
    new_from_old.rotate(plane.plane().normal())[2] > 0.998
        && new_from_old.transform_point(plane.centroid())[2].abs() < 0.02
}

fn parts(map: &PlaneMap) -> usize {
    parts_in(map, &Pose::identity())
}

fn parts_in(map: &PlaneMap, new_from_old: &Pose) -> usize {
    crate::common::all_planes(map).into_iter().filter(|plane| is_level_at_0_in(plane, new_from_old)).count()
}

fn near_then_far() -> Vec<Pose> {
    (0..4).map(near).chain((4..10).map(far)).collect()
}

#[test]
fn a_floor_that_is_never_seen_whole_is_one_plane() {
    let map = map_of(&floor(), &near_then_far());
    assert_eq!(parts(&map), 1, "{:?}", map.iter().map(MapPlane::centroid).collect::<Vec<_>>());
    let floor = map.iter().find(|plane| is_level_at_0(plane)).unwrap();
    // It holds what is before the board and what is behind, and nothing was made up between.
    assert!(floor.holds([0.0, 0.5, 0.0]) && floor.holds([0.0, 2.5, 0.0]) && !floor.holds([0.0, 1.6, 0.0]));
    assert_eq!(floor.observations(), 10);
    // The order does not matter.
    let turns: Vec<Pose> = (0..10).map(|k| if k % 2 == 0 { far(k) } else { near(k) }).collect();
    assert_eq!(parts(&map_of(&self::floor(), &turns)), 1);
}

#[test]
fn two_desks_between_which_the_floor_is_seen_stay_two() {
    let mut views = Vec::new();
    for k in 0..8 {
        views.extend([near(k), into_gap(k), far(k)]);
    }
    let map = map_of(&desks(), &views);
    assert_eq!(parts(&map), 2, "{:?}", map.iter().map(MapPlane::centroid).collect::<Vec<_>>());
    // A look through the gap is what parts them: behind the board alone they look like one.
    assert_eq!(parts(&map_of(&desks(), &near_then_far())), 1);
}

#[test]
fn desks_of_one_height_on_both_sides_of_a_wall_stay_two() {
    let wall = [1.4, 1.55].map(|y| crate::common::upright([0.0, y, 1.0], 2.0, 1.0));
    let desks = [1.0, 1.95].map(|y| level([0.0, y, 0.0], 0.8, 0.4));
    let world = World::of(&[wall[0], wall[1], desks[0], desks[1]]);
    let mut mapper = crate::common::mapper();
    for k in 0..12 {
        let (x, is_near) = (0.03 * f64::from(k), k % 2 == 0);
        let (eye, target) = if is_near { (-0.2, 1.1) } else { (3.1, 1.8) };
        let view = look_at([x, eye, 0.7], [0.0, target, 0.0]);
        mapper.insert(&world.frame(camera(), &view, k as u64), None, &[], &view).unwrap();
    }
    let map = mapper.into_map();
    assert_eq!(parts(&map), 2, "{:?}", map.iter().map(MapPlane::centroid).collect::<Vec<_>>());
}

#[test]
fn a_gap_too_wide_or_seen_too_seldom_is_not_bridged() {
    let views = near_then_far();
    let parts_with = |change: &dyn Fn(&mut PlaneConfig), views: &[Pose]| {
        let mut config = PlaneConfig::default();
        change(&mut config);
        let mut mapper = PlaneMapper::new(config, SensorModel::kinect()).unwrap();
        for (k, view) in views.iter().enumerate() {
            mapper.insert(&floor().frame(camera(), view, k as u64), None, &[], view).unwrap();
        }
        parts(mapper.map())
    };
    assert_eq!(parts_with(&|config| config.map.association.max_occluded_gap = 0.0, &views), 2);
    assert_eq!(parts_with(&|config| config.map.association.max_occluded_gap = 0.2, &views), 2);
    assert_eq!(parts_with(&|config| config.map.min_observations = 6, &views), 2);
    assert_eq!(parts_with(&|config| config.map.min_observations = 5, &views), 1);
    assert_eq!(parts_with(&|_| (), &views[..6]), 2);
    assert_eq!(parts_with(&|_| (), &views[..7]), 1);
}

#[test]
fn where_nothing_is_read_nothing_is_known_to_be_hidden() {
    let mut mapper = crate::common::mapper();
    for (k, view) in near_then_far().iter().enumerate() {
        let frame = floor().frame(camera(), view, k as u64);
        // The board gives no readings, as a black thing does.
        let is_board = |pixel: usize| {
            let (u, v) = ((pixel % 320) as f64, (pixel / 320) as f64);
            let z = f64::from(frame.depth().data()[pixel]);
            view.transform_point(frame.camera().back_project([u, v], z))[2] > 0.4
        };
        let data = frame.depth().data().iter().enumerate();
        let data = data.map(|(pixel, &z)| if z > 0.0 && is_board(pixel) { f32::NAN } else { z }).collect();
        let depth = DepthImage::new(320, 240, data).unwrap();
        let frame = Frame::new(frame.timestamp(), *frame.camera(), depth, None).unwrap();
        mapper.insert(&frame, None, &[], view).unwrap();
    }
    assert_eq!(parts(mapper.map()), 2);
}

#[test]
fn taking_out_what_saw_it_hidden_parts_the_floor_again() {
    let views = near_then_far();
    let mut mapper = crate::common::mapper();
    let mut key_frames = Vec::new();
    let mut before = Vec::new();
    for (k, view) in views[..7].iter().enumerate() {
        before = crate::common::snapshot(mapper.map());
        let frame = floor().frame(camera(), view, k as u64);
        key_frames.push(mapper.insert(&frame, None, &[], view).unwrap().key_frame);
    }
    assert_eq!((parts(mapper.map()), before.iter().filter(|plane| is_level_at_0(plane)).count()), (1, 2));

    // The third witness: the map is what it was before.
    let mut map = mapper.map().clone();
    map.remove(key_frames[6]).unwrap();
    assert_eq!(crate::common::snapshot(&map), before);

    // Another of the three: the two planes are those that they would be if it had added nothing.
    let mut map = mapper.map().clone();
    map.remove(key_frames[4]).unwrap();
    assert_eq!(parts(&map), 2);
    let mut others = crate::common::mapper();
    for (k, view) in views[..7].iter().enumerate().filter(|(k, _)| *k != 4) {
        let frame = floor().frame(camera(), view, k as u64);
        others.insert(&frame, None, &[], view).unwrap();
    }
    let shape = |map: &PlaneMap| {
        crate::common::all_planes(map)
            .into_iter()
            .map(|plane| {
                (plane.observations(), plane.inlier_voxels(), plane.weight().to_bits(), plane.centroid())
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(shape(&map), shape(others.map()));

    // One that saw the near part only: the floor stays one.
    let mut map = mapper.map().clone();
    map.remove(key_frames[1]).unwrap();
    assert_eq!(parts(&map), 1);
    for key_frame in [6, 0, 4, 2, 3, 5] {
        map.remove(key_frames[key_frame]).unwrap();
    }
    assert!(crate::common::all_planes(&map).is_empty());
}

/// Key frames with their planes.
type Recording = Vec<(Vec<DetectedPlane>, Frame, Pose)>;

/// Those of the floor and of the desks.
fn recordings() -> &'static [Recording; 2] {
    static RECORDINGS: OnceLock<[Recording; 2]> = OnceLock::new();
    RECORDINGS.get_or_init(|| {
        let mut detector = crate::common::detector();
        let mut with_looks = near_then_far();
        with_looks.splice(5..5, (10..13).map(into_gap));
        [(floor(), near_then_far()), (desks(), with_looks)].map(|(world, views)| {
            let mut record = |(k, view): (usize, &Pose)| {
                let frame = world.frame(camera(), view, k as u64);
                let planes = detector.detect(&frame, None, &[]).unwrap().to_vec();
                (planes, frame, *view)
            };
            views.iter().enumerate().map(&mut record).collect()
        })
    })
}

/// Both recordings where they were made and in a world that is turned and shifted against it: whether each
/// key frame does the same in both, and how many parts the floor and the desks have in the one and the other.
fn here_and_there(turn: [f64; 4], shift: [f64; 3]) -> (bool, [[usize; 2]; 2]) {
    let norm = turn.iter().map(|q| q * q).sum::<f64>().sqrt();
    let motion = Pose::new(shift, turn.map(|q| q / norm)).unwrap();
    let mut is_same = true;
    let all_parts = recordings().each_ref().map(|recording| {
        let [mut here, mut there] = [(), ()].map(|()| crate::common::empty_map());
        for (planes, frame, view) in recording {
            let first = here.insert(planes, frame, view).unwrap();
            is_same &= there.insert(planes, frame, &(motion * *view)).unwrap() == first;
        }
        [parts(&here), parts_in(&there, &motion.inverse())]
    });
    (is_same, all_parts)
}

/// Motions for which the cells in which ways across the gap are sought fall so that the shortest ways lie
/// where a look through the gap does not reach, or that a tenth of the cells behind the board is under it.
#[test]
fn what_is_hidden_does_not_depend_on_where_cells_fall() {
    let motions = [
        ([-0.811, -0.006, -0.8, 0.582], [-87.337, -189.968, 254.676]),
        ([-0.286, 0.236, 0.433, -0.942], [-103.895, -306.975, -254.209]),
        ([-0.761, 0.183, 0.512, -0.337], [-95.484, 490.999, -356.081]),
        (
            [
                -0.448_790_817_407_182_4,
                0.187_123_523_043_885_02,
                -0.441_852_029_811_898_4,
                0.009_528_343_826_212_815,
            ],
            [78.584_446_266_286_46, -126.019_757_343_765_14, 377.985_638_329_456_1],
        ),
    ];
    for (turn, shift) in motions {
        assert_eq!(here_and_there(turn, shift), (true, [[1; 2], [2; 2]]), "{turn:?} {shift:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// Wherever the world lies, the same is one plane and the same two.
    #[test]
    fn what_is_hidden_moves_with_its_world(
        turn in prop::array::uniform4(-1.0..1.0_f64),
        shift in prop::array::uniform3(-500.0..500.0_f64),
    ) {
        prop_assume!(turn.iter().map(|q| q * q).sum::<f64>() > 0.01);
        prop_assert_eq!(here_and_there(turn, shift), (true, [[1; 2], [2; 2]]));
    }
}
