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
    /// Frame and index of detections, ascending; at most [`MOST`].
    detections: Vec<(FrameId, usize)>,
}

/// Detections that are kept of an object. A majority decides which object they are of, and one of as many, spread
/// evenly over the object's time, is that of all; an object in view for hours has a hundred thousand.
const MOST: usize = 256;

impl Witnesses {
    /// The detections of an object among the events so far.
    pub(crate) fn of(object: ObjectId, events: &Pages<Event>, map: &ObjectMap) -> Self {
        let object = map.current_id(object);
        let own = sightings(events).filter(|(_, id)| map.current_id(*id) == object);
        Self { detections: spread(own.map(|(detection, _)| detection).collect()) }
    }

    /// Bytes that the list owns.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.detections.capacity() * size_of::<(FrameId, usize)>()
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

/// [`MOST`] of some detections, spread evenly, or all if there are no more.
fn spread(detections: Vec<(FrameId, usize)>) -> Vec<(FrameId, usize)> {
    if detections.len() <= MOST {
        return detections;
    }
    (0..MOST).map(|place| detections[place * detections.len() / MOST]).collect()
}

/// Each detection of a key frame that was of an object, with that object.
fn sightings(events: &Pages<Event>) -> impl Iterator<Item = ((FrameId, usize), ObjectId)> {
    events.iter().filter_map(Event::key_frame).flat_map(|KeyFrameEntry { frame, seen, .. }| {
        seen.objects.iter().map(|&(detection, id)| ((*frame, detection), id))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: each time an object was taken up or put down, all its detections were logged once more, 2 MB of
    /// them after eight hours.
    #[test]
    fn few_of_the_detections_of_hours_are_kept_and_they_span_them() {
        let detections = |count: u64| (0..count).map(|frame| (FrameId::new(frame), 0)).collect::<Vec<_>>();
        for count in [0, 1, MOST as u64] {
            assert_eq!(spread(detections(count)), detections(count));
        }
        let kept = spread(detections(144_000));
        assert_eq!(kept.len(), MOST);
        assert!(kept.is_sorted_by(|a, b| a.0 < b.0));
        let gaps = kept.windows(2).map(|pair| pair[1].0.get() - pair[0].0.get());
        assert!(gaps.max() <= Some(144_000 / MOST as u64 + 1) && kept[MOST - 1].0.get() > 143_000);
    }
}
