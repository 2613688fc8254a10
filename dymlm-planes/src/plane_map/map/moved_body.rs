use std::collections::BTreeMap;

use dymlm_core::{Birth, PlaneId, Pose};

use super::super::key_frame::{KeyFrame, Share};
use super::super::map_plane::MapPlane;
use super::PlaneMap;
use crate::error::Error;
use crate::linear_algebra::foot_on;
use crate::patches::{PatchVoxel, VoxelLists};

/// Least share of a plane's inliers that must belong to a body for the plane to be the body's.
const BODY_SHARE: f64 = 0.6;

/// Moving of bodies.
impl PlaneMap {
    /// Moves the planes of a body that was moved; `is_body` tells which places belong to the body. Planes of
    /// which most inliers (60 %) are the body's move by `new_from_old`, without what they have left in free
    /// space; from all other planes the body's inliers are removed. Returns the ids of the moved planes.
    ///
    /// What earlier key frames have added moves with the planes, so [`Self::remove`] stays exact. O(voxels of
    /// the map, and all that was seen of the planes that change).
    ///
    /// # Errors
    ///
    /// [`Error::OutOfReach`] when a plane would move too far out; then nothing is moved.
    pub fn move_body(
        &mut self,
        new_from_old: &Pose,
        is_body: impl Fn([f64; 3]) -> bool,
    ) -> Result<Vec<PlaneId>, Error> {
        let voxel_size = self.config.voxel_size;
        let (mut going, mut cut) = (Vec::new(), BTreeMap::new());
        for plane in self.planes.values() {
            let is_own = |voxel: &PatchVoxel| is_body(foot_on(&plane.plane, voxel.center(voxel_size)));
            // What is pushed along has left inliers behind; of a plane that is gone, all count.
            let is_gone = plane.standing() == 0;
            let counted = || plane.patch.voxels().filter(|voxel| is_gone || plane.stands(*voxel));
            let own = counted().filter(is_own).count();
            if own as f64 >= BODY_SHARE * counted().count() as f64 && own > 0 {
                going.push(plane.birth);
            } else if own > 0 {
                cut.insert(plane.birth, plane.plane);
            }
        }
        let before = self.key_frames.clone();
        self.leave_behind(&going);
        if let Err(error) = self.move_shares(&going, new_from_old) {
            self.key_frames = before;
            return Err(error);
        }
        let merged = &self.merged;
        self.key_frames.renew(|before| {
            let mut key_frame = before.clone();
            let is_cut = before.shares.iter().any(|share| cut.contains_key(&merged.current(share.plane)));
            if is_cut {
                key_frame.retain_samples(voxel_size, |share, cell| {
                    let center = PatchVoxel { cell, count: 1 }.center(voxel_size);
                    let plane = cut.get(&merged.current(share.plane));
                    plane.is_none_or(|plane| !is_body(foot_on(plane, center)))
                });
            }
            // What lay between the moved planes and others is no longer there.
            let goes = |plane: &Birth| going.contains(&merged.current(*plane));
            key_frame.gap_looks.retain(|(pair, _)| !pair.iter().any(goes));
            (is_cut || key_frame.gap_looks.len() < before.gap_looks.len()).then_some(key_frame)
        });
        self.collect_gaps();
        let gone_ids = going.iter().map(|plane| self.names.id(*plane)).collect();
        for plane in &going {
            // Of where it is now nothing is known yet.
            if let Some(plane) = self.planes.get_mut(plane) {
                plane.forget_judgement();
            }
        }
        let touched: Vec<Birth> = going.iter().chain(cut.keys()).copied().collect();
        self.rebuild(&touched);
        self.recount(&touched);
        Ok(gone_ids)
    }

    /// Takes from the key frames what some planes have left in free space, unless that is all of them.
    fn leave_behind(&mut self, planes: &[Birth]) {
        let Self { planes: all, merged, key_frames, config, .. } = self;
        let has_left = |plane: &&MapPlane| !plane.judged.is_empty() && plane.standing() > 0;
        let left: BTreeMap<Birth, &MapPlane> =
            planes.iter().filter_map(|birth| Some((*birth, all.get(birth).filter(has_left)?))).collect();
        let of = |share: &Share| left.get(&merged.current(share.plane));
        key_frames.renew(|before| {
            before.shares.iter().any(|share| of(share).is_some()).then(|| {
                let mut key_frame = before.clone();
                key_frame.retain_samples(config.voxel_size, |share, cell| {
                    of(share).is_none_or(|plane| plane.stands(PatchVoxel { cell, count: 1 }))
                });
                key_frame
            })
        });
    }

    /// Moves the key frames' shares of some planes; all or none.
    fn move_shares(&mut self, planes: &[Birth], new_from_old: &Pose) -> Result<(), Error> {
        let (mut moved, mut lists) = (BTreeMap::new(), VoxelLists::default());
        for (number, key_frame) in self.key_frames.iter() {
            let goes = |share: &Share| planes.contains(&self.resolve(share.plane));
            if key_frame.shares.iter().any(goes) {
                let (mut key_frame, places) = (KeyFrame::clone(&key_frame), key_frame.places());
                for index in 0..key_frame.shares.len() {
                    if goes(&key_frame.shares[index]) {
                        key_frame.move_share(index, new_from_old);
                        key_frame.placed(
                            &key_frame.shares[index],
                            &places,
                            self.config.voxel_size,
                            &mut lists,
                        )?;
                    }
                }
                moved.insert(number, key_frame);
            }
        }
        for (number, key_frame) in moved {
            self.key_frames.insert(number, key_frame);
        }
        Ok(())
    }
}
