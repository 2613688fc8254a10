use std::collections::BTreeMap;

use dymlm_core::{PlaneId, Pose};
use dymlm_refine::PlaneView;

use super::odometry_drift::{OdometryDrift, REACH, quadratic};
use super::patch::Patch;

/// What key frames have seen of a plane of the map, from when it came into view until it was out of view for
/// so long that poses may have drifted further than planes are associated.
///
/// When it comes into view again, drift may have brought another plane to its place. Whether two visits show
/// one plane is one question, however many views they have.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlaneVisit<'a> {
    /// The plane of the map.
    pub(super) plane: PlaneId,
    /// In the order of the key frames.
    pub(super) views: &'a [PlaneView],
}

/// The visits to each plane of the map, those to one plane side by side, in the order of time; `max_distance`:
/// within which the map associates planes, metres.
pub(super) fn plane_visits<'a>(
    views: &'a BTreeMap<PlaneId, Vec<PlaneView>>,
    poses: &[Pose],
    drift: &OdometryDrift,
    max_distance: f64,
) -> Vec<PlaneVisit<'a>> {
    let goes_on = |before: &PlaneView, view: &PlaneView| {
        let Some(patch) = Patch::new(view, poses) else { return true };
        // 0 between views of one key frame.
        let drift = drift.between(before.pose..view.pose, patch.centroid);
        REACH * quadratic(&drift.translation, patch.normal).max(0.0).sqrt() <= max_distance
    };
    let of_plane = |(plane, views): (&PlaneId, &'a Vec<PlaneView>)| {
        let plane = *plane;
        views.chunk_by(goes_on).map(move |views| PlaneVisit { plane, views }).collect::<Vec<_>>()
    };
    views.iter().flat_map(of_plane).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_visit_ends_when_the_poses_may_have_drifted_further_than_planes_are_associated() {
        let poses = vec![Pose::identity(); 60];
        // After a second 1 cm along each axis, so that 3 deviations are 5 cm after 2.8 seconds.
        let drift = OdometryDrift::new(&poses, (0..59).map(|_| [0.0, 0.01]));
        let covariance = [1.0 / 3.0, 0.0, 0.0, 1.0 / 3.0, 0.0, 0.0];
        let view = |pose| PlaneView { pose, information: 1e5, centroid: [0.0, 0.0, 3.0], covariance };
        let visits = |key_frames: &[usize]| {
            let of_each: Vec<PlaneView> = key_frames.iter().map(|pose| view(*pose)).collect();
            let views = [4, 6].map(|id| (PlaneId::new(id), of_each.clone())).into_iter().collect();
            let visits = plane_visits(&views, &poses, &drift, 0.05);
            let of = |id: u64| {
                let own = visits.iter().filter(|visit| visit.plane == PlaneId::new(id));
                own.map(|visit| visit.views.len()).collect::<Vec<_>>()
            };
            assert_eq!((of(4), of(4).len() * 2), (of(6), visits.len()));
            of(4)
        };
        assert_eq!(visits(&[0, 1, 3, 5, 5, 7]), [6]);
        assert_eq!(visits(&[0, 3, 5, 20, 21, 50]), [1, 2, 2, 1]);
        assert!(visits(&[]).is_empty());
    }
}
