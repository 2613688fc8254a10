use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::{ObjectId, PlaneId, Pose};
use dymlm_objects::MapObject;

use super::report::{CorrectionReport, ThingChanges};
use super::thing_changes::{Places, motions, object_places, plane_places};
use crate::MultiLevelMap;
use crate::session_log::SessionLog;

/// Several corrections, one after the other, that are reported as one: from what stood where before the first
/// to what stands where after the last.
#[derive(Debug)]
pub(crate) struct JoinedCorrections {
    poses: Vec<Pose>,
    planes: JoinedChanges<PlaneId>,
    objects: JoinedChanges<ObjectId>,
}

impl JoinedCorrections {
    /// Begins with the maps before the first correction.
    pub(crate) fn of(before: &MultiLevelMap) -> Self {
        Self {
            poses: before.past.log.iter().flat_map(SessionLog::poses).collect(),
            planes: JoinedChanges::of(plane_places(before)),
            objects: JoinedChanges::of(object_places(before)),
        }
    }

    /// Adds a correction.
    pub(crate) fn add(&mut self, report: &CorrectionReport) {
        self.planes.add(&report.planes);
        self.objects.add(&report.objects);
    }

    /// What the corrections have done together, with the maps after the last and their log.
    pub(crate) fn report(&self, now: &MultiLevelMap, log: &SessionLog) -> CorrectionReport {
        let mut report = CorrectionReport::unchanged(log);
        let poses: Vec<Pose> = log.poses().collect();
        report.note_motions(log, now.config.sensor.max_depth, [&self.poses, &poses]);
        if let Some((old, new)) = self.poses.last().zip(poses.last()).filter(|(old, new)| old != new) {
            report.new_from_old = *new * old.inverse();
        }
        report.planes = self.planes.changes(&plane_places(now), |id| now.planes().current_id(id));
        let current = |id| now.objects().object(id).map(MapObject::id);
        report.objects = self.objects.changes(&object_places(now), current);
        report
    }
}

/// What becomes of planes or objects in several corrections.
#[derive(Debug)]
struct JoinedChanges<Id> {
    /// The confirmed things before the first correction.
    before: Places<Id>,
    /// For each part of a split thing, that thing.
    split: BTreeMap<Id, Id>,
}

impl<Id: Copy + Ord> JoinedChanges<Id> {
    fn of(before: Places<Id>) -> Self {
        Self { before, split: BTreeMap::new() }
    }

    fn add(&mut self, changes: &ThingChanges<Id>) {
        self.split.extend(changes.split.iter().map(|&(whole, part)| (part, whole)));
    }

    /// `current`: where an id of a thing leads now.
    fn changes(&self, now: &Places<Id>, current: impl Fn(Id) -> Option<Id>) -> ThingChanges<Id> {
        let mut changes = ThingChanges::none();
        changes.moved = motions(&self.before, now);
        for &id in self.before.keys().filter(|id| !now.contains_key(id)) {
            match current(id).filter(|into| *into != id) {
                Some(into) => changes.merged.push((id, into)),
                None => changes.vanished.push(id),
            }
        }
        for &id in now.keys().filter(|id| !self.before.contains_key(id)) {
            match self.whole(id) {
                Some(whole) => changes.split.push((whole, id)),
                None => changes.appeared.push(id),
            }
        }
        changes
    }

    /// The thing of which this one has become a part, in whichever of the corrections: a part of a part is one
    /// of the whole.
    fn whole(&self, part: Id) -> Option<Id> {
        let mut passed = BTreeSet::from([part]);
        let mut whole = *self.split.get(&part)?;
        while let Some(&next) = self.split.get(&whole).filter(|_| !self.before.contains_key(&whole)) {
            // Ids that come and go may have been parts of each other.
            if !passed.insert(whole) {
                break;
            }
            whole = next;
        }
        Some(whole)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_came_and_went_between_is_not_named() {
        let places = |ids: &[u64]| ids.iter().map(|&id| (PlaneId::new(id), [id as f64, 0.0, 0.0])).collect();
        let [one, two, three, four, five, six] = [1, 2, 3, 4, 5, 6].map(PlaneId::new);
        let mut joined = JoinedChanges::of(places(&[1, 2, 3]));
        let mut changes = ThingChanges::none();
        // 4 is a part of 1, and 5 of 4; 6 appears; 2 is merged into 3.
        (changes.split, changes.appeared, changes.merged) =
            (vec![(one, four)], vec![six], vec![(two, three)]);
        joined.add(&changes);
        let mut changes = ThingChanges::none();
        (changes.split, changes.vanished) = (vec![(four, five)], vec![four, six]);
        joined.add(&changes);
        let mut now: Places<PlaneId> = places(&[1, 3, 5]);
        now.insert(one, [1.0, 0.0, 2.0]);
        let all = joined.changes(&now, |id| if id == two { Some(three) } else { None });
        assert_eq!((all.split, all.merged), (vec![(one, five)], vec![(two, three)]));
        assert_eq!((all.appeared, all.vanished), (vec![], vec![]));
        assert_eq!(
            all.moved.iter().map(|moved| (moved.id, moved.distance)).collect::<Vec<_>>(),
            [(one, 2.0)]
        );
    }
}
