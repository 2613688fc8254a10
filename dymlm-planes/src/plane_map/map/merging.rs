use dymlm_core::{DepthView, Frame, FrameId, PlaneId, Pose};

use super::super::gap::{Gap, GapLook};
use super::super::gap_record::{GapLooks, GapRecord, pair_of, resolve_looks};
use super::super::map_plane::MapPlane;
use super::super::report::{PlaneMerge, PlaneReport};
use super::{KeyFrame, Merge, PlaneMap};
use crate::association::Agreement;

/// Two planes of the map that are one.
#[derive(Debug, Clone, Copy)]
struct FoundMerge {
    cost: f64,
    merge: PlaneMerge,
    tie: Tie,
}

/// Why they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tie {
    /// Their patches adjoin.
    Contact,
    /// Something nearer occludes what joins them.
    OccludedGap,
}

/// Planes of the map that prove to be one.
impl PlaneMap {
    /// Looks at what lies between planes that this key frame has touched and planes of the map that are
    /// coplanar with them.
    pub(super) fn look_between(&mut self, report: &PlaneReport, frame: &Frame, world_from_camera: &Pose) {
        let camera_from_world = world_from_camera.inverse();
        let view = DepthView::new(frame.camera(), frame.depth(), &self.sensor);
        let mut gap_looks = GapLooks::new();
        for id in report.touched() {
            let Some(a) = self.place(id).map(|place| &self.planes[place]) else { continue };
            for b in self.planes.iter().filter(|b| b.id != id) {
                let pair = pair_of(a.id, b.id);
                if !gap_looks.contains_key(&pair)
                    && let Some(gap) = self.gap_between(a, b)
                    && let Some(gap_look) = gap.look(&view, &camera_from_world)
                {
                    gap_looks.insert(pair, gap_look);
                }
            }
        }
        self.gaps.add(&gap_looks);
        if let Some(key_frame) = self.key_frames.get_mut(&report.key_frame) {
            key_frame.gap_looks = gap_looks;
        }
    }

    /// What lies between two planes of the map that may be one surface behind something.
    fn gap_between(&self, a: &MapPlane, b: &MapPlane) -> Option<Gap> {
        let (into, from) = in_order(a, b);
        let (from, into) = (from.finite(), into.finite());
        let width = self.config.association.max_occluded_gap;
        if width <= 0.0 || from.bounds.distance(&into.bounds) > width {
            return None;
        }
        self.criterion.test_across_gap(&from, &into)?;
        Gap::between(&from, &into, self.config.voxel_size, width)
    }

    /// Merges planes that this key frame has touched with planes that they have become one with, best pair
    /// first.
    pub(super) fn merge(&mut self, report: &mut PlaneReport) {
        let mut touched: Vec<PlaneId> = report.touched().collect();
        let mut merges = Vec::new();
        while let Some(found) = self.best_merge(&touched) {
            let merge = found.merge;
            merges.push(Merge { merge, witnesses: self.witnesses(&found) });
            self.merged.insert(merge.from, merge.into);
            touched.retain(|&id| id != merge.from);
            if !touched.contains(&merge.into) {
                touched.push(merge.into);
            }
            if let Some(place) = self.place(merge.from) {
                let gone = self.planes.remove(place);
                self.absorb(&gone, merge.into);
            }
            self.collect_gaps();
            report.merged.push(merge);
        }
        for id in &mut report.associations {
            *id = self.resolve(*id);
        }
        if let Some(key_frame) = self.key_frames.get_mut(&report.key_frame) {
            key_frame.merges = merges;
        }
    }

    fn best_merge(&self, touched: &[PlaneId]) -> Option<FoundMerge> {
        let mut best: Option<FoundMerge> = None;
        for &id in touched {
            let Some(a) = self.place(id).map(|place| &self.planes[place]) else { continue };
            for b in self.planes.iter().filter(|b| b.id != id) {
                let Some(found) = self.test_merge(a, b) else { continue };
                if best.is_none_or(|best| (found.cost, found.merge) < (best.cost, best.merge)) {
                    best = Some(found);
                }
            }
        }
        best
    }

    /// Whether two planes of the map are one: the plane with fewer observations would go into the other.
    fn test_merge(&self, a: &MapPlane, b: &MapPlane) -> Option<FoundMerge> {
        let (into, from) = in_order(a, b);
        let merge = PlaneMerge { from: from.id, into: into.id };
        let found =
            |tie: Tie, agreement: &Agreement| FoundMerge { cost: self.criterion.cost(agreement), merge, tie };
        let (from, into) = (from.finite(), into.finite());
        if let Some(agreement) = self.criterion.test(&from, &into) {
            return Some(found(Tie::Contact, &agreement));
        }
        let least = self.config.min_observations;
        let is_occluded = self.gaps.is_occluded(pair_of(merge.from, merge.into), least);
        let agreement = is_occluded.then(|| self.criterion.test_across_gap(&from, &into)).flatten()?;
        Some(found(Tie::OccludedGap, &agreement))
    }

    /// The key frames that saw the gap occluded that is between two planes; `None` when they adjoin.
    fn witnesses(&self, found: &FoundMerge) -> Option<Vec<FrameId>> {
        let pair = pair_of(found.merge.from, found.merge.into);
        let saw = |key_frame: &KeyFrame| {
            let gap_looks = resolve_looks(&key_frame.gap_looks, |id| self.resolve(id));
            gap_looks.get(&pair) == Some(&GapLook::Occluded)
        };
        (found.tie == Tie::OccludedGap).then(|| {
            self.key_frames
                .iter()
                .filter(|(_, key_frame)| saw(key_frame))
                .map(|(&number, _)| number)
                .collect()
        })
    }

    /// What all key frames saw between planes, by the ids that the planes have now. O(looks between planes of
    /// all key frames), when ids or key frames have gone.
    pub(super) fn collect_gaps(&mut self) {
        let mut gaps = GapRecord::default();
        for key_frame in self.key_frames.values() {
            gaps.add(&resolve_looks(&key_frame.gap_looks, |id| self.resolve(id)));
        }
        self.gaps = gaps;
    }

    fn absorb(&mut self, gone: &MapPlane, into: PlaneId) {
        let seen = self.sightings(into);
        if let Some(place) = self.place(into) {
            let plane = &mut self.planes[place];
            plane.moments.add(&gone.moments);
            plane.patch.add(&gone.patch);
            plane.sightings = seen;
            plane.refit();
        }
    }
}

/// The plane of two that the other would go into, and the other: that with more observations, the older of
/// equals.
fn in_order<'a>(a: &'a MapPlane, b: &'a MapPlane) -> (&'a MapPlane, &'a MapPlane) {
    let rank = |plane: &MapPlane| (plane.sightings.count, std::cmp::Reverse(plane.id));
    if rank(a) > rank(b) { (a, b) } else { (b, a) }
}
