//! Tests of a run's page: its contents, that it needs no network, and that its script is built from the
//! current sources.

use std::ffi::OsStr;
use std::fs;
use std::path::Path;

use dymlm::core::Pose;
use dymlm::{MapBuilder, MapConfig};
use dymlm_examples::{CorrectionCost, ReportPage, Run, RunRecorder, RunReport};
use dymlm_io::{StampedPose, Trajectory};
use dymlm_sim::{Activity, Room, SceneEvent, Sequence, SequenceConfig};
use serde_json::Value;

/// Maps a sequence and returns the page, its JSON, and the JSON of a run whose poses were corrected at the end.
fn page_of(config: &SequenceConfig, title: &str) -> (String, Value, Value) {
    let sequence = Sequence::new(config).unwrap();
    let mut builder = MapBuilder::new(MapConfig::default()).unwrap();
    let mut recorder = RunRecorder::start(&builder, sequence.len());
    let (mut reports, mut poses) = (Vec::new(), Vec::new());
    for next in sequence.frames() {
        let pose = next.world_from_camera;
        let report = builder.insert(&next.frame, &next.detections, &pose).unwrap();
        recorder.record(&report, next.frame.camera(), &pose, &builder);
        poses.push(StampedPose { timestamp: report.timestamp, world_from_camera: pose });
        reports.push(report);
    }
    builder.settle();
    let report = RunReport::new(sequence.len(), sequence.len(), &reports, &builder);
    let trajectory = Trajectory::new(poses).unwrap();
    let up = sequence.config().world_from_scene.rotate([0.0, 0.0, 1.0]);
    let (map, frames) = (builder.map(), reports.as_slice());
    let run = Run { title, map, recorder: &recorder, frames, report: &report, trajectory: &trajectory, up };
    let written = |run: &Run<'_>| {
        let mut page = Vec::new();
        ReportPage::of(run).unwrap().write(&mut page).unwrap();
        String::from_utf8(page).unwrap()
    };
    let page = written(&run);
    let cost = CorrectionCost { key_frames: 1, wall_ms: 1.0, cpu_ms: 1.0 };
    let corrected = RunReport { corrections: Some(cost), ..report.clone() };
    let corrected = data_of(&written(&Run { report: &corrected, ..run }));
    let data = data_of(&page);
    (page, data, corrected)
}

fn data_of(page: &str) -> Value {
    let (_, behind) = page.split_once("id=\"page-data\">").unwrap();
    serde_json::from_str(behind.split_once("</script>").unwrap().0).unwrap()
}

fn list<'a>(data: &'a Value, name: &str) -> &'a Vec<Value> {
    data[name].as_array().unwrap()
}

/// The page can request nothing from a network: its only addresses are names of XML namespaces.
fn check_needs_no_network(page: &str) {
    for (at, _) in page.match_indices("://") {
        let before = page[..at].char_indices().rev().take_while(|(_, c)| c.is_ascii_alphabetic()).last();
        let start = before.map_or(at, |(start, _)| start);
        let address: String = page[start..].chars().take(40).collect();
        assert!(address.starts_with("http://www.w3.org/"), "{address}");
    }
    assert!(page.contains("Content-Security-Policy\" content=\"default-src 'none';"));
    for asks in ["<link", "@import", " src=", "url(", "fetch(", "XMLHttpRequest", "WebSocket("] {
        // three's loaders could fetch, but are not called; the policy would refuse them.
        let found = page.matches(asks).count();
        assert!(found == 0 || asks == "fetch(" || asks == "XMLHttpRequest", "{found} of {asks}");
    }
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn a_chair_that_was_pushed_away_is_told_of() {
    let mut config = SequenceConfig::random_room(8);
    (config.room, config.world_from_scene) = (Room::Office, Pose::identity());
    (config.activity, config.people) = (Activity::Walking, 1);
    config.events = vec![SceneEvent::PushedChair];
    (config.frames, config.frame_rate) = (60, 5.0);
    let (page, data, corrected) = page_of(&config, "a chair & more");
    check_needs_no_network(&page);
    assert!(page.contains("<title>a chair &amp; more: maps by dymlm</title>"));

    // Ways and places of before a correction lie beside the maps.
    for name in ["gone", "movers"] {
        assert!(!list(&data, name).is_empty() && list(&corrected, name).is_empty(), "{name}");
    }
    let objects = list(&data, "objects");
    assert!(objects.len() >= 3, "{objects:?}");
    let events = |thing: &Value| -> Vec<String> {
        let kinds = thing["events"].as_array().unwrap().iter();
        kinds.map(|event| event["kind"].as_str().unwrap().to_owned()).collect()
    };
    for object in objects {
        let events = events(object);
        assert!(events.iter().any(|kind| kind == "created") && events.iter().any(|kind| kind == "confirmed"));
    }
    let times = |object: &Value| {
        let times = object["events"].as_array().unwrap().iter().map(|event| event["time"].as_f64().unwrap());
        times.collect::<Vec<_>>()
    };
    assert!(objects.iter().all(|object| times(object).is_sorted()));

    // The truth: the chair's old and new place.
    let change = Sequence::new(&config).unwrap().changes().remove(0);
    let [before, after] = [change.before.unwrap(), change.after.unwrap()].map(|place| place.center());
    let chair = list(&data, "gone").iter().find(|object| object["label"] == "chair").unwrap();
    let place = |value: &Value| -> [f64; 3] { serde_json::from_value(value.clone()).unwrap() };
    let distance = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    assert!(distance(place(&chair["translation"]), before) < 0.4, "{chair}, {before:?}");
    assert!(events(chair).iter().any(|kind| kind == "removed"), "{chair}");
    let moved = objects
        .iter()
        .flat_map(|object| object["events"].as_array().unwrap())
        .find(|event| event["kind"] == "moved")
        .unwrap_or_else(|| panic!("{objects:?}"));
    assert!(
        distance(place(&moved["from"]), before) < 0.4 && distance(place(&moved["to"]), after) < 0.4,
        "{moved}"
    );
}

#[test]
fn an_empty_map_has_a_page() {
    let builder = MapBuilder::new(MapConfig::default()).unwrap();
    let recorder = RunRecorder::start(&builder, 0);
    let report = RunReport::new(0, 0, &[], &builder);
    let pose = StampedPose { timestamp: 0.0, world_from_camera: Pose::identity() };
    let trajectory = Trajectory::new(vec![pose]).unwrap();
    // No direction is up.
    let run = Run {
        title: "nothing",
        map: builder.map(),
        recorder: &recorder,
        frames: &[],
        report: &report,
        trajectory: &trajectory,
        up: [f64::NAN; 3],
    };
    let mut page = Vec::new();
    ReportPage::of(&run).unwrap().write(&mut page).unwrap();
    let page = String::from_utf8(page).unwrap();
    check_needs_no_network(&page);
    let data = data_of(&page);
    assert_eq!(data["up"], serde_json::json!([0.0, 0.0, 1.0]));
    for name in ["planes", "objects", "gone", "movers"] {
        assert!(list(&data, name).is_empty());
    }
    for name in ["cloud", "octree", "removed"] {
        assert_eq!(data[name]["count"], 0);
    }
    assert!(!page.contains("NaN,") && !data["floor"].is_null());
}

/// The checksum at the top of the bundle is that of the current sources: it differs if they changed without
/// `npm run build`. `npm run check` verifies that the bundle's bytes are the build's output.
#[test]
fn the_bundle_is_of_these_sources() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("report_page");
    let mut names: Vec<String> = fs::read_dir(folder.join("src"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| Path::new(name).extension() == Some(OsStr::new("js")))
        .map(|name| format!("src/{name}"))
        .collect();
    names.sort();
    names.push("package-lock.json".to_owned());
    let mut checksum = crc32fast::Hasher::new();
    for name in names {
        checksum.update(&fs::read(folder.join(name)).unwrap());
    }
    let bundle = fs::read_to_string(folder.join("page.js")).unwrap();
    let expected = format!("/*! sources {:08x}; made by npm run build", checksum.finalize());
    assert!(bundle.starts_with(&expected), "{expected}: run npm run build in examples/report_page");
    // three's licence requires its notice.
    assert!(bundle.contains("The MIT License") && bundle.contains("three.js authors"));
    assert!(!bundle.contains("</script"), "it would end its element");
}
