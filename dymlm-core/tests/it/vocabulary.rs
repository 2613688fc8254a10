//! What holds for all types: they cross threads, and what is written is read back.
use dymlm_core::{
    BoundingBox, ColorImage, ConfigError, DepthImage, DepthRegistration, DepthView, Detection, Distortion,
    Error, Frame, FrameId, Letterbox, Mask, ObjectId, OrganizedCloud, PinholeCamera, Plane, PlaneId,
    PointCloud, Pose, Rectifier, SensorModel, Sighting, SplitMix64, SymmetricEigen3, TrackId,
};

#[test]
fn all_types_may_cross_threads_and_be_cloned() {
    fn check<T: Send + Sync + Clone>() {}
    check::<(BoundingBox, ColorImage, DepthImage, Detection, Frame, Mask, PointCloud, OrganizedCloud)>();
    check::<(PinholeCamera, Pose, Plane, SensorModel, DepthView<'_>, Sighting, SymmetricEigen3)>();
    check::<(Distortion, Rectifier, DepthRegistration, Letterbox, SplitMix64)>();
    check::<(FrameId, ObjectId, PlaneId, TrackId, Error, ConfigError)>();
}

#[cfg(feature = "serde")]
mod serde {
    use dymlm_core::{Distortion, Plane, PointCloud, Visibility};

    fn read_back<T: serde::Serialize + serde::de::DeserializeOwned>(value: &T) -> T {
        serde_json::from_str(&serde_json::to_string(value).unwrap()).unwrap()
    }

    #[test]
    fn values_are_read_back_as_they_were_written() {
        let plane = Plane::new([0.3, -1.7, 0.9], 1.1).unwrap();
        assert_eq!(read_back(&plane), plane);
        let cloud = PointCloud::with_colors(vec![[0.1, 0.2, 0.3]], vec![[1, 2, 3]]).unwrap();
        assert_eq!(read_back(&cloud), cloud);
        for lens in [
            Distortion::brown_conrady(&[0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]).unwrap(),
            Distortion::equidistant([0.1, 0.2, 0.3, 0.4]).unwrap(),
        ] {
            assert_eq!(read_back(&lens), lens);
        }
        assert_eq!(serde_json::to_string(&Visibility::NoReading).unwrap(), "\"no_reading\"");
    }

    #[test]
    fn what_would_be_refused_is_not_read() {
        assert!(serde_json::from_str::<Plane>(r#"{"normal": [0, 0, 0], "d": 1}"#).is_err());
        let colors = r#"{"points": [[0, 0, 0]], "colors": []}"#;
        assert!(serde_json::from_str::<PointCloud>(colors).is_err());
        for lens in [
            r#"{"model": "equidistant", "coefficients": [0, 0]}"#,
            r#"{"model": "fov", "coefficients": [0]}"#,
            r#"{"model": "brown_conrady", "coefficients": [0, 0, 0, 1e9]}"#,
        ] {
            assert!(serde_json::from_str::<Distortion>(lens).is_err(), "{lens}");
        }
    }
}
