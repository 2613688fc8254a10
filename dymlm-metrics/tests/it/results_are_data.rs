//! Scores and truth can be sent between threads and copied.

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
