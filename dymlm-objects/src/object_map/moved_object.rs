use std::sync::Arc;

use dymlm_core::Pose;

use super::{BoxMotion, CentroidCloud, FULL, MapObject, ViewWeight};

impl MapObject {
    /// Moves the object: its box, its points, and its views, as if they had been taken of it at the new
    /// place. Its supporting plane, its sightings and its last boxes in the image are
    /// forgotten.
    pub(crate) fn move_by(&mut self, new_from_old: &Pose) {
        self.oriented_box = self.oriented_box.transformed(new_from_old);
        self.cloud = Arc::new(self.cloud.moved(new_from_old));
        self.centroids = self.centroids.moved(new_from_old);
        self.key_views.move_by(new_from_old);
        self.sightings.clear();
        self.supports.clear();
        self.voters = 0;
        self.motion = BoxMotion::default();
        self.sighted_points.clear();
        self.looked_through = 0;
    }

    /// Forgets what was seen of where it stood before somebody pushed it along. Frames have found it at its new
    /// place already; its views there count anew. What it stood on counts as one view does: mostly it is
    /// still that, and if it is something else, the next views say so.
    pub(crate) fn forget_old_place(&mut self) {
        let share = f64::from(FULL) / f64::from(self.voters.max(FULL));
        let shared = |votes: u32| (share * f64::from(votes)).ceil() as u32;
        self.supports.iter_mut().for_each(|support| support.votes = shared(support.votes));
        self.voters = shared(self.voters);
        self.centroids = CentroidCloud::default();
        self.sightings.clear();
        self.sighted_points.clear();
        self.view = ViewWeight::default();
    }
}
