use std::sync::Arc;

use dymlm_core::Pose;

use super::{BoxMotion, MapObject};

impl MapObject {
    /// Stands elsewhere from now on: its box, its points, and the views that it was seen in, as if they had
    /// been taken of it there. What it stood on, and what was last seen of it in the image, is forgotten.
    pub(crate) fn move_by(&mut self, new_from_old: &Pose) {
        self.oriented_box = self.oriented_box.transformed(new_from_old);
        self.cloud = Arc::new(self.cloud.moved(new_from_old));
        self.centroids = self.centroids.moved(new_from_old);
        self.key_views.move_by(new_from_old);
        self.supports.clear();
        self.motion = BoxMotion::default();
        self.sighted_points.clear();
        self.looked_through = 0;
    }
}
