use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use dymlm_core::{
    Birth, DamagedState, MergedIds, Names, ObjectId, PlaneId, SensorModel, StateSink, decode_part,
    encode_part,
};
use serde::{Deserialize, Serialize};

use crate::object_map::MapObject;
use crate::parameterization::VerticalVotes;
use crate::{Error, ObjectConfig, ObjectMapper};

/// Key of the part that holds everything but the objects. An object's part has the key 1 + its birth.
const HEAD: u64 = 0;

/// What is saved of a mapper besides its objects. The spatial index is not saved but rebuilt.
#[derive(Serialize, Deserialize)]
struct Head {
    last_timestamp: Option<f64>,
    /// Times of the last three runs of the detector, seconds.
    times: [f64; 3],
    held: BTreeMap<Birth, bool>,
    changed: BTreeSet<Birth>,
    supports: BTreeSet<PlaneId>,
    vertical: VerticalVotes,
    names: Names<ObjectId>,
    absorbed_by: MergedIds<ObjectId>,
    objects: Vec<Birth>,
}

fn part_of(birth: Birth) -> u64 {
    birth.get().wrapping_add(1)
}

impl ObjectMapper {
    /// Writes to `sink` the parts of the map that differ from those of an `earlier` state, or all parts
    /// without one: one part per object, and one for the rest.
    ///
    /// # Errors
    ///
    /// Errors of `sink`.
    pub fn save_state(&self, earlier: Option<&Self>, sink: &mut StateSink<'_>) -> std::io::Result<()> {
        let before = |birth| {
            let map = &earlier?.map;
            map.objects.get(map.place(birth)?)
        };
        for object in &self.map.objects {
            if !before(object.birth).is_some_and(|before| Arc::ptr_eq(before, object)) {
                sink(part_of(object.birth), Some(&encode_part(object.as_ref())?))?;
            }
        }
        for object in earlier.into_iter().flat_map(|earlier| &earlier.map.objects) {
            if self.map.place(object.birth).is_none() {
                sink(part_of(object.birth), None)?;
            }
        }
        let head = encode_part(&self.head())?;
        let is_known = match earlier {
            Some(earlier) => encode_part(&earlier.head())? == head,
            None => false,
        };
        if is_known { Ok(()) } else { sink(HEAD, Some(&head)) }
    }

    /// Restores a mapper, to the bit, from its parts, which may come in any order.
    ///
    /// # Errors
    ///
    /// [`Error::Config`]; [`Error::State`] names a part that is damaged, missing or surplus.
    pub fn load_state(
        config: ObjectConfig,
        sensor: SensorModel,
        parts: impl IntoIterator<Item = (u64, Vec<u8>)>,
    ) -> Result<Self, Error> {
        let mut mapper = Self::new(config, sensor)?;
        let mut by_key: BTreeMap<u64, Vec<u8>> = BTreeMap::new();
        for (part, bytes) in parts {
            if by_key.insert(part, bytes).is_some() {
                return Err(DamagedState::new(part, "it is there twice").into());
            }
        }
        let head = by_key.remove(&HEAD).ok_or_else(|| DamagedState::new(HEAD, "it is missing"))?;
        let head: Head = decode_part(HEAD, &head)?;
        if !head.is_possible() {
            return Err(DamagedState::new(HEAD, "ids or numbers that no map has").into());
        }
        for &birth in &head.objects {
            let part = part_of(birth);
            let bytes = by_key.remove(&part).ok_or_else(|| DamagedState::new(part, "it is missing"))?;
            let object: MapObject = decode_part(part, &bytes)?;
            let is_it = object.birth == birth && head.names.birth(object.id) == Some(birth);
            if !is_it || !object.is_possible() {
                return Err(DamagedState::new(part, "another object, or numbers that no object has").into());
            }
            mapper.map.index.place(&object);
            mapper.map.objects.push(Arc::new(object));
        }
        if let Some((part, _)) = by_key.pop_first() {
            return Err(DamagedState::new(part, "it belongs to nothing").into());
        }
        mapper.restore(head);
        Ok(mapper)
    }

    fn head(&self) -> Head {
        Head {
            last_timestamp: self.last_timestamp,
            times: self.associator.times(),
            held: self.held.clone(),
            changed: self.changed.clone(),
            supports: self.supports.clone(),
            vertical: self.vertical.votes().clone(),
            names: self.map.names.clone(),
            absorbed_by: self.map.absorbed_by.clone(),
            objects: self.map.objects.iter().map(|object| object.birth).collect(),
        }
    }

    fn restore(&mut self, head: Head) {
        let Head { last_timestamp, times, held, changed, supports, vertical, names, absorbed_by, .. } = head;
        (self.last_timestamp, self.held, self.changed) = (last_timestamp, held, changed);
        self.supports = supports;
        self.associator.restore_times(times);
        self.vertical.restore(vertical);
        (self.map.names, self.map.absorbed_by) = (names, absorbed_by);
    }
}

impl Head {
    /// Whether the numbers are plausible: births ascend and were given, times and directions are finite.
    fn is_possible(&self) -> bool {
        self.objects.is_sorted_by(|a, b| a < b)
            && self.objects.last().is_none_or(|last| last.get() < self.names.births())
            && self.names.births().max(self.names.given()) < u64::MAX / 2
            && self.last_timestamp.is_none_or(f64::is_finite)
            && self.are_times_possible()
            && self.vertical.is_possible()
    }

    /// Whether the newest time is that of the last frame with detections, and the times are in order.
    fn are_times_possible(&self) -> bool {
        let [newest, last, before] = self.times;
        self.last_timestamp.map_or(newest.is_nan(), |timestamp| timestamp == newest)
            && [[last, newest], [before, last]].into_iter().all(|[a, b]| a.is_nan() || a <= b)
    }
}
