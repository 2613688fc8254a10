//! Configs: what is refused, and what a file may hold.
use dymlm_core::SensorModel;
use dymlm_objects::{Error, ObjectConfig, ObjectMapper};

#[test]
fn each_part_names_its_field() {
    let refused = |change: fn(&mut ObjectConfig)| {
        let mut config = ObjectConfig::default();
        change(&mut config);
        match ObjectMapper::new(config, SensorModel::kinect()).unwrap_err() {
            Error::Config(error) => error.field,
            other => panic!("{other}"),
        }
    };
    assert_eq!(
        refused(|config| config.parameterization.min_score = 2.0),
        "objects.parameterization.min_score"
    );
    assert_eq!(refused(|config| config.association.alpha = f64::NAN), "objects.association.alpha");
    assert_eq!(refused(|config| config.update.min_observations = 0), "objects.update.min_observations");
    assert_eq!(refused(|config| config.update.isolation_forest.trees = 0), "isolation_forest.trees");
}

#[cfg(feature = "serde")]
#[test]
fn a_config_survives_a_file() {
    use dymlm_objects::{CentroidTest, Footprint, ShapeKind, SizePrior};

    let mut config = ObjectConfig::default();
    config.association.centroid_test = CentroidTest::OneSampleT;
    config.shapes.set("chair", ShapeKind::Cuboid);
    let [length, width, height] = [[0.4, 0.5, 0.6], [0.3, 0.35, 0.4], [0.2, 0.3, 1.0]].map(Into::into);
    config.sizes.insert(SizePrior::new("robot", length, width, height, Footprint::Oblong));
    let text = serde_json::to_string(&config).unwrap();
    assert_eq!(serde_json::from_str::<ObjectConfig>(&text).unwrap(), config);
    // What is left out has its default; what nobody knows is refused.
    let partly: ObjectConfig = serde_json::from_str(r#"{"update": {"voxel_size": 0.02}}"#).unwrap();
    assert_eq!((partly.update.voxel_size, partly.update.max_voxels), (0.02, 2500));
    assert!(serde_json::from_str::<ObjectConfig>(r#"{"update": {"voxel": 0.02}}"#).is_err());
}

#[cfg(feature = "serde")]
#[test]
fn one_entry_of_a_file_does_not_forget_the_others() {
    use dymlm_objects::ShapeKind;

    let config: ObjectConfig = serde_json::from_str(
        r#"{
            "sizes": [{"label": "robot", "length": [0.4, 0.5, 0.6], "width": [0.3, 0.35, 0.4],
                       "height": [0.2, 0.3, 1.0], "footprint": "oblong"}],
            "shapes": {"robot": "cuboid", "book": "ellipsoid"}
        }"#,
    )
    .unwrap();
    assert!(config.sizes.of("robot").is_some() && config.sizes.of("cup").is_some());
    assert_eq!(config.sizes.iter().count(), ObjectConfig::default().sizes.iter().count() + 1);
    let shape = |label: &str| config.shapes.of(label);
    assert_eq!(
        [shape("robot"), shape("tv"), shape("book")],
        [ShapeKind::Cuboid, ShapeKind::Cuboid, ShapeKind::Ellipsoid]
    );
}
