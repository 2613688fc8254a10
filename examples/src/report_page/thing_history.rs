use std::collections::BTreeMap;

use dymlm::core::vector3::{difference, norm};
use dymlm::core::{ObjectId, PlaneId};
use dymlm::{FoundObject, FrameReport, WorldChanges};
use serde::Serialize;

use super::things::{PageObject, millimetres};

/// An event in the history of a plane or an object.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Event {
    /// Seconds, the maps' clock.
    pub(super) time: f64,
    #[serde(flatten)]
    pub(super) what: What,
}

/// The kind of an event.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub(super) enum What {
    /// It was seen for the first time.
    Created,
    /// It has become part of the map.
    Confirmed,
    /// It is a candidate again.
    Unconfirmed,
    /// Another was found to be the same and was merged into it.
    Merged { other: String },
    /// It was removed, since the evidence shows free space there.
    Removed,
    /// It has moved here from elsewhere.
    Moved { other: String, from: [f64; 3], to: [f64; 3], distance: f64 },
    /// It has moved elsewhere and is another object there.
    MovedTo { other: String, to: [f64; 3], distance: f64 },
    /// It appeared in space that was empty before.
    Appeared,
    /// It vanished: its place is empty now.
    Vanished,
}

/// The events of planes and objects in the order in which they happened.
#[derive(Debug, Clone, Default)]
pub(super) struct ThingHistory {
    planes: BTreeMap<PlaneId, Vec<Event>>,
    objects: BTreeMap<ObjectId, Vec<Event>>,
}

impl ThingHistory {
    /// Collects the events in the reports of a run; adding `clock_offset` to their times gives the maps'
    /// times.
    pub(super) fn of_reports(reports: &[FrameReport], clock_offset: f64) -> Self {
        let mut history = Self::default();
        for report in reports {
            history.take_in(report, clock_offset);
        }
        history
    }

    fn take_in(&mut self, report: &FrameReport, clock_offset: f64) {
        let Some(update) = report.update() else { return };
        let time = report.timestamp + clock_offset;
        let event = |what| Event { time, what };
        for &id in &update.planes.created {
            self.planes.entry(id).or_default().push(event(What::Created));
        }
        for merge in &update.planes.merged {
            let other = format!("plane {}", merge.from.get());
            self.planes.entry(merge.into).or_default().push(event(What::Merged { other }));
        }
        let objects = &update.objects;
        let simple = [
            (&objects.created, What::Created),
            (&objects.confirmed, What::Confirmed),
            (&objects.unconfirmed, What::Unconfirmed),
            (&objects.removed, What::Removed),
        ];
        for (ids, what) in simple {
            for &id in ids {
                self.objects.entry(id).or_default().push(event(what.clone()));
            }
        }
        for merge in &objects.merged {
            let other = format!("object {}", merge.removed.get());
            self.objects.entry(merge.kept).or_default().push(event(What::Merged { other }));
        }
    }

    /// Adds the move of an object, which may have another id at its new place.
    pub(super) fn take_in_move(&mut self, from: &Stand<'_>, to: &Stand<'_>) {
        let [start, end] = [from, to].map(|stand| millimetres(stand.center));
        let distance = norm(difference(end, start));
        let time = to.seen[0];
        let other = from.name();
        self.add(to.id, Event { time, what: What::Moved { other, from: start, to: end, distance } });
        if from.id != to.id {
            let other = to.name();
            self.add(from.id, Event { time, what: What::MovedTo { other, to: end, distance } });
        }
    }

    /// Adds the changes since the maps that were resumed.
    pub(super) fn take_in_changes(&mut self, changes: &WorldChanges) {
        for moved in &changes.moved {
            self.take_in_move(&Stand::of(&moved.from), &Stand::of(&moved.to));
        }
        for found in &changes.appeared {
            self.add(found.id, Event { time: found.seen[0], what: What::Appeared });
        }
        for found in &changes.vanished {
            self.add(found.id, Event { time: found.seen[1], what: What::Vanished });
        }
    }

    /// Inserts an event before those of later times.
    fn add(&mut self, id: ObjectId, event: Event) {
        let events = self.objects.entry(id).or_default();
        events.push(event);
        events.sort_by(|a, b| a.time.total_cmp(&b.time));
    }

    pub(super) fn of_plane(&self, id: PlaneId) -> Vec<Event> {
        self.planes.get(&id).cloned().unwrap_or_default()
    }

    pub(super) fn of_object(&self, id: ObjectId) -> Vec<Event> {
        self.objects.get(&id).cloned().unwrap_or_default()
    }
}

/// An object at a place.
pub(super) struct Stand<'a> {
    id: ObjectId,
    label: &'a str,
    center: [f64; 3],
    /// When it was first and last seen there, seconds.
    seen: [f64; 2],
}

impl<'a> Stand<'a> {
    fn of(found: &'a FoundObject) -> Self {
        Self { id: found.id, label: &found.label, center: found.oriented_box.center(), seen: found.seen }
    }

    fn name(&self) -> String {
        format!("{} {}", self.label, self.id.get())
    }
}

impl<'a> From<&'a PageObject> for Stand<'a> {
    fn from(object: &'a PageObject) -> Self {
        let seen = [object.first_seen, object.last_seen];
        Self { id: ObjectId::new(object.id), label: &object.label, center: object.translation, seen }
    }
}
