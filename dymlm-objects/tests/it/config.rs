//! Configs: what is refused, and what a file may hold.
use dymlm_core::SensorModel;
use dymlm_objects::{Error, Footprint, ObjectConfig, ObjectMapper, SizePrior};

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
    assert_eq!(
        refused(|config| config.parameterization.max_support_slope = 0.0),
        "objects.parameterization.max_support_slope"
    );
    assert_eq!(refused(|config| config.update.min_observations = 0), "objects.update.min_observations");
    assert_eq!(refused(|config| config.update.isolation_forest.trees = 0), "isolation_forest.trees");
}

/// Of a thing so described no size would be the usual one.
#[test]
fn sizes_that_are_no_ranges_are_refused() {
    let usual = [0.3, 0.4, 0.5];
    let refused = |sizes: [[f64; 3]; 3]| {
        let [length, width, height] = sizes.map(Into::into);
        let mut config = ObjectConfig::default();
        config.sizes.insert(SizePrior::new("robot", length, width, height, Footprint::Even));
        match ObjectMapper::new(config, SensorModel::kinect()) {
            Err(Error::Config(error)) => Some(error.field),
            _ => None,
        }
    };
    assert_eq!(refused([usual; 3]), None);
    assert_eq!(refused([[0.4; 3]; 3]), None);
    let no_ranges = [
        [0.5, 0.4, 0.3],
        [0.3, 0.6, 0.5],
        [0.3, 0.2, 0.5],
        [0.0, 0.4, 0.5],
        [-0.3, 0.4, 0.5],
        [f64::NAN, 0.4, 0.5],
        [0.3, f64::NAN, 0.5],
        [0.3, 0.4, f64::NAN],
        [0.3, 0.4, f64::INFINITY],
        [300.0, 350.0, 400.0],
        [f64::INFINITY; 3],
    ];
    for range in no_ranges {
        assert_eq!(refused([range, usual, usual]), Some("objects.sizes.length"), "{range:?}");
        assert_eq!(refused([usual, range, usual]), Some("objects.sizes.width"), "{range:?}");
        assert_eq!(refused([usual, usual, range]), Some("objects.sizes.height"), "{range:?}");
    }
    // The shorter side is nowhere as short as the longer one.
    assert_eq!(refused([usual, [0.6, 0.7, 0.8], usual]), Some("objects.sizes.width"));
}

#[cfg(feature = "serde")]
#[test]
fn a_config_survives_a_file() {
    use dymlm_objects::{CentroidTest, ShapeKind};

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
