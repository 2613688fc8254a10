//! Config files: presets, and mistakes that are named with their lines.
#![cfg(feature = "io")]
use dymlm::MapConfig;
use dymlm::core::SensorModel;

fn error(text: &str) -> String {
    MapConfig::from_toml(text).unwrap_err().to_string()
}

#[test]
fn an_unknown_field_is_named_with_its_line_also_below_a_preset() {
    for first in ["", "preset = \"robot\""] {
        let error = error(&format!("{first}\n[cloud]\nvoxel_sise = 0.03\n"));
        assert!(error.contains("line 3") && error.contains("voxel_sise"), "{error}");
    }
}

#[test]
fn a_preset_that_does_not_exist_is_refused_by_name() {
    assert!(error("preset = \"fast\"").starts_with("preset = fast:"));
    assert!(error("preset = 3").starts_with("preset = 3:"));
    assert!(error("max_detection_delay = 1.0\n[preset]\nname = \"robot\"").starts_with("preset = "));
}

#[test]
fn what_a_file_leaves_out_is_as_in_its_preset() {
    assert_eq!(MapConfig::from_toml("").unwrap(), MapConfig::default());
    assert_eq!(MapConfig::from_toml("preset = \"offline\"").unwrap(), MapConfig::offline());
    let config = MapConfig::from_toml(
        "publish_interval = 1.0\npreset = \"robot\" # below other fields\n[sensor]\npreset = \"kinect\"\nmax_depth = 4.0",
    )
    .unwrap();
    let mut expected = MapConfig::robot();
    expected.publish_interval = 1.0;
    expected.sensor = SensorModel { max_depth: 4.0, ..SensorModel::kinect() };
    assert_eq!(config, expected);
}
