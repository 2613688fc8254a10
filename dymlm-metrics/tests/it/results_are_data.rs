//! Scores and truth can be sent between threads, most can be copied, and read back they are valid.

use dymlm_metrics::{
    CloudScore, DynamicMapScorer, MaskScore, ObjectScore, OccupancyScorer, PlaneScore, PointTruth,
    ReferenceCloud, TrackingScorer, TrueFace, TrueObject, WallScore,
};

#[test]
fn scorers_and_scores_are_send_sync_and_clone() {
    fn shared<T: Send + Sync>() {}
    fn copied<T: Send + Sync + Clone>() {}
    shared::<PointTruth>();
    copied::<(CloudScore, DynamicMapScorer, MaskScore, ObjectScore, OccupancyScorer)>();
    copied::<(PlaneScore, ReferenceCloud, TrackingScorer, TrueFace, TrueObject, WallScore)>();
}

/// Regression: faces without columns were read, and panicked when they were scored.
#[cfg(feature = "serde")]
#[test]
fn a_raster_without_cells_is_not_read() {
    let corners = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]].into_iter();
    let raster = dymlm_metrics::CellRaster::around(corners, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], 0.1).unwrap();
    let written = serde_json::to_value(&raster).unwrap();
    let read = |value: serde_json::Value| serde_json::from_value::<dymlm_metrics::CellRaster>(value);
    assert_eq!(read(written.clone()).unwrap(), raster);
    for count in ["columns", "rows"] {
        let mut damaged = written.clone();
        damaged[count] = 0.into();
        assert!(read(damaged).is_err(), "{count}");
    }
}
