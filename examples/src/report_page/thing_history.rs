use std::collections::BTreeMap;

use dymlm::core::{ObjectId, PlaneId};
use dymlm::{FrameReport, MovedObject, WorldChanges};
use serde::Serialize;

use super::things::millimetres;

/// Something that has happened to a plane or an object.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Event {
    /// Seconds, the maps' clock.
    pub(super) time: f64,
    #[serde(flatten)]
    pub(super) what: What,
}

/// What has happened.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub(super) enum What {
    /// It was seen for the first time.
    Created,
    /// It has become a part of the map.
    Confirmed,
    /// It is a candidate again.
    Unconfirmed,
    /// Another was found to be the same, and went into it.
    Merged { other: String },
    /// The evidence has found nothing there.
    Removed,
    /// It stood elsewhere.
    Moved { other: String, from: [f64; 3], to: [f64; 3], distance: f64 },
    /// It stands elsewhere, as another object.
    MovedTo { other: String, to: [f64; 3], distance: f64 },
    /// It came into what was empty space.
    Appeared,
    /// Its place is empty space now.
    Vanished,
}

/// What has happened to planes and objects, in the order in which it did.
#[derive(Debug, Clone, Default)]
pub(super) struct ThingHistory {
    planes: BTreeMap<PlaneId, Vec<Event>>,
    objects: BTreeMap<ObjectId, Vec<Event>>,
}

impl ThingHistory {
    /// Collects what the reports of a run say; `clock_offset` makes their times the maps'.
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

    /// Takes in what two states of the maps say of one another.
    pub(super) fn take_in_changes(&mut self, changes: &WorldChanges) {
        for moved in &changes.moved {
            let MovedObject { from, to, .. } = moved;
            let [start, end] = [from, to].map(|found| millimetres(found.oriented_box.center()));
            let distance = moved.distance();
            let name = |id: ObjectId, label: &str| format!("{label} {}", id.get());
            let other = name(from.id, &from.label);
            self.add_once(to.id, to.seen[0], What::Moved { other, from: start, to: end, distance });
            let other = name(to.id, &to.label);
            self.add_once(from.id, to.seen[0], What::MovedTo { other, to: end, distance });
        }
        for found in &changes.appeared {
            self.add_once(found.id, found.seen[0], What::Appeared);
        }
        for found in &changes.vanished {
            self.add_once(found.id, found.seen[1], What::Vanished);
        }
    }

    /// Several states of before may tell of one change.
    fn add_once(&mut self, id: ObjectId, time: f64, what: What) {
        let events = self.objects.entry(id).or_default();
        let is_known =
            events.iter().any(|event| std::mem::discriminant(&event.what) == std::mem::discriminant(&what));
        if !is_known {
            events.push(Event { time, what });
            events.sort_by(|a, b| a.time.total_cmp(&b.time));
        }
    }

    pub(super) fn of_plane(&self, id: PlaneId) -> Vec<Event> {
        self.planes.get(&id).cloned().unwrap_or_default()
    }

    pub(super) fn of_object(&self, id: ObjectId) -> Vec<Event> {
        self.objects.get(&id).cloned().unwrap_or_default()
    }
}
