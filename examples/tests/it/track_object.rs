//! Tests of the program `track_object --dataset`: a recording in which a thing stands still.

use std::process::Command;

use dymlm::core::PinholeCamera;
use dymlm_io::{Trajectory, TumWriter};
use dymlm_sim::{CameraPath, CarriedKind, CarriedMotion, CarriedObject, Sequence, SequenceConfig};

use crate::example_program::example_program;

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn what_stands_in_a_recording_stays_at_rest() {
    let Some(program) = example_program("track_object") else { return };

    // The book stands for the first second, and no hand is near for the first nine tenths of it.
    let mut config = SequenceConfig::default();
    config.people = 0;
    config.frame_rate = 30.0;
    config.frames = 24;
    config.camera = Some(PinholeCamera::new(320, 240, 262.5, 262.5, 159.5, 119.5).unwrap());
    config.path = CameraPath::Static;
    config.carried = Some(CarriedObject::new(CarriedKind::Book, CarriedMotion::Translation));
    let sequence = Sequence::new(&config).unwrap();
    let parent = tempfile::tempdir().unwrap();
    let (dataset, out) = (parent.path().join("dataset"), parent.path().join("out"));
    let mut writer = TumWriter::create(&dataset, sequence.camera()).unwrap();
    for frame in sequence.frames() {
        writer.write(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
    }
    writer.finish().unwrap();

    let run = |object: &str| {
        let [dataset, out] = [&dataset, &out].map(|path| path.to_str().unwrap());
        Command::new(&program)
            .args(["--dataset", dataset, "--object", object, "--map-until", "0.4", "--out", out])
            .output()
            .unwrap()
    };
    let followed = run("book");
    let text = String::from_utf8_lossy(&followed.stdout);
    assert!(followed.status.success(), "{}", String::from_utf8_lossy(&followed.stderr));
    assert!(text.contains("lost 0 times") && text.contains("it was not put down"), "{text}");
    let poses = Trajectory::read(out.join("poses_book.txt")).unwrap();
    assert!(poses.poses().len() >= 8, "{text}");
    let first = poses.poses()[0].world_from_camera;
    assert!(poses.poses().iter().all(|pose| pose.world_from_camera.distance(&first) < 0.01), "{text}");
    assert!(out.join("object_tracking.png").exists());

    let missing = run("giraffe");
    assert!(!missing.status.success());
    assert!(String::from_utf8_lossy(&missing.stderr).contains("no giraffe"), "{missing:?}");
}
