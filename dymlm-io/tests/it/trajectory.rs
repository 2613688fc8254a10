//! Trajectories: interpolation against scipy, round trips, bad files.
use std::fs;

use dymlm_core::Pose;
use dymlm_io::{Error, StampedPose, Trajectory, UncoveredTime};
use proptest::prelude::*;

fn stamped(timestamp: f64, translation: [f64; 3], quaternion: [f64; 4]) -> StampedPose {
    StampedPose { timestamp, world_from_camera: Pose::new(translation, quaternion).unwrap() }
}

/// Values of scipy 1.17.1: `Slerp(t, Rotation.from_quat(q))` for the rotations (sign chosen so that w >= 0),
/// `numpy.interp` for the translations, of three poses at 0, 0.2 and 0.5 s. The last quaternion is negated,
/// which is the same rotation.
#[test]
fn interpolates_as_scipy_does() {
    let trajectory = Trajectory::new(vec![
        stamped(
            0.0,
            [-0.3147126, 0.0021861, 0.3057822],
            [-0.0036657199869534747, -0.16087848942742347, -0.13950505950349282, 0.9770583465225886],
        ),
        stamped(0.2, [1.0, 2.0, 3.0], [0.5, -0.5, 0.5, 0.5]),
        stamped(
            0.5,
            [-1.0, 0.5, 10.0],
            [0.10259783520851541, 0.20519567041703082, -0.3077935056255462, -0.9233805168766387],
        ),
    ])
    .unwrap();
    let expected = [
        (
            0.05,
            [0.013965549999999993, 0.501639575, 0.97933665],
            [0.14659545245175146, -0.28101541435974897, 0.03562516119441993, 0.947771574854699],
        ),
        (
            0.13,
            [0.53985059, 1.300765135, 2.05702377],
            [0.3620675726680555, -0.43022613118603625, 0.30579932959566863, 0.7683093900804527],
        ),
        (0.2, [1.0, 2.0, 3.0], [0.5, -0.5, 0.5, 0.5]),
        (
            0.35,
            [0.0, 1.25, 6.5],
            [0.21765181368461006, -0.38622617153918964, 0.44241762415738284, 0.7795663398665421],
        ),
        (
            0.47,
            [-0.8, 0.65, 9.3],
            [-0.03817519329498045, -0.24539819614241778, 0.3399226592882172, 0.9070694381630136],
        ),
    ];
    for (time, translation, quaternion) in expected {
        let pose = trajectory.pose_at(time, 1.0).unwrap();
        let found = pose.quaternion();
        let sign = found[3].signum();
        for (found, expected) in pose.translation().iter().zip(translation) {
            assert!((found - expected).abs() < 1e-12, "{time}: {pose:?}");
        }
        for (found, expected) in found.iter().zip(quaternion) {
            assert!((sign * found - expected).abs() < 1e-12, "{time}: {pose:?}");
        }
    }
}

#[test]
fn never_extrapolates() {
    let trajectory = Trajectory::new(vec![
        stamped(2.0, [2.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]),
        stamped(1.0, [1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]),
    ])
    .unwrap();
    assert_eq!(trajectory.pose_at(0.9, 5.0), Err(UncoveredTime::Before { timestamp: 0.9, first: 1.0 }));
    assert_eq!(trajectory.pose_at(2.1, 5.0), Err(UncoveredTime::After { timestamp: 2.1, last: 2.0 }));
    assert!(matches!(trajectory.pose_at(1.5, 0.9), Err(UncoveredTime::Gap { from: 1.0, to: 2.0, .. })));
    assert!(trajectory.pose_at(f64::NAN, 5.0).is_err());
    assert!(trajectory.pose_at(f64::INFINITY, 5.0).is_err());
    assert_eq!(Trajectory::default().pose_at(1.0, 5.0), Err(UncoveredTime::Empty { timestamp: 1.0 }));
    // A time with fewer digits still means the pose's own time, beside a gap and at the ends.
    for (time, x) in [(0.99996, 1.0), (1.00004, 1.0), (1.99997, 2.0), (2.00003, 2.0)] {
        assert_eq!(trajectory.pose_at(time, 0.1).unwrap().translation()[0], x, "{time}");
    }
    assert_eq!(trajectory.gaps(0.5).len(), 1);
    assert!(trajectory.gaps(1.0).is_empty());
}

#[test]
fn writes_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("poses.txt");
    let written =
        Trajectory::new(vec![stamped(1305031102.175304, [0.1, -2.0, 3.0], [0.5, -0.5, 0.5, 0.5])]).unwrap();
    written.write(&path).unwrap();
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.ends_with("\n1305031102.175304 0.1 -2 3 0.5 -0.5 0.5 0.5\n"), "{text}");
    assert_eq!(Trajectory::read(&path).unwrap(), written);
}

#[test]
fn refuses_times_that_are_none() {
    let pose = stamped(f64::NAN, [0.0; 3], [0.0, 0.0, 0.0, 1.0]);
    assert!(matches!(Trajectory::new(vec![pose]), Err(dymlm_core::Error::Timestamp(_))));
}

#[test]
fn a_bad_line_is_an_error_naming_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("poses.txt");
    let good = "# comment\n1.0 0 0 0 0 0 0 1\n";
    for (bad, said) in [
        ("2.0 0 0 0 0 0 1", "7 columns"),
        ("2.0 0 0 0 0 0 0 1 9", "9 columns"),
        ("2.0 0 0 0 0 0 0 0", "norm 0"),
        ("2.0 0 0 0 0.5 0.5 0.5 0.7", "norm"),
        ("nan 0 0 0 0 0 0 1", "\"nan\" is no finite number"),
        ("2.0 0 inf 0 0 0 0 1", "\"inf\" is no finite number"),
        ("2.0 0 x 0 0 0 0 1", "\"x\" is no finite number"),
        ("2,0 0 0 0 0 0 0 1", "\"2,0\" is no finite number"),
        ("1.0 7 0 0 0 0 0 1", "another pose for 1 s than line 2"),
    ] {
        fs::write(&path, format!("{good}{bad}\n3.0 0 0 0 0 0 0 1\n")).unwrap();
        let error = Trajectory::read(&path).unwrap_err();
        assert!(matches!(error, Error::Line { line: 3, .. }), "{error}");
        assert!(error.to_string().contains(said), "{error}");
    }
    fs::write(&path, b"1.0 0 0 0 0 0 0 1\n\xff\xfe\n").unwrap();
    assert!(matches!(Trajectory::read(&path), Err(Error::Line { line: 2, .. })));
    // The same pose given twice is not a contradiction.
    fs::write(&path, format!("{good}1.0 0 0 0 0 0 0 1\r\n")).unwrap();
    assert_eq!(Trajectory::read(&path).unwrap().poses().len(), 1);
    assert!(matches!(Trajectory::read(folder.path().join("none.txt")), Err(Error::Io { .. })));
}

fn any_pose() -> impl Strategy<Value = StampedPose> {
    (
        0.0..2e9_f64,
        prop::array::uniform3(-1e4..1e4_f64),
        prop::array::uniform4(-1.0..1.0_f64)
            .prop_filter("a direction", |q| q.iter().map(|x| x * x).sum::<f64>() > 1e-3),
    )
        .prop_map(|(timestamp, translation, q)| {
            let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
            stamped(timestamp, translation, q.map(|x| x / norm))
        })
}

proptest! {
    #[test]
    fn reads_what_it_wrote(poses in prop::collection::vec(any_pose(), 0..40)) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("poses.txt");
        let written = Trajectory::new(poses).unwrap();
        let mut bytes = Vec::new();
        written.encode(&mut bytes).unwrap();
        fs::write(&path, bytes).unwrap();
        let read = Trajectory::read(&path).unwrap();
        prop_assert_eq!(read.poses().len(), written.poses().len());
        for (a, b) in read.poses().iter().zip(written.poses()) {
            prop_assert_eq!(a.timestamp, b.timestamp);
            prop_assert_eq!(a.world_from_camera.translation(), b.world_from_camera.translation());
            // Reading normalizes the quaternion, which may change the last bit.
            prop_assert!(a.world_from_camera.angle(&b.world_from_camera) < 1e-7);
        }
    }

    #[test]
    fn no_file_makes_it_panic(bytes in prop::collection::vec(prop_oneof![Just(b' '), Just(b'\n'), Just(b'1'), any::<u8>()], 0..300)) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("poses.txt");
        fs::write(&path, bytes).unwrap();
        let _ = Trajectory::read(&path);
    }
}
