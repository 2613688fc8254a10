use std::collections::BTreeMap;

use dymlm_core::{FrameId, PlaneId, Pose};

use super::super::observation::Share;
use super::{PlaneMap, resolve};
use crate::error::Error;
use crate::linear_algebra::foot_on;
use crate::patches::PatchVoxel;

/// A plane is a body's when this share of its inliers is.
const BODY_SHARE: f64 = 0.6;

/// What stands elsewhere from now on.
impl PlaneMap {
    /// Moves the planes of a body that was moved, `is_body` telling which places are the body's: planes most
    /// of whose inliers (60 %) are its own go where `new_from_old` takes them, from all others its inliers
    /// are taken out. Gives the ids of the planes that went.
    ///
    /// What key frames from before have added moves with them, so [`Self::remove`] stays exact. O(voxels of the
    /// map, and all that was seen of the planes that change).
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
        let (mut going, mut cut) = (Vec::new(), BTreeMap::new());
        for plane in self.planes.values() {
            let is_own = |voxel: &PatchVoxel| is_body(foot_on(&plane.plane, voxel.center(voxel_size)));
            let own = plane.patch.voxels().filter(is_own).count();
            if own as f64 >= BODY_SHARE * plane.patch.len() as f64 && own > 0 {
                going.push(plane.id);
            } else if own > 0 {
                cut.insert(plane.id, plane.plane);
            }
        }
        let moved = self.moved_shares(&going, new_from_old)?;
        for ((key_frame, index), moved) in moved {
            let key_frame = self.key_frames.get_mut(&key_frame);
            if let Some(share) = key_frame.and_then(|key_frame| key_frame.shares.get_mut(index)) {
                *share = moved;
            }
        }
        let merged = &self.merged;
        for key_frame in self.key_frames.values_mut() {
            for share in &mut key_frame.shares {
                if let Some(plane) = cut.get(&resolve(merged, share.plane)) {
                    let stays = |voxel: PatchVoxel| !is_body(foot_on(plane, voxel.center(voxel_size)));
                    share.retain(&key_frame.world_from_camera, voxel_size, stays);
                }
            }
            // What lay between them and others lies there no more.
            let goes = |id: &PlaneId| going.contains(&resolve(merged, *id));
            key_frame.gap_looks.retain(|(pair, _)| !pair.iter().any(goes));
        }
        self.collect_gaps();
        let touched: Vec<PlaneId> = going.iter().chain(cut.keys()).copied().collect();
        self.rebuild(&touched);
        self.recount(&touched);
        Ok(going)
    }

    /// What the key frames have seen of some planes, moved; by key frame and place in it.
    #[allow(clippy::type_complexity, reason = "a list that lives for a few lines")]
    fn moved_shares(
        &self,
        planes: &[PlaneId],
        new_from_old: &Pose,
    ) -> Result<Vec<((FrameId, usize), Share)>, Error> {
        let mut moved = Vec::new();
        for (&number, key_frame) in &self.key_frames {
            for (index, share) in key_frame.shares.iter().enumerate() {
                if planes.contains(&self.resolve(share.plane)) {
                    let share = share.moved(new_from_old);
                    share.placed(&key_frame.world_from_camera, self.config.voxel_size)?;
                    moved.push(((number, index), share));
                }
            }
        }
        Ok(moved)
    }
}
