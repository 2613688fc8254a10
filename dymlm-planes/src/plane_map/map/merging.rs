use std::sync::Arc;

use dymlm_core::{Birth, DepthView, FrameId, Pose};

use super::super::gap::{Gap, GapLook};
use super::super::gap_record::{GapLooks, GapRecord, PlanePair, pair_of, resolve_looks};
use super::super::insertion::{Insertion, Union};
use super::super::key_frame::{KeyFrame, Merge};
use super::super::looks::Looks;
use super::super::map_plane::MapPlane;
use super::PlaneMap;
use crate::association::Agreement;
use crate::detector::RayLattice;
use crate::patches::VoxelBox;

/// Two planes of the map that prove to be one.
#[derive(Debug, Clone, Copy)]
struct FoundMerge {
    cost: f64,
    merge: Union,
    tie: Tie,
}

/// Why two planes are one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tie {
    /// Their patches adjoin.
    Contact,
    /// Something nearer occludes the gap between them.
    OccludedGap,
}

/// What a key frame shows between planes.
pub(super) struct Seen<'a> {
    /// For each site of the lattice 1 + the index of the detected plane that it shows, or 0.
    pub(super) labels: &'a [u16],
    pub(super) lattice: RayLattice,
    /// The steps between planes, with their heights in micrometres.
    pub(super) steps: &'a [(PlanePair, u32)],
    pub(super) view: &'a DepthView<'a>,
}

impl Seen<'_> {
    /// The index of the detected plane that is read where a point (camera's frame) is, or would be.
    fn plane_at(&self, [x, y, z]: [f64; 3]) -> Option<usize> {
        let site = self.lattice.site([x / z, y / z]).filter(|_| z > 0.0)?;
        usize::from(*self.labels.get(site)?).checked_sub(1)
    }
}

/// Merging of planes of the map that prove to be one.
impl PlaneMap {
    /// Checks the gaps between planes that this key frame has touched and planes of the map that are coplanar
    /// with them, near the region that the key frame has seen.
    pub(super) fn look_between(
        &self,
        insertion: &Insertion,
        seen: &Seen<'_>,
        region: &VoxelBox,
        camera_from_world: &Pose,
    ) -> GapLooks {
        let (region, near) = self.near_seen(region);
        let mut pairs: Vec<PlanePair> = insertion
            .touched()
            .flat_map(|a| near.iter().filter(move |b| **b != a).map(move |b| pair_of(a, *b)))
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        let look = |pair: PlanePair| {
            if let Some((_, height)) = seen.steps.iter().find(|(parted, _)| *parted == pair) {
                return Some((pair, GapLook::Step(*height)));
            }
            let [a, b] = pair.map(|birth| self.planes.get(&birth));
            let (a, b) = (a?, b?);
            if self.reads_as_one([a, b], insertion, seen, camera_from_world) {
                return Some((pair, GapLook::Joined));
            }
            let gap_look = self.gap_between(a, b, &region)?.look(seen.view, camera_from_world)?;
            Some((pair, gap_look))
        };
        pairs.into_iter().filter_map(look).collect()
    }

    /// Whether a key frame reads one of two planes, between which others have shown a step, where the other
    /// has been read, from so near that it would have shown that step. (The middle of a wall behind a board
    /// that stands before it has never been read: that the board is there tells nothing.)
    fn reads_as_one(
        &self,
        [a, b]: [&MapPlane; 2],
        insertion: &Insertion,
        seen: &Seen<'_>,
        camera_from_world: &Pose,
    ) -> bool {
        let Some(height) = self.gaps.step_height(pair_of(a.birth, b.birth)) else { return false };
        let reads = |plane: &MapPlane, where_is: &MapPlane| {
            let place = camera_from_world.transform_point(where_is.centroid);
            let read = seen.plane_at(place).and_then(|detected| insertion.associations.get(detected));
            read == Some(&plane.birth)
                && where_is.holds(where_is.centroid)
                && self.sensor.tolerance(place[2] as f32, 0.0) < height
        };
        !a.is_gone && !b.is_gone && (reads(a, b) || reads(b, a))
    }

    /// The region that a key frame has seen, extended by the largest gap over which planes merge, and the
    /// planes in it.
    fn near_seen(&self, region: &VoxelBox) -> (VoxelBox, Vec<Birth>) {
        let gap = (self.config.association.max_occluded_gap / self.config.voxel_size).ceil() as i32;
        let region = region.grown(self.criterion.reach().max(gap));
        let near = self.index.near(&region);
        (region, near)
    }

    /// The gap between two planes of the map that may be one surface behind something, where no wall stands
    /// between them. What may be a wall, though not confirmed yet, is waited for: when two rooms have been seen
    /// and the wall between them from one side only, its other side is about to be seen, and a merge is not
    /// undone.
    fn gap_between(&self, a: &MapPlane, b: &MapPlane, region: &VoxelBox) -> Option<Gap> {
        let (into, from) = in_order(a, b);
        let (from, into) = (from.finite(), into.finite());
        let (width, voxel_size) = (self.config.association.max_occluded_gap, self.config.voxel_size);
        if width <= 0.0 || voxel_size * from.patch.bounds().distance(&into.patch.bounds()) > width {
            return None;
        }
        self.criterion.test_across_gap(&from, &into)?;
        Gap::between(
            &from,
            &into,
            voxel_size,
            width,
            region,
            &self.partitions([&from, &into], region, |wall| !wall.is_gone),
        )
    }

    /// Merges planes that this key frame has touched with planes that are one with them, best pair first.
    pub(super) fn merge(&mut self, insertion: &mut Insertion, region: &VoxelBox) {
        let mut touched: Vec<Birth> = insertion.touched().collect();
        let (region, near) = self.near_seen(region);
        let mut merges = Vec::new();
        while let Some(found) = self.best_merge(&touched, &near, &region) {
            let merge = found.merge;
            merges.push(Merge { merge, witnesses: self.witnesses(&found) });
            self.absorb(merge);
            touched.retain(|&birth| birth != merge.from);
            if !touched.contains(&merge.into) {
                touched.push(merge.into);
            }
            insertion.unions.push(merge);
        }
        for birth in &mut insertion.associations {
            *birth = self.resolve(*birth);
        }
        if !merges.is_empty() {
            self.key_frames.update(insertion.key_frame, |key_frame| key_frame.merges = merges);
        }
    }

    fn best_merge(&self, touched: &[Birth], near: &[Birth], region: &VoxelBox) -> Option<FoundMerge> {
        let mut best: Option<FoundMerge> = None;
        for a in touched.iter().filter_map(|birth| self.planes.get(birth)) {
            for b in near.iter().filter(|b| **b != a.birth).filter_map(|birth| self.planes.get(birth)) {
                let Some(found) = self.test_merge(a, b, region) else { continue };
                if best.is_none_or(|best| (found.cost, found.merge) < (best.cost, best.merge)) {
                    best = Some(found);
                }
            }
        }
        best
    }

    /// Whether two planes of the map are one. The plane with fewer observations would be merged into the
    /// other.
    fn test_merge(&self, a: &MapPlane, b: &MapPlane, region: &VoxelBox) -> Option<FoundMerge> {
        if self.gaps.is_step(pair_of(a.birth, b.birth)) || !a.moments.has_room_for(&b.moments) {
            return None;
        }
        let (into, from) = in_order(a, b);
        let merge = Union { from: from.birth, into: into.birth };
        let found =
            |tie: Tie, agreement: &Agreement| FoundMerge { cost: self.criterion.cost(agreement), merge, tie };
        let (from, into) = (from.finite(), into.finite());
        if let Some(agreement) = self.test([&from, &into], region) {
            return Some(found(Tie::Contact, &agreement));
        }
        let least = self.config.lasting_observations();
        let is_occluded = self.gaps.is_occluded(pair_of(merge.from, merge.into), least);
        let agreement = is_occluded.then(|| self.criterion.test_across_gap(&from, &into)).flatten()?;
        // A wall may have been found in the gap since.
        self.gap_between(a, b, region)?;
        Some(found(Tie::OccludedGap, &agreement))
    }

    /// The key frames that saw the gap between two planes occluded; `None` when the planes adjoin.
    fn witnesses(&self, found: &FoundMerge) -> Option<Vec<FrameId>> {
        let Union { from, into } = found.merge;
        let look = (pair_of(from, into), GapLook::Occluded);
        let saw = |key_frame: &KeyFrame| {
            resolve_looks(&key_frame.gap_looks, |birth| self.resolve(birth)).contains(&look)
        };
        (found.tie == Tie::OccludedGap).then(|| {
            let since = self.key_frames_since(from, into);
            since.filter(|(_, key_frame)| saw(key_frame)).map(|(number, _)| number).collect()
        })
    }

    /// The key frames since both planes have been seen, which may know of both.
    fn key_frames_since(&self, a: Birth, b: Birth) -> impl Iterator<Item = (FrameId, Arc<KeyFrame>)> {
        self.key_frames.range(self.first_saw(a).max(self.first_saw(b))..)
    }

    /// The same from the beginning of the look in which the younger was seen first, if that was not long before:
    /// the last [`LOOK_PART`] key frames of a long look say nearly what all of them say.
    fn key_frames_since_look(&self, a: Birth, b: Birth) -> impl Iterator<Item = (FrameId, Arc<KeyFrame>)> {
        let first = self.first_saw(a).max(self.first_saw(b));
        let look = self.key_frames.get(first).map_or(first, |key_frame| key_frame.look);
        let earliest = FrameId::new(first.get().saturating_sub(LOOK_PART));
        self.key_frames.range(look.max(earliest)..)
    }

    /// That of two planes which was seen first.
    fn older_of(&self, a: Birth, b: Birth) -> Birth {
        if self.first_saw(a) <= self.first_saw(b) { a } else { b }
    }

    /// The first key frame that saw a plane.
    fn first_saw(&self, birth: Birth) -> FrameId {
        self.planes.get(&birth).map_or(FrameId::new(0), |plane| plane.sightings.first)
    }

    /// Collects anew what all key frames saw between planes, by the planes that these have become. Used when
    /// key frames were removed. O(looks between planes of all key frames).
    pub(super) fn collect_gaps(&mut self) {
        let mut gaps = GapRecord::default();
        for key_frame in self.key_frames.values() {
            gaps.add(&self.looks_of(&key_frame, |birth| self.resolve(birth)));
        }
        self.gaps = gaps;
    }

    /// Merges a plane into another. O(key frames since the younger was first seen, and what they saw, and all
    /// pairs of planes that were seen with a gap between them).
    fn absorb(&mut self, merge: Union) {
        let Union { from, into } = merge;
        let mut gaps = std::mem::take(&mut self.gaps);
        let resolve_now = |birth: Birth| self.resolve(birth);
        let resolve_then =
            |birth: Birth| if self.resolve(birth) == from { into } else { self.resolve(birth) };
        let (mut both_saw, mut both_looked) = (0, 0);
        let (older, mut of_older, mut of_both) =
            (self.older_of(from, into), Looks::default(), Looks::default());
        for (_, key_frame) in self.key_frames_since_look(from, into) {
            let [a, b] = [from, into].map(|birth| key_frame.looks_at(birth, resolve_now));
            both_saw += u32::from(a[0] && b[0]);
            both_looked += u32::from(a[1] && b[1]);
            let older = if older == from { a } else { b };
            for (looks, [saw, looked]) in
                [(&mut of_older, older), (&mut of_both, [a[0] || b[0], a[1] || b[1]])]
            {
                if looked {
                    looks.count(key_frame.look, saw);
                }
            }
        }
        let looks = self.planes.get(&older).map_or(Looks::default(), |plane| plane.sightings.looks);
        let looks = Looks::united([looks, of_older], of_both);
        let of_from = |key_frame: &Arc<KeyFrame>| {
            key_frame.gap_looks.iter().any(|(pair, _)| pair.iter().any(|&birth| resolve_now(birth) == from))
        };
        // A key frame that looked between both planes and a third counts once for what they become; those
        // before knew one of them only.
        let mut of_both = GapLooks::new();
        for key_frame in self.key_frames_since(from, into).map(|(_, key_frame)| key_frame).filter(of_from) {
            gaps.subtract(&self.looks_of(&key_frame, resolve_now));
            of_both.extend(self.looks_of(&key_frame, resolve_then));
        }
        gaps.rename(from, into);
        gaps.add(&of_both);
        self.gaps = gaps;
        self.merged.insert(from, into);
        self.merged_ids.insert(self.names.id(from), self.names.id(into));
        let Some(gone) = self.planes.remove(&from) else { return };
        let Some(plane) = self.planes.get_mut(&into) else { return };
        gone.patch.blocks().for_each(|block| self.index.take(block, from));
        plane.moments.add(&gone.moments);
        plane.unite_judgements(&gone);
        plane.patch.add(&gone.patch, |block| self.index.add(block, into));
        plane.sightings = plane.sightings.united(&gone.sightings, both_saw, both_looked, looks);
        plane.refit();
    }
}

/// Key frames of a look before two planes were known that are asked when the two merge: after hours at rest a
/// merge must not cost hours of key frames.
const LOOK_PART: u64 = 200;

/// Of two planes, first the one that would stay in a merge: the one with more observations, or the older of
/// equals.
fn in_order<'a>(a: &'a MapPlane, b: &'a MapPlane) -> (&'a MapPlane, &'a MapPlane) {
    let rank = |plane: &MapPlane| (plane.sightings.count, std::cmp::Reverse(plane.birth));
    if rank(a) > rank(b) { (a, b) } else { (b, a) }
}
