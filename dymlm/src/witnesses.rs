use std::collections::BTreeMap;

use dymlm_core::{FrameId, ObjectId, Pages};
use dymlm_objects::ObjectMap;

use crate::Error;
use crate::session_log::{Event, KeyFrameEntry};

/// An object, identified by the detections that were of it. Its id may mean another object in maps at other
/// poses, where things are merged for a while.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Witnesses {
    /// Frame and index of each detection, ascending.
    detections: Vec<(FrameId, usize)>,
}

impl Witnesses {
    /// The detections of an object among the events so far.
    pub(crate) fn of(object: ObjectId, events: &Pages<Event>, map: &ObjectMap) -> Self {
        let object = map.current_id(object);
        let own = sightings(events).filter(|(_, id)| map.current_id(*id) == object);
        Self { detections: own.map(|(detection, _)| detection).collect() }
    }

    /// Renames the frames; the new ids ascend as the old ones do.
    pub(crate) fn rename_frames(
        &mut self,
        name: &impl Fn(FrameId) -> Result<FrameId, Error>,
    ) -> Result<(), Error> {
        for (frame, _) in &mut self.detections {
            *frame = name(*frame)?;
        }
        Ok(())
    }

    /// The object of a map that most of the detections are of; of equals the oldest.
    pub(crate) fn object(&self, events: &Pages<Event>, map: &ObjectMap) -> Option<ObjectId> {
        let mut counts: BTreeMap<ObjectId, usize> = BTreeMap::new();
        let is_own = |detection: &(FrameId, usize)| self.detections.binary_search(detection).is_ok();
        for (_, id) in sightings(events).filter(|(detection, _)| is_own(detection)) {
            if map.object(id).is_some() {
                *counts.entry(map.current_id(id)).or_default() += 1;
            }
        }
        counts.into_iter().rev().max_by_key(|&(_, count)| count).map(|(id, _)| id)
    }
}

/// Each detection of a key frame that was of an object, with that object.
fn sightings(events: &Pages<Event>) -> impl Iterator<Item = ((FrameId, usize), ObjectId)> {
    events.iter().filter_map(Event::key_frame).flat_map(|KeyFrameEntry { frame, seen, .. }| {
        seen.objects.iter().map(|&(detection, id)| ((*frame, detection), id))
    })
}
