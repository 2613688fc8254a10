use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::vector3::{difference, norm};
use dymlm_core::{ObjectId, PlaneId, Succession};

use super::identities::Identities;
use super::report::{ThingChanges, ThingMotion};
use crate::MultiLevelMap;

/// What has become of the confirmed planes.
pub(super) fn planes_changed(
    identities: &Identities<PlaneId>,
    names: &Succession<PlaneId>,
    before: &MultiLevelMap,
    now: &MultiLevelMap,
) -> ThingChanges<PlaneId> {
    changes(identities, names, &plane_places(before), &plane_places(now))
}

/// What has become of the confirmed objects.
pub(super) fn objects_changed(
    identities: &Identities<ObjectId>,
    names: &Succession<ObjectId>,
    before: &MultiLevelMap,
    now: &MultiLevelMap,
) -> ThingChanges<ObjectId> {
    changes(identities, names, &object_places(before), &object_places(now))
}

/// Where the confirmed planes or objects of maps have their centres.
pub(super) type Places<Id> = BTreeMap<Id, [f64; 3]>;

pub(super) fn plane_places(map: &MultiLevelMap) -> Places<PlaneId> {
    map.planes().iter().map(|plane| (plane.id(), plane.centroid())).collect()
}

pub(super) fn object_places(map: &MultiLevelMap) -> Places<ObjectId> {
    map.objects().objects().map(|object| (object.id(), object.oriented_box().center())).collect()
}

/// The things that are there before and now, and stand elsewhere.
pub(super) fn motions<Id: Copy + Ord>(before: &Places<Id>, now: &Places<Id>) -> Vec<ThingMotion<Id>> {
    let motion = |(&id, place): (&Id, &[f64; 3])| {
        let distance = norm(difference(*now.get(&id)?, *place));
        (distance > 0.0).then_some(ThingMotion { id, distance })
    };
    before.iter().filter_map(motion).collect()
}

/// Compares the places of the confirmed things before and now.
fn changes<Id: Copy + Ord>(
    identities: &Identities<Id>,
    names: &Succession<Id>,
    before: &Places<Id>,
    now: &Places<Id>,
) -> ThingChanges<Id> {
    let parts = identities.split.iter().filter_map(|(new, &old)| Some((old, names.get(*new)?)));
    let split: Vec<(Id, Id)> = parts.filter(|(_, part)| now.contains_key(part)).collect();
    let gone = identities.merged.iter().map(|(&old, &into)| (old, into));
    let merged: Vec<(Id, Id)> = gone.filter(|(old, _)| before.contains_key(old)).collect();
    let parts: BTreeSet<Id> = split.iter().map(|(_, part)| *part).collect();
    let gone: BTreeSet<Id> = merged.iter().map(|(old, _)| *old).collect();
    ThingChanges {
        moved: motions(before, now),
        vanished: before.keys().filter(|id| !now.contains_key(id) && !gone.contains(id)).copied().collect(),
        appeared: now.keys().filter(|id| !before.contains_key(id) && !parts.contains(id)).copied().collect(),
        merged,
        split,
    }
}
