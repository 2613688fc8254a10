use dymlm_core::{FrameId, PlaneId};

use super::super::fixed_moments::FixedMoments;
use super::super::map_plane::MapPlane;
use super::super::report::PlaneMerge;
use super::{KeyFrame, PlaneMap};
use crate::error::Error;
use crate::patch::Patch;

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
        if undone.is_empty() {
            self.subtract(&gone);
        } else {
            self.undo_merges(&gone, &undone);
        }
        self.collect_gaps();
        self.confirm_all();
        Ok(())
    }

    /// Takes a key frame's sums out of the planes.
    fn subtract(&mut self, gone: &KeyFrame) {
        for share in &gone.contributions {
            let id = self.resolve(share.plane);
            let Some(place) = self.place(id) else { continue };
            let seen = self.sightings(id);
            if seen.count == 0 {
                self.planes.remove(place);
                continue;
            }
            let plane = &mut self.planes[place];
            plane.moments.subtract(&share.moments);
            plane.patch.subtract(&share.patch);
            plane.sightings = seen;
            plane.refit();
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
    /// touched anew without it.
    fn undo_merges(&mut self, gone: &KeyFrame, undone: &[PlaneMerge]) {
        let mut touched: Vec<PlaneId> =
            gone.contributions.iter().map(|share| self.resolve(share.plane)).collect();
        touched.extend(undone.iter().map(|merge| self.resolve(merge.into)));
        for merge in undone {
            self.merged.remove(&merge.from);
        }
        touched.extend(undone.iter().flat_map(|merge| [self.resolve(merge.from), self.resolve(merge.into)]));
        touched.sort_unstable();
        touched.dedup();
        self.rebuild(&touched);
    }

    /// Makes planes anew from what the key frames have added to them. O(all contributions).
    pub(super) fn rebuild(&mut self, ids: &[PlaneId]) {
        for &id in ids {
            if let Some(place) = self.place(id) {
                self.planes.remove(place);
            }
            let seen = self.sightings(id);
            if seen.count == 0 {
                continue;
            }
            let (mut moments, mut patch) = (FixedMoments::default(), Patch::default());
            for share in self.key_frames.values().flat_map(|key_frame| &key_frame.contributions) {
                if self.resolve(share.plane) == id {
                    moments.add(&share.moments);
                    patch.add(&share.patch);
                }
            }
            let Some(fitted) = moments.fit().and_then(|fit| fit.plane()) else { continue };
            let mut plane = MapPlane::new(id, fitted, self.shape());
            (plane.moments, plane.patch) = (moments, patch);
            plane.sightings = seen;
            plane.refit();
            let place = self.planes.partition_point(|other| other.id < id);
            self.planes.insert(place, plane);
        }
    }
}
