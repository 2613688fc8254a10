use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::{Birth, FrameId};

use super::super::gap_record::{GapLooks, resolve_looks};
use super::super::key_frame::KeyFrame;
use super::super::map_plane::{MapPlane, Sightings};
use super::PlaneMap;

/// Planes that were dropped, each with the key frame that gave the reason. What the key frames saw of them
/// stays, so that they come back with the removal of that one, or of another that had looked there in vain.
/// None for a plane that stands in free space, which no key frame alone has shown: that does not come back.
pub(super) type Dropped = BTreeMap<Birth, Option<FrameId>>;

/// Dropping of planes that were never confirmed: of noise, of ghosts and of what passed by. They are a few in
/// each minute, and without that all of them would stay for as long as the map.
impl PlaneMap {
    /// Drops those of some planes, not seen by the last key frame, that have been refuted.
    pub(super) fn drop_refuted(&mut self, planes: impl IntoIterator<Item = Birth>) {
        let last = FrameId::new(self.next_key_frame.saturating_sub(1));
        let mut refuted = BTreeSet::new();
        for birth in planes {
            let Some(plane) = self.planes.get(&birth).filter(|plane| self.is_refuted(plane)) else {
                continue;
            };
            self.dropped.insert(birth, (!plane.is_gone).then_some(last));
            self.take_plane(birth);
            refuted.insert(birth);
        }
        self.gaps.forget(&refuted);
    }

    /// Whether a plane has too few sightings to be confirmed (any more), and has been looked at in vain so
    /// often that another whole look that sees it would not confirm it; or stands in free space, and the
    /// camera that saw it there has left. What is dropped earlier comes back without what speaks against it:
    /// two key frames would confirm what a plane fitted across an edge shows now and then.
    fn is_refuted(&self, plane: &MapPlane) -> bool {
        let Sightings { count, missed, looks, .. } = plane.sightings;
        let is_past = self.look.is_none_or(|look| !looks.has(look.first));
        count < self.config.least_observations(missed)
            && if plane.is_gone {
                is_past
            } else {
                looks.share_after_a_look() < self.config.min_observation_share
            }
    }

    /// Brings back the planes that were dropped because of a key frame, which is gone.
    pub(super) fn take_back(&mut self, key_frame: FrameId, gone: &KeyFrame) -> Vec<Birth> {
        let missed: Vec<Birth> = gone.missed.iter().map(|&birth| self.resolve(birth)).collect();
        let is_back = |birth: &Birth, by: &Option<FrameId>| {
            by.is_some_and(|by| by == key_frame || missed.contains(birth))
        };
        let back: Vec<Birth> =
            self.dropped.iter().filter(|(a, by)| is_back(a, by)).map(|(&a, _)| a).collect();
        self.dropped.retain(|birth, by| !is_back(birth, by));
        if !back.is_empty() {
            self.rebuild(&back);
        }
        back
    }

    /// A key frame's looks between the planes that are there, each replaced by the one that it has become
    /// (`resolve`).
    pub(super) fn looks_of(&self, key_frame: &KeyFrame, resolve: impl Fn(Birth) -> Birth) -> GapLooks {
        let mut looks = resolve_looks(&key_frame.gap_looks, resolve);
        looks.retain(|(pair, _)| !pair.iter().any(|birth| self.dropped.contains_key(birth)));
        looks
    }
}
