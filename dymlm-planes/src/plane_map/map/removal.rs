use std::collections::BTreeMap;

use dymlm_core::{FrameId, PlaneId};

use super::super::key_frame::{KeyFrame, Share};
use super::super::map_plane::MapPlane;
use super::super::report::PlaneMerge;
use super::PlaneMap;
use crate::error::Error;

/// Taking key frames out.
impl PlaneMap {
    /// Takes a key frame out again, by the id that its report gave.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownKeyFrame`].
    pub fn remove(&mut self, key_frame: FrameId) -> Result<(), Error> {
        let gone = self.key_frames.remove(&key_frame).ok_or(Error::UnknownKeyFrame { key_frame })?;
        let mut undone: Vec<PlaneMerge> = gone.merges.iter().map(|merge| merge.merge).collect();
        undone.extend(self.take_unwitnessed(key_frame));
        let mut touched: Vec<PlaneId> = gone.missed.iter().map(|&id| self.resolve(id)).collect();
        if undone.is_empty() {
            touched.extend(gone.shares.iter().map(|share| self.resolve(share.plane)));
            self.subtract(&gone, &gone.shares);
        } else {
            touched.extend(self.undo_merges(&gone, &undone));
        }
        self.collect_gaps();
        self.recount(&touched);
        Ok(())
    }

    /// Takes some of what a key frame has seen out of the planes that hold it now.
    pub(super) fn subtract(&mut self, key_frame: &KeyFrame, shares: &[Share]) {
        let places = key_frame.places();
        for share in shares {
            let id = self.resolve(share.plane);
            let Ok(placed) = key_frame.placed(share, &places, self.config.voxel_size) else { continue };
            let Some(plane) = self.planes.get_mut(&id) else { continue };
            plane.moments.subtract(&placed.moments);
            plane.patch.subtract(&placed.patch, |block| {
                self.index.take(block, id);
                plane.judged.remove(&block);
            });
            plane.refit();
        }
    }

    /// Counts anew which key frames have seen some planes, and takes those out that none has.
    pub(super) fn recount(&mut self, ids: &[PlaneId]) {
        for &id in ids {
            let sightings = self.sightings(id);
            if let Some(plane) = self.planes.get_mut(&id) {
                plane.sightings = sightings;
                if sightings.count == 0 {
                    self.take_plane(id);
                }
            }
        }
        self.confirm(ids.iter().copied());
    }

    fn take_plane(&mut self, id: PlaneId) {
        if let Some(gone) = self.planes.remove(&id) {
            gone.patch.blocks().for_each(|block| self.index.take(block, id));
        }
    }

    /// Takes those merges out of the key frames that have too few witnesses left without a key frame.
    fn take_unwitnessed(&mut self, gone: FrameId) -> Vec<PlaneMerge> {
        let least = self.config.min_observations as usize;
        let mut taken = Vec::new();
        for key_frame in self.key_frames.values_mut() {
            key_frame.merges.retain_mut(|merge| {
                let Some(witnesses) = &mut merge.witnesses else { return true };
                witnesses.retain(|&witness| witness != gone);
                let holds = witnesses.len() >= least;
                if !holds {
                    taken.push(merge.merge);
                }
                holds
            });
        }
        taken
    }

    /// Parts planes that a key frame made one, or that it was needed as a witness for, and makes all that it
    /// touched anew without it. Gives these.
    fn undo_merges(&mut self, gone: &KeyFrame, undone: &[PlaneMerge]) -> Vec<PlaneId> {
        let mut touched: Vec<PlaneId> = gone.shares.iter().map(|share| self.resolve(share.plane)).collect();
        touched.extend(undone.iter().map(|merge| self.resolve(merge.into)));
        for merge in undone {
            self.merged.remove(merge.from);
        }
        touched.extend(undone.iter().flat_map(|merge| [self.resolve(merge.from), self.resolve(merge.into)]));
        touched.sort_unstable();
        touched.dedup();
        self.rebuild(&touched);
        touched
    }

    /// Makes planes anew from what the key frames have seen of them. O(all shares).
    pub(super) fn rebuild(&mut self, ids: &[PlaneId]) {
        let mut planes: BTreeMap<PlaneId, MapPlane> = BTreeMap::new();
        for key_frame in self.key_frames.values() {
            let is_wanted = |share: &&Share| ids.contains(&self.resolve(share.plane));
            let mut shares = key_frame.shares.iter().filter(is_wanted).peekable();
            let places = shares.peek().map(|_| key_frame.places());
            for (share, places) in shares.zip(places.iter().cycle()) {
                let placed = key_frame.placed(share, places, self.config.voxel_size);
                let (Ok(placed), id) = (placed, self.resolve(share.plane)) else { continue };
                let new = || MapPlane::new(id, placed.plane, self.shape());
                let plane = planes.entry(id).or_insert_with(new);
                plane.moments.add(&placed.moments);
                plane.patch.add(&placed.patch, |_| ());
            }
        }
        for &id in ids {
            self.take_plane(id);
        }
        for (id, mut plane) in planes {
            plane.refit();
            plane.patch.blocks().for_each(|block| self.index.add(block, id));
            self.planes.insert(id, plane);
        }
    }
}
