use dymlm_core::{FrameId, PlaneId, Pose};

use super::super::fixed_moments::FixedMoments;
use super::super::observation::Observation;
use super::{PlaneMap, resolve};
use crate::error::Error;
use crate::linear_algebra::foot_on;
use crate::patch::Patch;

/// A plane is a body's when this share of its inliers is.
const BODY_SHARE: f64 = 0.6;

/// What stands elsewhere from now on.
impl PlaneMap {
    /// Moves the planes of a body that was moved, `is_body` telling which places are the body's: planes most
    /// of whose inliers (60 %) are its own go where `new_from_old` takes them, from all others its inliers
    /// are taken out. Gives the ids of the planes that went.
    ///
    /// What key frames from before have added moves with them, so [`Self::remove`] stays exact. O(all
    /// contributions to the planes that change).
    ///
    /// # Errors
    ///
    /// [`Error::OutOfReach`] when a plane would go too far out; nothing has moved.
    pub fn move_body(
        &mut self,
        new_from_old: &Pose,
        is_body: impl Fn([f64; 3]) -> bool,
    ) -> Result<Vec<PlaneId>, Error> {
        let voxel_size = self.config.voxel_size;
        let (mut going, mut cut) = (Vec::new(), Vec::new());
        for plane in &self.planes {
            let voxels = plane.patch.voxels();
            let own = voxels
                .iter()
                .filter(|voxel| is_body(foot_on(&plane.plane, voxel.center(voxel_size))))
                .count();
            if own as f64 >= BODY_SHARE * voxels.len() as f64 && own > 0 {
                going.push(plane.id);
            } else if own > 0 {
                cut.push((plane.id, plane.plane));
            }
        }
        let moved = self.moved_contributions(&going, new_from_old)?;
        for ((key_frame, index), (moments, patch)) in moved {
            let key_frame = self.key_frames.get_mut(&key_frame);
            if let Some(share) = key_frame.and_then(|key_frame| key_frame.contributions.get_mut(index)) {
                (share.moments, share.patch) = (moments, patch);
            }
        }
        let merged = &self.merged;
        for share in self.key_frames.values_mut().flat_map(|key_frame| &mut key_frame.contributions) {
            let id = resolve(merged, share.plane);
            if let Some((_, plane)) = cut.iter().find(|(cut, _)| *cut == id) {
                share.patch.retain(|voxel| !is_body(foot_on(plane, voxel.center(voxel_size))));
            }
        }
        // What lay between them and others lies there no more.
        for key_frame in self.key_frames.values_mut() {
            key_frame
                .gap_looks
                .retain(|pair, _| !pair.iter().any(|id| going.contains(&resolve(merged, *id))));
        }
        self.collect_gaps();
        let touched: Vec<PlaneId> = going.iter().copied().chain(cut.iter().map(|(id, _)| *id)).collect();
        self.rebuild(&touched);
        self.confirm_all();
        Ok(going)
    }

    /// What the key frames have added to some planes, moved; by key frame and place in it.
    #[allow(clippy::type_complexity, reason = "a list that lives for a few lines")]
    fn moved_contributions(
        &self,
        planes: &[PlaneId],
        new_from_old: &Pose,
    ) -> Result<Vec<((FrameId, usize), (FixedMoments, Patch))>, Error> {
        let voxel_size = self.config.voxel_size;
        let reach = Observation::reach(voxel_size);
        let mut moved = Vec::new();
        for (&number, key_frame) in &self.key_frames {
            for (index, share) in key_frame.contributions.iter().enumerate() {
                if !planes.contains(&self.resolve(share.plane)) {
                    continue;
                }
                let old = share.moments.about_centroid().map_or([0.0; 3], |(_, centroid)| centroid);
                let centroid = new_from_old.transform_point(old);
                let within = centroid.iter().all(|c| c.abs() < reach);
                let moments = share.moments.moved(new_from_old).filter(|_| within);
                let moments = moments.ok_or(Error::OutOfReach { centroid, reach })?;
                moved.push(((number, index), (moments, share.patch.moved(new_from_old, voxel_size))));
            }
        }
        Ok(moved)
    }
}
