use std::collections::BTreeMap;

use dymlm_core::{Birth, FrameId};

use super::super::insertion::Union;
use super::super::key_frame::{KeyFrame, Share};
use super::super::map_plane::MapPlane;
use super::PlaneMap;
use crate::error::Error;
use crate::patches::VoxelLists;

/// Removal of key frames.
impl PlaneMap {
    /// Removes a key frame, given by the id in its report.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownKeyFrame`].
    pub fn remove(&mut self, key_frame: FrameId) -> Result<(), Error> {
        let gone = self.key_frames.remove(key_frame).ok_or(Error::UnknownKeyFrame { key_frame })?;
        let mut undone: Vec<Union> = gone.merges.iter().map(|merge| merge.merge).collect();
        undone.extend(self.take_unwitnessed(key_frame));
        let mut touched: Vec<Birth> = gone.missed.iter().map(|&birth| self.resolve(birth)).collect();
        // These are made from the other key frames, without its shares.
        let back = self.take_back(key_frame, &gone);
        touched.extend(&back);
        if undone.is_empty() {
            touched.extend(gone.shares.iter().map(|share| self.resolve(share.plane)));
            let is_in = |share: &&Share| !back.contains(&self.resolve(share.plane));
            let shares: Vec<Share> = gone.shares.iter().filter(is_in).copied().collect();
            self.subtract(&gone, &shares);
        } else {
            touched.extend(self.undo_merges(&gone, &undone));
        }
        self.collect_gaps();
        self.recount(&touched);
        Ok(())
    }

    /// Subtracts some shares of a key frame from the planes that contain them now.
    pub(super) fn subtract(&mut self, key_frame: &KeyFrame, shares: &[Share]) {
        let (places, mut lists) = (key_frame.places(), VoxelLists::default());
        for share in shares {
            let birth = self.resolve(share.plane);
            let placed = key_frame.placed(share, &places, self.config.voxel_size, &mut lists);
            let Ok(placed) = placed else { continue };
            let Some(plane) = self.planes.get_mut(&birth) else { continue };
            plane.moments.subtract(&placed.moments);
            plane.patch.subtract(&placed.patch, |block| self.index.take(block, birth));
            plane.forget_gone_voxels_in(placed.patch.blocks());
            plane.refit();
        }
    }

    /// Counts anew the key frames that have seen some planes, and removes planes that none has seen.
    pub(super) fn recount(&mut self, births: &[Birth]) {
        for &birth in births {
            let sightings = self.sightings(birth);
            if sightings.count == 0 && self.dropped.remove(&birth).is_some() {
                self.names.forget(birth);
            }
            if let Some(plane) = self.planes.get_mut(&birth) {
                plane.sightings = sightings;
                if sightings.count == 0 {
                    self.take_plane(birth);
                    self.names.forget(birth);
                }
            }
        }
        self.confirm(births.iter().copied());
    }

    pub(super) fn take_plane(&mut self, birth: Birth) -> Option<MapPlane> {
        let gone = self.planes.remove(&birth)?;
        gone.patch.blocks().for_each(|block| self.index.take(block, birth));
        Some(gone)
    }

    /// Removes from the key frames the merges that have too few witnesses left without key frame `gone`, and
    /// returns them.
    fn take_unwitnessed(&mut self, gone: FrameId) -> Vec<Union> {
        let least = self.config.lasting_observations() as usize;
        let mut taken = Vec::new();
        self.key_frames.renew(|key_frame| {
            let mut witnesses = key_frame.merges.iter().filter_map(|merge| merge.witnesses.as_ref());
            if !witnesses.any(|witnesses| witnesses.contains(&gone)) {
                return None;
            }
            let mut key_frame = key_frame.clone();
            key_frame.merges.retain_mut(|merge| {
                let Some(witnesses) = &mut merge.witnesses else { return true };
                witnesses.retain(|&witness| witness != gone);
                let holds = witnesses.len() >= least;
                if !holds {
                    taken.push(merge.merge);
                }
                holds
            });
            Some(key_frame)
        });
        taken
    }

    /// Undoes merges that a key frame caused or for which it was needed as a witness, and rebuilds all planes
    /// that it touched without it. Returns these planes.
    fn undo_merges(&mut self, gone: &KeyFrame, undone: &[Union]) -> Vec<Birth> {
        let mut touched: Vec<Birth> = gone.shares.iter().map(|share| self.resolve(share.plane)).collect();
        touched.extend(undone.iter().map(|merge| self.resolve(merge.into)));
        for merge in undone {
            self.merged.remove(merge.from);
            self.merged_ids.remove(self.names.id(merge.from));
        }
        touched.extend(undone.iter().flat_map(|merge| [self.resolve(merge.from), self.resolve(merge.into)]));
        touched.sort_unstable();
        touched.dedup();
        self.rebuild(&touched);
        touched
    }

    /// Rebuilds planes from what the key frames have seen of them; how they were judged stays. O(all shares).
    pub(super) fn rebuild(&mut self, births: &[Birth]) {
        let mut planes: BTreeMap<Birth, MapPlane> = BTreeMap::new();
        let mut lists = VoxelLists::default();
        for key_frame in self.key_frames.values() {
            let is_wanted = |share: &&Share| {
                let birth = self.resolve(share.plane);
                births.contains(&birth) && !self.dropped.contains_key(&birth)
            };
            let mut shares = key_frame.shares.iter().filter(is_wanted).peekable();
            let places = shares.peek().map(|_| key_frame.places());
            for (share, places) in shares.zip(places.iter().cycle()) {
                let placed = key_frame.placed(share, places, self.config.voxel_size, &mut lists);
                let (Ok(placed), birth) = (placed, self.resolve(share.plane)) else { continue };
                let new = || MapPlane::new((birth, self.names.id(birth)), placed.plane, self.shape());
                let plane = planes.entry(birth).or_insert_with(new);
                plane.moments.add(&placed.moments);
                plane.patch.add(&placed.patch, |_| ());
            }
        }
        for &birth in births {
            if let (Some(before), Some(plane)) = (self.take_plane(birth), planes.get_mut(&birth)) {
                plane.keep_judgement(before);
            }
        }
        for (birth, mut plane) in planes {
            plane.refit();
            plane.patch.blocks().for_each(|block| self.index.add(block, birth));
            self.planes.insert(birth, plane);
        }
    }
}
