use std::collections::BTreeMap;

use dymlm_cloud::CloudBlock;
use dymlm_core::{ObjectId, PlaneId};
use dymlm_objects::MapObject;
use dymlm_octree::Extent;
use dymlm_planes::MapPlane;

use crate::{MultiLevelMap, Revision};

/// What differs between two states of the maps.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MapChanges {
    /// The earlier state.
    pub from: Revision,
    /// The later state.
    pub to: Revision,
    /// Blocks of the static cloud, as they are now.
    pub cloud: Vec<CloudBlock>,
    /// Where cells of the octree differ.
    pub octree: Vec<Extent>,
    /// Confirmed planes.
    pub planes: ChangedThings<PlaneId>,
    /// Confirmed objects.
    pub objects: ChangedThings<ObjectId>,
}

/// Planes or objects that differ, ascending.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct ChangedThings<Id> {
    /// Those that are confirmed now and were not.
    pub confirmed: Vec<Id>,
    /// Those that were confirmed and still are, and that were seen more often or stand elsewhere.
    pub changed: Vec<Id>,
    /// Those that were merged into another, with that other.
    pub merged: Vec<(Id, Id)>,
    /// Those that are no longer there, or no longer confirmed.
    pub removed: Vec<Id>,
}

impl MultiLevelMap {
    /// What has changed since an earlier state, such as one that a [reader](crate::MapReader) gave before.
    /// Any number of consumers may ask, each with the state that it knows. A consumer that applies the
    /// changes to its copy of the earlier state has this one.
    ///
    /// O(blocks of the cloud / 64, planes and objects), a comparison of pointers each, and what has changed.
    /// This holds while both are states of the same maps: after poses were corrected, or distant parts were
    /// forgotten, it is O(all that they hold).
    pub fn changes_since(&self, earlier: &Self) -> MapChanges {
        MapChanges {
            from: earlier.revision,
            to: self.revision,
            cloud: self.cloud.changes_since(&earlier.cloud),
            octree: self.octree.changes_since(&earlier.octree),
            planes: changed_things(
                &earlier.planes.iter().map(|plane| (plane.id(), plane)).collect(),
                &self.planes.iter().map(|plane| (plane.id(), plane)).collect(),
                differ_as_planes,
                |id| self.planes.current_id(id),
            ),
            objects: changed_things(
                &earlier.objects().objects().map(|object| (object.id(), object)).collect(),
                &self.objects().objects().map(|object| (object.id(), object)).collect(),
                differ_as_objects,
                |id| self.objects().object(id).map(MapObject::id),
            ),
        }
    }
}

fn differ_as_planes(a: &MapPlane, b: &MapPlane) -> bool {
    let seen = |plane: &MapPlane| {
        let weight = plane.weight().to_bits();
        (plane.plane(), plane.centroid(), plane.observations(), plane.inlier_voxels(), weight)
    };
    seen(a) != seen(b)
}

fn differ_as_objects(a: &MapObject, b: &MapObject) -> bool {
    let seen = |object: &MapObject| (object.oriented_box(), object.observations(), object.point_count());
    seen(a) != seen(b) || a.label() != b.label()
}

fn changed_things<Id: Copy + Ord, T>(
    before: &BTreeMap<Id, &T>,
    now: &BTreeMap<Id, &T>,
    differ: impl Fn(&T, &T) -> bool,
    current_id: impl Fn(Id) -> Option<Id>,
) -> ChangedThings<Id> {
    // Both states share what has not changed.
    let has_changed = |old: &T, new: &T| !std::ptr::eq(old, new) && differ(old, new);
    let merged =
        |id: Id| current_id(id).filter(|into| *into != id && now.contains_key(into)).map(|into| (id, into));
    let gone = || before.keys().copied().filter(|id| !now.contains_key(id));
    let mut things = ChangedThings {
        confirmed: Vec::new(),
        changed: Vec::new(),
        merged: gone().filter_map(merged).collect(),
        removed: gone().filter(|&id| merged(id).is_none()).collect(),
    };
    for (&id, new) in now {
        match before.get(&id) {
            None => things.confirmed.push(id),
            Some(old) if has_changed(old, new) => things.changed.push(id),
            Some(_) => {}
        }
    }
    things
}
