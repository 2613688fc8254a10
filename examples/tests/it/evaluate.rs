//! Tests of the program `evaluate`: a floor plan becomes a building whose map is scored.

use std::path::Path;
use std::process::{Command, Output};

use crate::example_program::example_program;

/// Runs the program; `None` if it is not built.
fn evaluate(arguments: &[&str]) -> Option<Output> {
    Some(Command::new(example_program("evaluate")?).args(arguments).output().unwrap())
}

/// Writes `plan.yaml` and `plan.pgm` of a room of 5 x 4 m.
fn write_plan(folder: &Path, origin: &str) -> String {
    const SIZE: [usize; 2] = [54, 44];
    let is_wall = |k: usize| {
        let [x, y] = [k % SIZE[0], k / SIZE[0]];
        x < 2 || y < 2 || x >= SIZE[0] - 2 || y >= SIZE[1] - 2
    };
    let pixels: Vec<u8> = (0..SIZE[0] * SIZE[1]).map(|k| if is_wall(k) { 0 } else { 254 }).collect();
    let header = format!("P5\n{} {}\n255\n", SIZE[0], SIZE[1]);
    std::fs::write(folder.join("plan.pgm"), [header.as_bytes(), &pixels].concat()).unwrap();
    let yaml = format!(
        "image: plan.pgm\nmode: trinary\nresolution: 0.1\norigin: {origin}\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    );
    let path = folder.join("plan.yaml");
    std::fs::write(&path, yaml).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn a_floor_plan_becomes_a_building() {
    let folder = tempfile::tempdir().unwrap();
    let plan = write_plan(folder.path(), "[-1.0, 2.0, 0.0]");
    let out = folder.path().join("out");
    let arguments = ["--floor-plan", &plan, "--seed", "3", "--frames", "40", "--every", "4", "--no-times"];
    let Some(done) = evaluate(&[&arguments[..], &["--out", out.to_str().unwrap()]].concat()) else { return };
    let said = String::from_utf8(done.stdout.clone()).unwrap();
    assert!(done.status.success(), "{done:?}");
    assert!(said.contains("4 faces of walls") && said.contains("plan_plan_3"), "{said}");
    assert!(out.join("map_plan_plan_3.png").is_file() && out.join("evaluation.json").is_file());
}

#[test]
fn what_is_no_floor_plan_is_refused_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let refused = |plan: &str| {
        let done = evaluate(&["--floor-plan", plan, "--out", out.to_str().unwrap()])?;
        assert!(!done.status.success(), "{done:?}");
        Some(String::from_utf8(done.stderr).unwrap())
    };
    let turned = write_plan(folder.path(), "[0, 0, 0.5]");
    let Some(said) = refused(&turned) else { return };
    assert!(said.contains("plan.yaml") && said.contains("turned by 0.5 radians"), "{said}");
    let plan = write_plan(folder.path(), "[0, 0, 0]");
    std::fs::write(folder.path().join("plan.pgm"), b"P5 9 9 255\n").unwrap();
    let said = refused(&plan).unwrap();
    assert!(said.contains("plan.pgm") && said.contains("ends after 0 of its 9x9 pixels"), "{said}");
    let full = [&b"P5 9 9 255\n"[..], &[0; 81]].concat();
    std::fs::write(folder.path().join("plan.pgm"), full).unwrap();
    let said = refused(&plan).unwrap();
    assert!(said.contains("plan.yaml") && said.contains("no free cell"), "{said}");
    let none = folder.path().join("none.yaml");
    assert!(refused(none.to_str().unwrap()).unwrap().contains("none.yaml"));
}

#[test]
fn options_that_would_be_ignored_are_refused() {
    let ignored: [&[&str]; 10] = [
        &["--recordings", "1", "--every", "2"],
        &["--recordings", "1", "--baseline"],
        &["--recordings", "1", "--no-detections"],
        &["--recordings", "1", "--min-score", "0.5"],
        &["--recordings", "1", "--pose-noise"],
        &["--recordings", "1", "--drift-share", "0.05"],
        &["--recordings", "1", "--recorded-drift", "a", "--true-path", "b"],
        &["--recordings", "1", "--detector-rate", "5"],
        &["--quick", "--every", "3"],
        &["--detections", "found.jsonl"],
    ];
    for arguments in ignored {
        // Were it not refused, the run would end before any work: the output folder lies in a file.
        let Some(done) = evaluate(&[arguments, &["--out", "Cargo.toml/none"]].concat()) else { return };
        let said = String::from_utf8(done.stderr).unwrap();
        assert!(!done.status.success(), "{arguments:?}");
        assert!(said.contains("cannot be used with") || said.contains("were not provided"), "{said}");
    }
}

/// A building runs at `--rate`: its detector cannot be faster, and a rate that fits is taken from that.
#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn a_detector_runs_at_a_share_of_the_sequence_s_own_rate() {
    let folder = tempfile::tempdir().unwrap();
    let plan = write_plan(folder.path(), "[0, 0, 0]");
    let out = folder.path().join("out");
    let out = out.to_str().unwrap();
    let arguments = ["--floor-plan", &plan, "--frames", "40", "--every", "4", "--no-times", "--out", out];
    let with = |rate: &str| evaluate(&[&arguments[..], &["--detector-rate", rate]].concat());
    let Some(refused) = with("10") else { return };
    let said = String::from_utf8(refused.stderr).unwrap();
    assert!(!refused.status.success() && said.contains("--detector-rate 10"), "{said}");
    let done = with("0.625").unwrap();
    let said = String::from_utf8(done.stdout.clone()).unwrap();
    assert!(done.status.success() && said.contains("detections in 1 of 2 frames"), "{said} {done:?}");
}
