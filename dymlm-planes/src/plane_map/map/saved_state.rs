use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::paging::FiledMap;
use dymlm_core::{
    Birth, DamagedState, FrameId, MergedIds, Names, Plane, PlaneId, SensorModel, StateSink, decode_part,
    encode_part,
};
use serde::{Deserialize, Serialize};

use super::{Dropped, GapRecord, KeyFrame, MapPlane, PlaneMap, PlaneMapConfig};
use crate::error::Error;
use crate::patches::{BlockKey, SavedBlock, VoxelBox};
use crate::plane_map::fixed_moments::{FixedMoments, REACH};
use crate::plane_map::judgement::Judgement;
use crate::plane_map::looks::Look;
use crate::plane_map::map_plane::{ShapeSettings, Sightings};
use crate::shared_map::SharedMap;

/// Kinds of parts: the lowest bits of a part's key.
const HEAD: u64 = 0;
const KEY_FRAME: u64 = 1;
const PLANE: u64 = 2;
/// The voxels of all planes in a cube of blocks: a frame touches a few cubes, even of a large floor.
const CUBE: u64 = 3;

/// What is small, or changes with each frame. The spatial index is not saved but rebuilt.
#[derive(Serialize, Deserialize)]
struct Head {
    planes: Vec<Birth>,
    /// Ids of the key frames as runs: the first id and the number of consecutive ones.
    key_frames: Vec<(u64, u64)>,
    look: Option<Look>,
    merged: MergedIds<Birth>,
    dropped: Dropped,
    gaps: GapRecord,
    names: Names<PlaneId>,
    merged_ids: MergedIds<PlaneId>,
    next_key_frame: u64,
    bounds: VoxelBox,
}

/// A plane without its voxels.
#[derive(Serialize, Deserialize)]
struct SavedPlane {
    normal: [f64; 3],
    d: f64,
    centroid: [f64; 3],
    mse: f64,
    sightings: Sightings,
    is_confirmed: bool,
    is_gone: bool,
    moments: FixedMoments,
    judged: BTreeMap<BlockKey, Judgement>,
    most_stood: usize,
    /// Number of blocks that hold its voxels.
    blocks: usize,
}

/// Blocks of voxels, each with its plane.
type SavedCube = Vec<(Birth, SavedBlock)>;

fn part_of(kind: u64, number: u64) -> u64 {
    number << 2 | kind
}

impl PlaneMap {
    /// Writes to `sink` the parts of the map that differ from those of an `earlier` state, or all parts
    /// without one. What the two share is skipped, after a comparison of pointers for each plane, block and
    /// key frame.
    ///
    /// # Errors
    ///
    /// Errors of `sink`.
    pub fn save_state(&self, earlier: Option<&Self>, sink: &mut StateSink<'_>) -> std::io::Result<()> {
        let none = (SharedMap::default(), FiledMap::default());
        let (planes, key_frames) =
            earlier.map_or((&none.0, &none.1), |earlier| (&earlier.planes, &earlier.key_frames));
        for (id, key_frame) in self.key_frames.changed_since(key_frames) {
            sink(part_of(KEY_FRAME, id.get()), Some(&encode_part(&*key_frame)?))?;
        }
        for id in key_frames.gone_from(&self.key_frames) {
            sink(part_of(KEY_FRAME, id.get()), None)?;
        }
        let mut cubes: BTreeSet<u64> = BTreeSet::new();
        for (id, plane) in self.planes.changed_since(planes) {
            sink(part_of(PLANE, id.get()), Some(&encode_part(&SavedPlane::of(plane))?))?;
            cubes.extend(plane.patch.blocks_that_differ(planes.get(id).map(|before| &before.patch)));
        }
        for id in planes.gone_from(&self.planes) {
            sink(part_of(PLANE, id.get()), None)?;
            cubes.extend(planes.get(id).into_iter().flat_map(|before| before.patch.blocks_that_differ(None)));
        }
        self.save_cubes(cubes, sink)?;
        let head = encode_part(&self.head())?;
        let is_known = match earlier {
            Some(earlier) => encode_part(&earlier.head())? == head,
            None => false,
        };
        if is_known { Ok(()) } else { sink(HEAD, Some(&head)) }
    }

    /// Writes the parts of some cubes, given by their [numbers](BlockKey::cube), with the voxels that all
    /// planes have in them.
    fn save_cubes(&self, cubes: BTreeSet<u64>, sink: &mut StateSink<'_>) -> std::io::Result<()> {
        let mut content: BTreeMap<u64, SavedCube> =
            cubes.into_iter().map(|cube| (cube, Vec::new())).collect();
        for (id, plane) in self.planes.iter() {
            for (cube, block) in plane.patch.saved_blocks(|cube| content.contains_key(&cube)) {
                if let Some(content) = content.get_mut(&cube) {
                    content.push((*id, block));
                }
            }
        }
        for (cube, blocks) in content {
            let bytes = (!blocks.is_empty()).then(|| encode_part(&blocks)).transpose()?;
            sink(part_of(CUBE, cube), bytes.as_deref())?;
        }
        Ok(())
    }

    fn head(&self) -> Head {
        let mut key_frames: Vec<(u64, u64)> = Vec::new();
        for id in self.key_frames.keys() {
            match key_frames.last_mut() {
                Some((first, count)) if *first + *count == id.get() => *count += 1,
                _ => key_frames.push((id.get(), 1)),
            }
        }
        Head {
            planes: self.planes.keys().copied().collect(),
            key_frames,
            look: self.look,
            merged: self.merged.clone(),
            dropped: self.dropped.clone(),
            gaps: self.gaps.clone(),
            names: self.names.clone(),
            merged_ids: self.merged_ids.clone(),
            next_key_frame: self.next_key_frame,
            bounds: self.index.bounds(),
        }
    }

    /// Restores a map, to the bit, from its parts, which may come in any order.
    ///
    /// # Errors
    ///
    /// [`Error::Config`]; [`Error::State`] names a part that is damaged, missing or surplus.
    pub fn load_state(
        config: PlaneMapConfig,
        sensor: SensorModel,
        parts: impl IntoIterator<Item = (u64, Vec<u8>)>,
    ) -> Result<Self, Error> {
        let mut by_key: BTreeMap<u64, Vec<u8>> = BTreeMap::new();
        for (part, bytes) in parts {
            if by_key.insert(part, bytes).is_some() {
                return Err(DamagedState::new(part, "it is there twice").into());
            }
        }
        Ok(Self::new(config, sensor)?.filled(by_key)?)
    }

    /// Fills an empty map.
    fn filled(mut self, mut parts: BTreeMap<u64, Vec<u8>>) -> Result<Self, DamagedState> {
        let missing = |part| DamagedState::new(part, "it is missing");
        let head: Head = decode_part(HEAD, &parts.remove(&HEAD).ok_or_else(|| missing(HEAD))?)?;
        if !head.is_possible(parts.len()) {
            return Err(DamagedState::new(HEAD, "ids or numbers that no map has"));
        }
        for number in head.key_frames.iter().flat_map(|&(first, count)| first..first + count) {
            let part = part_of(KEY_FRAME, number);
            let bytes = parts.remove(&part).ok_or_else(|| missing(part))?;
            let key_frame: KeyFrame = decode_part(part, &bytes)?;
            if !key_frame.is_possible() {
                return Err(DamagedState::new(part, "numbers that no key frame has"));
            }
            self.key_frames.insert(FrameId::new(number), key_frame);
        }
        let mut blocks = BTreeMap::new();
        for &birth in &head.planes {
            let part = part_of(PLANE, birth.get());
            let saved: SavedPlane = decode_part(part, &parts.remove(&part).ok_or_else(|| missing(part))?)?;
            blocks.insert(birth, saved.blocks);
            let plane = saved.restored((birth, head.names.id(birth)), self.shape());
            let plane = plane.ok_or_else(|| DamagedState::new(part, "numbers that no plane has"))?;
            self.planes.insert(birth, plane);
        }
        for (part, bytes) in parts {
            self.fill_cube(part, &bytes)?;
        }
        for plane in self.planes.values_mut() {
            plane.patch.finish_restoring();
            if blocks.get(&plane.birth) != Some(&plane.patch.blocks().count()) {
                return Err(DamagedState::new(part_of(PLANE, plane.birth.get()), "voxels of it are missing"));
            }
        }
        for plane in self.planes.values() {
            for block in plane.patch.blocks() {
                self.index.add(block, plane.birth);
            }
        }
        self.index.restore_bounds(head.bounds);
        (self.merged, self.dropped, self.gaps) = (head.merged, head.dropped, head.gaps);
        (self.names, self.merged_ids) = (head.names, head.merged_ids);
        (self.next_key_frame, self.look) = (head.next_key_frame, head.look);
        Ok(self)
    }

    fn fill_cube(&mut self, part: u64, bytes: &[u8]) -> Result<(), DamagedState> {
        let damaged = |what: &str| DamagedState::new(part, what);
        if part & 3 != CUBE {
            return Err(damaged("it belongs to nothing"));
        }
        let cube: SavedCube = decode_part(part, bytes)?;
        for (id, block) in cube {
            let plane = self.planes.get_mut(&id).ok_or_else(|| damaged("voxels of no plane"))?;
            let is_there = block.cube() == part >> 2 && plane.patch.restore(block);
            if !is_there {
                return Err(damaged("voxels that are invalid, outside their cube, or given twice"));
            }
        }
        Ok(())
    }
}

impl Head {
    /// Whether the numbers are plausible for a map with this many further parts.
    fn is_possible(&self, parts: usize) -> bool {
        let mut end = 0;
        let ascends = |&(first, count): &(u64, u64)| {
            let follows = first >= end && count > 0 && count <= parts as u64;
            end = first.saturating_add(count);
            follows
        };
        self.key_frames.iter().all(ascends)
            && self.key_frames.last().is_none_or(|_| end <= self.next_key_frame)
            && self.planes.is_sorted_by(|a, b| a < b)
            && self.planes.iter().all(|&plane| self.names.birth(self.names.id(plane)) == Some(plane))
            && self.planes.last().is_none_or(|last| last.get() < self.names.births())
            && self.gaps.is_possible()
            && self.dropped.keys().all(|plane| self.planes.binary_search(plane).is_err())
            && self.dropped.keys().all(|plane| plane.get() < self.names.births())
            // Numbers in keys have two bits less.
            && self.names.births().max(self.names.given()).max(self.next_key_frame) < 1 << 61
    }
}

impl SavedPlane {
    fn of(plane: &MapPlane) -> Self {
        Self {
            normal: plane.plane.normal(),
            d: plane.plane.d(),
            centroid: plane.centroid,
            mse: plane.mse,
            sightings: plane.sightings,
            is_confirmed: plane.is_confirmed,
            is_gone: plane.is_gone,
            moments: plane.moments,
            judged: plane.judged.clone(),
            most_stood: plane.most_stood,
            blocks: plane.patch.blocks().count(),
        }
    }

    /// The plane without its voxels; `None` when its numbers are not plausible.
    fn restored(self, called: (Birth, PlaneId), shape: ShapeSettings) -> Option<MapPlane> {
        let mut plane = MapPlane::new(called, Plane::of_unit_normal(self.normal, self.d)?, shape);
        // Twice the reach, because the normal may point along a diagonal.
        let is_near = self.centroid.iter().chain([&self.d]).all(|c| c.abs() < 2.0 * REACH);
        let is_possible = is_near
            && self.mse.is_finite()
            && self.sightings.is_possible()
            && self.moments.is_possible()
            && self.judged.values().all(Judgement::is_possible);
        (plane.centroid, plane.mse, plane.spread) = (self.centroid, self.mse, self.moments.spread());
        (plane.sightings, plane.moments) = (self.sightings, self.moments);
        (plane.is_confirmed, plane.is_gone) = (self.is_confirmed, self.is_gone);
        (plane.judged, plane.most_stood) = (self.judged, self.most_stood);
        is_possible.then_some(plane)
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::{DepthImage, Frame, PinholeCamera};
    use dymlm_test_support::{look_at, saved_parts};

    use super::*;
    use crate::{PlaneConfig, PlaneDetector};

    /// Regression: sums above a limit were saved, but the map could not be loaded: after 11 hours before a
    /// wall, and where a plane is seen from everywhere after months.
    #[test]
    fn a_plane_whose_sums_are_full_can_be_saved_and_taken_apart() {
        let camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5).unwrap();
        let depth = DepthImage::new(160, 120, vec![1.5; 160 * 120]).unwrap();
        let frame = Frame::new(0.0, camera, depth, None).unwrap();
        let (config, sensor) = (PlaneConfig::default(), SensorModel::kinect());
        let mut detector = PlaneDetector::new(&config.detector, &sensor).unwrap();
        let planes = detector.detect(&frame, None, &[]).unwrap().to_vec();
        let mut map = PlaneMap::new(config.map.clone(), sensor).unwrap();
        let pose = |x: f64| look_at([x, 0.0, 1.0], [x, 1.5, 1.0]);
        map.insert(&planes, &frame, &pose(0.0)).unwrap();
        let plane = map.planes.get_mut(&Birth::new(0)).unwrap();
        while plane.moments.has_room_for(&plane.moments) {
            plane.moments.add(&plane.moments.clone());
        }
        let load = |map: &PlaneMap| {
            let parts = saved_parts(|sink| map.save_state(None, sink));
            PlaneMap::load_state(config.map.clone(), sensor, parts)
        };
        let before = map.planes.get(&Birth::new(0)).unwrap().clone();
        let mut key_frames = Vec::new();
        for view in 0..400 {
            let x = if view % 2 == 0 { -0.3 } else { 0.3 };
            key_frames.push(map.insert(&planes, &frame, &pose(x)).unwrap().key_frame);
        }
        let full = &load(&map).unwrap().planes;
        assert_eq!(full.keys().count(), 1);
        assert!((full.get(&Birth::new(0)).unwrap().centroid[1] - 1.5).abs() < 1e-3);
        for key_frame in key_frames {
            map.remove(key_frame).unwrap();
        }
        assert!(map.planes.get(&Birth::new(0)) == Some(&before));
        load(&map).unwrap();
    }

    /// A plane's cells once were counted from its centroid, which overflowed here. (Found by `saved_planes`.)
    #[test]
    fn a_plane_out_of_reach_is_not_restored() {
        let shape = ShapeSettings { voxel_size: 0.05, max_hole_area: 0.1, boundary_tolerance: 0.05 };
        let called = (Birth::new(0), PlaneId::new(0));
        let plane = MapPlane::new(called, Plane::new([0.0, 0.0, 1.0], -1.0).unwrap(), shape);
        assert!(SavedPlane::of(&plane).restored(called, shape).is_some());
        let far = SavedPlane { centroid: [0.0, 1e300, 0.0], ..SavedPlane::of(&plane) };
        assert!(far.restored(called, shape).is_none());
        let far = SavedPlane { d: 1e300, ..SavedPlane::of(&plane) };
        assert!(far.restored(called, shape).is_none());
    }
}
