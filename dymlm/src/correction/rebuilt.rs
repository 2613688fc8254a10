use dymlm_core::{ObjectId, Pages, PlaneId, Succession};

use super::identities::Identities;
use super::report::ThingChanges;
use super::thing_changes::{objects_changed, planes_changed};
use crate::MultiLevelMap;
use crate::session_log::{Event, KeyFrameEntry, SeenThings, SessionLog};

/// Maps that were built again, whose things have new ids, beside the maps before.
pub(super) struct Renaming<'a> {
    /// What has happened, with the old ids.
    pub(super) log: &'a SessionLog,
    pub(super) before: &'a MultiLevelMap,
    /// The new maps, without their past.
    pub(super) map: MultiLevelMap,
    /// The same events, of key frames with what they have seen in the new maps, by its new ids.
    pub(super) events: Pages<Event>,
}

/// Maps that were built again, and what has become of the things in them.
pub(super) struct Rebuilt {
    /// The new maps, without their past.
    pub(super) map: MultiLevelMap,
    /// What has happened, with the things by their old ids. It shares with the log before what has stayed the
    /// same.
    pub(super) events: Pages<Event>,
    pub(super) planes: ThingChanges<PlaneId>,
    pub(super) objects: ThingChanges<ObjectId>,
}

impl<'a> Renaming<'a> {
    /// For each key frame, the things that its observations belonged to, and those that they belong to now.
    fn pairs(&self) -> impl Iterator<Item = (&'a SeenThings, &SeenThings)> {
        let entries = self.events.iter().filter_map(Event::key_frame);
        self.log.key_frames().map(|entry| &entry.seen).zip(entries.map(|entry| &entry.seen))
    }

    fn shared_planes(&self) -> impl Iterator<Item = (PlaneId, PlaneId)> {
        self.pairs().flat_map(|(old, new)| SeenThings::shared_planes(old, new))
    }

    fn shared_objects(&self) -> impl Iterator<Item = (ObjectId, ObjectId)> {
        self.pairs().flat_map(|(old, new)| SeenThings::shared_objects(old, new))
    }

    /// Gives planes and objects the ids that they had, and says what has become of them.
    pub(super) fn finish(mut self) -> Rebuilt {
        let (before, now) = (self.before, &self.map);
        let planes = Identities::of(self.shared_planes().filter_map(|(old, new)| {
            Some((before.planes.current_id(old).unwrap_or(old), now.planes.current_id(new)?))
        }));
        let objects = Identities::of(self.shared_objects().filter_map(|(old, new)| {
            Some((before.objects().current_id(old), now.objects().object(new)?.id()))
        }));
        let mut plane_ids = Succession::new(
            planes.names_of_all(self.shared_planes()),
            [before.planes.ids_given(), now.planes.ids_given()],
            PlaneId::new,
        );
        let mut object_ids = Succession::new(
            objects.names_of_all(self.shared_objects()),
            [before.objects.ids_given(), now.objects.ids_given()],
            ObjectId::new,
        );
        // All names in the order of the log, before any other.
        for entry in self.events.iter().filter_map(Event::key_frame) {
            entry.seen.renamed(&mut plane_ids, &mut object_ids);
        }
        self.map.objects.succeed(&before.objects, &mut object_ids, &objects.merged, &mut plane_ids);
        self.map.planes.succeed(&before.planes, &mut plane_ids, &planes.merged);
        let is_in_map = |object| self.map.objects().object(object).is_some();
        let mut events = self.log.events.clone();
        for (place, (old, new)) in self.log.events.iter().zip(self.events.iter()).enumerate() {
            let Some((old, new)) = old.key_frame().zip(new.key_frame()) else { continue };
            let mut seen = new.seen.renamed(&mut plane_ids, &mut object_ids);
            seen.remember(&old.seen, is_in_map);
            events.update(place, Event::KeyFrame(KeyFrameEntry { seen, ..*old }));
        }
        Rebuilt {
            planes: planes_changed(&planes, &plane_ids, before, &self.map),
            objects: objects_changed(&objects, &object_ids, before, &self.map),
            map: self.map,
            events,
        }
    }
}
