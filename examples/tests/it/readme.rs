//! Tests what the README says about config files.

use dymlm::MapConfig;
use dymlm::dynamics::MaskMode;

#[test]
fn its_config_file_is_accepted() {
    let readme = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../README.md")).unwrap();
    let block = readme.split("```toml").nth(1).unwrap().split("```").next().unwrap();
    let config = MapConfig::from_toml(block).unwrap();
    assert_eq!(config.cloud.voxel_size, 0.02);
    assert_eq!(config.dynamics.mask.mode, MaskMode::Box);
}

#[test]
fn the_default_config_survives_toml_and_json() {
    let config = MapConfig::default();
    assert_eq!(toml::from_str::<MapConfig>(&toml::to_string(&config).unwrap()).unwrap(), config);
    assert_eq!(serde_json::from_str::<MapConfig>(&serde_json::to_string(&config).unwrap()).unwrap(), config);
}
