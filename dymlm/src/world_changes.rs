use dymlm_cloud::CloudMap;
use dymlm_core::ObjectId;
use dymlm_core::vector3::{difference, norm};
use dymlm_geometry::OrientedBox;
use dymlm_objects::MapObject;

use crate::MultiLevelMap;

/// An object is no longer, or was not yet, in a place where more than this share of its seen points is empty
/// space.
const EMPTY_SHARE: f64 = 0.5;
/// At least this share of its points must have been seen to say so.
const SEEN_SHARE: f64 = 0.5;

/// How the world differs between two states of its maps.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct WorldChanges {
    /// Objects that stand elsewhere.
    pub moved: Vec<MovedObject>,
    /// Objects that stand in what was empty space.
    pub appeared: Vec<FoundObject>,
    /// Objects in whose place there is empty space now.
    pub vanished: Vec<FoundObject>,
}

/// An object as maps have it.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct FoundObject {
    /// Its id in those maps.
    pub id: ObjectId,
    /// Its label.
    pub label: String,
    /// Its box, world.
    pub oriented_box: OrientedBox,
    /// When it was seen first and last, seconds on the maps' clock.
    pub seen: [f64; 2],
}

/// An object that stands elsewhere now.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MovedObject {
    /// The object in the earlier maps.
    pub from: FoundObject,
    /// The object in the later maps.
    pub to: FoundObject,
}

impl MovedObject {
    /// Distance between the centres of both boxes, metres.
    pub fn distance(&self) -> f64 {
        norm(difference(self.to.oriented_box.center(), self.from.oriented_box.center()))
    }
}

impl FoundObject {
    fn of(object: &MapObject) -> Self {
        Self {
            id: object.id(),
            label: object.label().to_owned(),
            oriented_box: object.oriented_box(),
            seen: [object.first_seen(), object.last_seen()],
        }
    }

    /// Whether another may be the same thing: it has the same label and about the same size.
    fn may_be(&self, other: &Self) -> bool {
        self.label == other.label && size_overlap(&self.oriented_box, &other.oriented_box) > 0.5
    }
}

impl MultiLevelMap {
    /// What has moved, appeared and vanished since an earlier state of the maps, or since another map of the
    /// same world was made (yesterday's and today's, both loaded, for example).
    ///
    /// The evidence decides, so that only places that were seen both times are compared: an object has
    /// vanished when most of what it was is empty space now, and has appeared when most of what it is was
    /// empty space before. Objects that were occluded, or never seen, do not count. A vanished and an
    /// appeared object with the same label and about the same size are one that has moved; of several such
    /// pairs the nearest are chosen first. O(points of the objects).
    pub fn world_changes_since(&self, earlier: &Self) -> WorldChanges {
        let vanished = misplaced(earlier, self.cloud());
        let appeared = misplaced(self, earlier.cloud());
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (v, from) in vanished.iter().enumerate() {
            for (a, to) in appeared.iter().enumerate().filter(|(_, to)| from.may_be(to)) {
                let [from, to] = [from, to].map(|object| object.oriented_box.center());
                pairs.push((norm(difference(to, from)), v, a));
            }
        }
        pairs.sort_by(|one, other| one.0.total_cmp(&other.0));
        let [mut vanished, mut appeared] =
            [vanished, appeared].map(|objects| objects.into_iter().map(Some).collect::<Vec<_>>());
        let mut moved = Vec::new();
        for (_, v, a) in pairs {
            if vanished[v].is_some() && appeared[a].is_some() {
                let both = vanished[v].take().zip(appeared[a].take());
                moved.extend(both.map(|(from, to)| MovedObject { from, to }));
            }
        }
        moved.sort_by_key(|moved| moved.from.id);
        let [vanished, appeared] = [vanished, appeared].map(|rest| rest.into_iter().flatten().collect());
        WorldChanges { moved, appeared, vanished }
    }
}

/// The objects of a map in whose place another cloud has empty space.
fn misplaced(map: &MultiLevelMap, cloud: &CloudMap) -> Vec<FoundObject> {
    let verdicts = cloud.verdicts();
    let is_misplaced = |object: &&MapObject| {
        let (mut points, mut seen, mut empty) = (0_usize, 0_usize, 0_usize);
        for place in object.points() {
            let is_empty = verdicts.is_empty(place);
            points += 1;
            seen += usize::from(is_empty.is_some());
            empty += usize::from(is_empty == Some(true));
        }
        seen > 0 && seen as f64 >= SEEN_SHARE * points as f64 && empty as f64 > EMPTY_SHARE * seen as f64
    };
    map.objects().objects().filter(is_misplaced).map(FoundObject::of).collect()
}

/// Intersection over union of the volumes of two boxes that are laid into each other.
fn size_overlap(one: &OrientedBox, other: &OrientedBox) -> f64 {
    let sorted = |body: &OrientedBox| {
        let mut lengths = body.lengths();
        lengths.sort_by(f64::total_cmp);
        lengths
    };
    let (a, b) = (sorted(one), sorted(other));
    let common: f64 = a.iter().zip(b).map(|(a, b)| a.min(b)).product();
    let [volume_a, volume_b] = [a, b].map(|lengths| lengths.iter().product::<f64>());
    common / (volume_a + volume_b - common)
}
