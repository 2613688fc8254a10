use std::collections::BTreeSet;

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
    /// From which state.
    pub from: Revision,
    /// To which.
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
    /// Those that were and are, and of which more was seen, or that stand elsewhere.
    pub changed: Vec<Id>,
    /// Those that are one with another now, and that other.
    pub merged: Vec<(Id, Id)>,
    /// Those that are there no more, or not confirmed any more.
    pub removed: Vec<Id>,
}

impl MultiLevelMap {
    /// What has changed since an earlier state, such as the one that a [reader](crate::MapReader) gave
    /// before: any number of consumers, each with the state that it knows. Who replaces these in a copy has
    /// this state.
    ///
    /// O(blocks), a comparison of pointers each while the cloud is the same one (until poses are corrected or
    /// what is far is forgotten: then of points), of nodes of the octree, and what has changed.
    pub fn changes_since(&self, earlier: &Self) -> MapChanges {
        let plane_ids = |map: &Self| -> BTreeSet<PlaneId> { map.planes.iter().map(MapPlane::id).collect() };
        let object_ids =
            |map: &Self| -> BTreeSet<ObjectId> { map.objects().objects().map(MapObject::id).collect() };
        let plane = |map: &Self, id| {
            let plane = map.planes.plane(id)?;
            Some((plane.plane(), plane.observations(), plane.inlier_voxels(), plane.weight().to_bits()))
        };
        let object = |map: &Self, id| {
            let object = map.objects().object(id)?;
            Some((
                object.oriented_box(),
                object.label().to_owned(),
                object.observations(),
                object.point_count(),
            ))
        };
        MapChanges {
            from: earlier.revision,
            to: self.revision,
            cloud: self.cloud.changes_since(&earlier.cloud),
            octree: self.octree.changes_since(&earlier.octree),
            planes: changed_things(
                &plane_ids(earlier),
                &plane_ids(self),
                |id| plane(self, id) != plane(earlier, id),
                |id| self.planes.current_id(id),
            ),
            objects: changed_things(
                &object_ids(earlier),
                &object_ids(self),
                |id| object(self, id) != object(earlier, id),
                |id| self.objects().object(id).map(MapObject::id),
            ),
        }
    }
}

fn changed_things<Id: Copy + Ord>(
    before: &BTreeSet<Id>,
    now: &BTreeSet<Id>,
    has_changed: impl Fn(Id) -> bool,
    current_id: impl Fn(Id) -> Option<Id>,
) -> ChangedThings<Id> {
    let gone = || before.difference(now).copied();
    let merged =
        |id: Id| current_id(id).filter(|into| *into != id && now.contains(into)).map(|into| (id, into));
    ChangedThings {
        confirmed: now.difference(before).copied().collect(),
        changed: now.intersection(before).copied().filter(|&id| has_changed(id)).collect(),
        merged: gone().filter_map(merged).collect(),
        removed: gone().filter(|&id| merged(id).is_none()).collect(),
    }
}
