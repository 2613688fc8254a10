use std::collections::BTreeMap;

use dymlm_core::{Frame, Pose};

use super::fixed_moments::FixedMoments;
use super::gap::{Gap, GapSight};
use super::gap_record::{GapRecord, GapSights, pair_of, resolve_sights};
use super::map_plane::{ShapeSettings, Sightings};
use super::observation::Observation;
use super::{MapPlane, Patch, PlaneMapConfig, PlaneMerge, PlaneReport};
use crate::PlaneError;
use crate::association::{Agreement, Criterion};
use crate::linear_algebra::{dot, foot_on, norm, subtract};
use crate::refinement::DetectedPlane;

/// The map of finite planes (paper III-B).
///
/// A key frame's planes are brought to the world, associated with the planes of the map, and fused with them; then
/// planes of the map that have become one merge. The association is the paper's (equation 1 and (equation 2 or
/// equation 3)) with the corrections of DESIGN 4.4; see [`AssociationConfig`](crate::AssociationConfig).
///
/// Patches of one plane that do not adjoin are one surface where something nearer hides what joins them (a wall behind a
/// person, a floor on both sides of a table), and two where one looks through between them (two desks of one height). Each key
/// frame that touches one of the two is asked what it sees on the shortest ways between them; when enough saw them hidden and
/// hardly any looked through, they merge. What has merged is not parted when a later key frame looks through after all.
///
/// All sums are integers and every key frame's share of them is kept. So [`PlaneMap::remove`] takes a key frame out
/// exactly: the planes are those that they would be if it had added nothing, and merges that it brought about, or that it was
/// needed for as a witness of what is hidden, are undone.
///
/// Cost of an insertion: O(planes in the map + voxels of the planes seen and of those near them on the same plane); no key frame
/// is looked at again.
#[derive(Debug, Clone)]
pub struct PlaneMap {
    config: PlaneMapConfig,
    criterion: Criterion,
    /// In the order of their ids.
    planes: Vec<MapPlane>,
    key_frames: BTreeMap<u64, KeyFrame>,
    /// Where planes have gone that were merged into others.
    merged: BTreeMap<u64, u64>,
    /// What the key frames saw between planes, by the ids that these have now.
    gaps: GapRecord,
    next_plane: u64,
    next_key_frame: u64,
}

/// What one key frame has added.
#[derive(Debug, Clone)]
struct KeyFrame {
    timestamp: f64,
    world_from_camera: Pose,
    contributions: Vec<Contribution>,
    /// Merges that it brought about.
    merges: Vec<Merge>,
    /// What it saw between planes, by their ids at that time.
    sights: GapSights,
}

#[derive(Debug, Clone)]
struct Merge {
    merge: PlaneMerge,
    /// The key frames that saw the gap hidden, when the two planes do not adjoin.
    witnesses: Option<Vec<u64>>,
}

#[derive(Debug, Clone)]
struct Contribution {
    /// The plane at that time; it may have merged into another since.
    plane: u64,
    moments: FixedMoments,
    patch: Patch,
}

/// The plane of the map that a detected one may be.
#[derive(Debug, Clone, Copy)]
struct Pairing {
    cost: f64,
    /// Place in `planes`.
    mapped: usize,
    agreement: Agreement,
}

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
    /// Something nearer hides what joins them.
    HiddenGap,
}

/// A plane is a body's when this share of its inliers is.
const BODY_SHARE: f64 = 0.6;

impl PlaneMap {
    /// An empty map.
    ///
    /// # Errors
    ///
    /// [`PlaneError::Config`] names the field outside its range.
    pub fn new(config: PlaneMapConfig) -> Result<Self, PlaneError> {
        config.validate()?;
        Ok(Self {
            criterion: Criterion::new(&config.association, config.voxel_size),
            config,
            planes: Vec::new(),
            key_frames: BTreeMap::new(),
            merged: BTreeMap::new(),
            gaps: GapRecord::default(),
            next_plane: 0,
            next_key_frame: 0,
        })
    }

    /// Adds the planes of a key frame, given in its camera's frame. What lies between planes is not looked at; see
    /// [`Self::insert_frame`].
    ///
    /// # Errors
    ///
    /// [`PlaneError::Timestamp`]; [`PlaneError::OutOfReach`] when a plane lies so far out that it cannot be summed
    /// exactly. The map stays as it was.
    pub fn insert(
        &mut self,
        detected: &[DetectedPlane],
        world_from_camera: &Pose,
        timestamp: f64,
    ) -> Result<PlaneReport, PlaneError> {
        self.insert_seen(detected, None, world_from_camera, timestamp)
    }

    /// Adds the planes of a key frame, given in its camera's frame, and looks in its depth image at what lies between planes of
    /// the map that may be one surface behind something: see
    /// [`max_hidden_gap`](crate::AssociationConfig::max_hidden_gap).
    ///
    /// # Errors
    ///
    /// [`PlaneError::OutOfReach`] when a plane lies so far out that it cannot be summed exactly. The map stays as it was.
    pub fn insert_frame(
        &mut self,
        detected: &[DetectedPlane],
        frame: &Frame,
        world_from_camera: &Pose,
    ) -> Result<PlaneReport, PlaneError> {
        self.insert_seen(detected, Some(frame), world_from_camera, frame.timestamp())
    }

    fn insert_seen(
        &mut self,
        detected: &[DetectedPlane],
        frame: Option<&Frame>,
        world_from_camera: &Pose,
        timestamp: f64,
    ) -> Result<PlaneReport, PlaneError> {
        if !timestamp.is_finite() {
            return Err(PlaneError::Timestamp(timestamp));
        }
        let observations = self.bring_to_world(detected, world_from_camera)?;
        let pairings = self.associate(&observations);
        let mut report = self.fuse(observations, &pairings, world_from_camera, timestamp);
        if let Some(frame) = frame {
            self.look_between(&report, frame, world_from_camera);
        }
        self.merge(&mut report);
        Ok(report)
    }

    /// Whether every plane within 100 m of a camera at this pose can be mapped.
    ///
    /// # Errors
    ///
    /// [`PlaneError::OutOfReach`] names the camera's place.
    pub fn check_reach(&self, world_from_camera: &Pose) -> Result<(), PlaneError> {
        let centroid = world_from_camera.translation();
        let reach = Observation::reach(self.config.voxel_size) - 100.0;
        let within = centroid.iter().all(|c| c.abs() < reach);
        if within { Ok(()) } else { Err(PlaneError::OutOfReach { centroid, reach }) }
    }

    /// Takes a key frame out again, by the number that its report gave.
    ///
    /// # Errors
    ///
    /// [`PlaneError::UnknownKeyFrame`].
    pub fn remove(&mut self, key_frame: u64) -> Result<(), PlaneError> {
        let gone = self.key_frames.remove(&key_frame).ok_or(PlaneError::UnknownKeyFrame { key_frame })?;
        let mut undone: Vec<PlaneMerge> = gone.merges.iter().map(|merge| merge.merge).collect();
        undone.extend(self.take_unwitnessed(key_frame));
        if undone.is_empty() {
            self.subtract(&gone);
        } else {
            self.undo_merges(&gone, &undone);
        }
        self.collect_gaps();
        Ok(())
    }

    /// Moves the planes of a body that was moved, `is_body` telling which places are the body's: planes most of whose
    /// inliers (60 %) are its own go where `new_from_old` takes them, from all others its inliers are taken out. Gives the
    /// ids of the planes that went.
    ///
    /// What key frames from before have added moves with them, so [`Self::remove`] stays exact. O(all contributions to
    /// the planes that change).
    ///
    /// # Errors
    ///
    /// [`PlaneError::OutOfReach`] when a plane would go too far out; nothing has moved.
    pub fn move_body(
        &mut self,
        new_from_old: &Pose,
        is_body: impl Fn([f64; 3]) -> bool,
    ) -> Result<Vec<u64>, PlaneError> {
        let voxel_size = self.config.voxel_size;
        let (mut going, mut cut) = (Vec::new(), Vec::new());
        for plane in &self.planes {
            let voxels = plane.patch.voxels();
            let own = voxels
                .iter()
                .filter(|voxel| is_body(foot_on(&plane.plane, voxel.center(voxel_size))))
                .count();
            if own as f64 >= BODY_SHARE * voxels.len() as f64 && own > 0 {
                going.push(plane.id);
            } else if own > 0 {
                cut.push((plane.id, plane.plane));
            }
        }
        let moved = self.moved_contributions(&going, new_from_old)?;
        for ((key_frame, index), (moments, patch)) in moved {
            let key_frame = self.key_frames.get_mut(&key_frame);
            if let Some(share) = key_frame.and_then(|key_frame| key_frame.contributions.get_mut(index)) {
                (share.moments, share.patch) = (moments, patch);
            }
        }
        let merged = &self.merged;
        for share in self.key_frames.values_mut().flat_map(|key_frame| &mut key_frame.contributions) {
            let id = resolve(merged, share.plane);
            if let Some((_, plane)) = cut.iter().find(|(cut, _)| *cut == id) {
                share.patch.retain(|voxel| !is_body(foot_on(plane, voxel.center(voxel_size))));
            }
        }
        // What lay between them and others lies there no more.
        for key_frame in self.key_frames.values_mut() {
            key_frame.sights.retain(|pair, _| !pair.iter().any(|id| going.contains(&resolve(merged, *id))));
        }
        self.collect_gaps();
        let touched: Vec<u64> = going.iter().copied().chain(cut.iter().map(|(id, _)| *id)).collect();
        self.rebuild(&touched);
        Ok(going)
    }

    /// The planes, in the order of their ids.
    pub fn planes(&self) -> &[MapPlane] {
        &self.planes
    }

    /// The planes that enough key frames have seen, in the order of their ids: see
    /// [`min_observations`](PlaneMapConfig::min_observations) and the fields after it. O(planes seen a few times x key
    /// frames).
    pub fn confirmed(&self) -> impl Iterator<Item = &MapPlane> {
        let PlaneMapConfig { min_observations, sure_observations, min_observation_share, .. } = self.config;
        self.planes.iter().filter(move |plane| {
            let seen = plane.sightings.count;
            let is_sure = || seen >= sure_observations;
            let often = || f64::from(seen) >= min_observation_share * self.looks_at(plane) as f64;
            seen >= min_observations && (is_sure() || often())
        })
    }

    /// Number of key frames that look at a plane's centroid from before it. What stands in the way is not asked.
    fn looks_at(&self, plane: &MapPlane) -> usize {
        let PlaneMapConfig { view_angle_deg, view_depth, .. } = self.config;
        let (cos_view, max_depth) = (view_angle_deg.to_radians().cos(), view_depth);
        let looks = |key_frame: &&KeyFrame| {
            let pose = &key_frame.world_from_camera;
            let ray = subtract(plane.centroid, pose.translation());
            let depth = dot(ray, pose.rotate([0.0, 0.0, 1.0]));
            (depth > 0.0 && depth <= max_depth && depth >= cos_view * norm(ray))
                && dot(ray, plane.plane.normal()) < 0.0
        };
        self.key_frames.values().filter(looks).count()
    }

    /// The plane with an id, or the one that it was merged into.
    pub fn plane(&self, id: u64) -> Option<&MapPlane> {
        self.place(self.resolve(id)).map(|place| &self.planes[place])
    }

    /// Number of planes.
    pub fn len(&self) -> usize {
        self.planes.len()
    }

    /// Whether nothing is mapped.
    pub fn is_empty(&self) -> bool {
        self.planes.is_empty()
    }

    /// The config.
    pub fn config(&self) -> &PlaneMapConfig {
        &self.config
    }

    /// Bytes that the map holds, about.
    pub fn memory_bytes(&self) -> usize {
        let planes: usize =
            self.planes.iter().map(|plane| size_of::<MapPlane>() + plane.patch.memory_bytes()).sum();
        let shares = self.key_frames.values().flat_map(|key_frame| &key_frame.contributions);
        let sights: usize = self.key_frames.values().map(|key_frame| key_frame.sights.len()).sum();
        let sights = sights * size_of::<([u64; 2], GapSight)>();
        planes
            + sights
            + shares.map(|share| size_of::<Contribution>() + share.patch.memory_bytes()).sum::<usize>()
    }

    fn bring_to_world(
        &self,
        detected: &[DetectedPlane],
        world_from_camera: &Pose,
    ) -> Result<Vec<Observation>, PlaneError> {
        detected
            .iter()
            .map(|plane| Observation::new(plane, world_from_camera, self.config.voxel_size))
            .collect()
    }

    /// The best plane of the map for each detected one. Several detected ones may share it: parts of one surface.
    fn associate(&self, observations: &[Observation]) -> Vec<Option<Pairing>> {
        let best = |observation: &Observation| {
            let candidates = self.planes.iter().enumerate().filter_map(|(mapped, plane)| {
                let agreement = self.criterion.test(&observation.finite(), &plane.finite())?;
                Some(Pairing { cost: self.criterion.cost(&agreement), mapped, agreement })
            });
            // The first of equals: the oldest.
            candidates.min_by(|a, b| a.cost.total_cmp(&b.cost))
        };
        observations.iter().map(best).collect()
    }

    fn fuse(
        &mut self,
        observations: Vec<Observation>,
        pairings: &[Option<Pairing>],
        world_from_camera: &Pose,
        timestamp: f64,
    ) -> PlaneReport {
        let mut report = PlaneReport { key_frame: self.next_key_frame, ..PlaneReport::default() };
        self.next_key_frame += 1;
        let mut contributions = Vec::with_capacity(observations.len());
        for (observation, pairing) in observations.into_iter().zip(pairings) {
            let Observation { plane, mut moments, patch, .. } = observation;
            let place = if let Some(pairing) = pairing {
                if pairing.agreement.flipped {
                    moments = moments.flipped();
                }
                report.updated.push(self.planes[pairing.mapped].id);
                pairing.mapped
            } else {
                report.created.push(self.next_plane);
                self.planes.push(MapPlane::new(self.next_plane, plane, self.shape()));
                self.next_plane += 1;
                self.planes.len() - 1
            };
            let into = &mut self.planes[place];
            into.moments.add(&moments);
            into.patch.add(&patch);
            report.associations.push(into.id);
            contributions.push(Contribution { plane: into.id, moments, patch });
        }
        report.updated.sort_unstable();
        report.updated.dedup();
        for &id in report.created.iter().chain(&report.updated) {
            if let Some(place) = self.place(id) {
                let plane = &mut self.planes[place];
                plane.sightings.add(timestamp);
                plane.refit();
            }
        }
        let (merges, sights, world_from_camera) = (Vec::new(), GapSights::new(), *world_from_camera);
        self.key_frames.insert(
            report.key_frame,
            KeyFrame { timestamp, world_from_camera, contributions, merges, sights },
        );
        report
    }

    /// Looks at what lies between planes that this key frame has touched and planes of the map that are coplanar with them.
    fn look_between(&mut self, report: &PlaneReport, frame: &Frame, world_from_camera: &Pose) {
        let camera_from_world = world_from_camera.inverse();
        let mut sights = GapSights::new();
        for &id in report.created.iter().chain(&report.updated) {
            let Some(a) = self.place(id).map(|place| &self.planes[place]) else { continue };
            for b in self.planes.iter().filter(|b| b.id != id) {
                let pair = pair_of(a.id, b.id);
                if !sights.contains_key(&pair)
                    && let Some(gap) = self.gap_between(a, b)
                    && let Some(sight) = gap.look(frame.camera(), frame.depth(), &camera_from_world)
                {
                    sights.insert(pair, sight);
                }
            }
        }
        self.gaps.add(&sights);
        if let Some(key_frame) = self.key_frames.get_mut(&report.key_frame) {
            key_frame.sights = sights;
        }
    }

    /// What lies between two planes of the map that may be one surface behind something.
    fn gap_between(&self, a: &MapPlane, b: &MapPlane) -> Option<Gap> {
        let (into, from) = in_order(a, b);
        let (from, into) = (from.finite(), into.finite());
        let width = self.config.association.max_hidden_gap;
        if width <= 0.0 || from.bounds.distance(&into.bounds) > width {
            return None;
        }
        self.criterion.test_across_gap(&from, &into)?;
        Gap::between(&from, &into, self.config.voxel_size, width)
    }

    /// Merges planes that this key frame has touched with planes that they have become one with, best pair first.
    fn merge(&mut self, report: &mut PlaneReport) {
        let mut touched: Vec<u64> = report.created.iter().chain(&report.updated).copied().collect();
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

    fn best_merge(&self, touched: &[u64]) -> Option<FoundMerge> {
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
        let least = self.config.association.min_hidden_sightings;
        let is_hidden = self.gaps.is_hidden(pair_of(merge.from, merge.into), least);
        let agreement = is_hidden.then(|| self.criterion.test_across_gap(&from, &into)).flatten()?;
        Some(found(Tie::HiddenGap, &agreement))
    }

    /// The key frames that saw the gap hidden that is between two planes; `None` when they adjoin.
    fn witnesses(&self, found: &FoundMerge) -> Option<Vec<u64>> {
        let pair = pair_of(found.merge.from, found.merge.into);
        let saw = |key_frame: &KeyFrame| {
            let sights = resolve_sights(&key_frame.sights, |id| self.resolve(id));
            sights.get(&pair) == Some(&GapSight::Hidden)
        };
        (found.tie == Tie::HiddenGap).then(|| {
            self.key_frames
                .iter()
                .filter(|(_, key_frame)| saw(key_frame))
                .map(|(&number, _)| number)
                .collect()
        })
    }

    /// What all key frames saw between planes, by the ids that the planes have now. O(sights of all key frames), when ids or
    /// key frames have gone.
    fn collect_gaps(&mut self) {
        let mut gaps = GapRecord::default();
        for key_frame in self.key_frames.values() {
            gaps.add(&resolve_sights(&key_frame.sights, |id| self.resolve(id)));
        }
        self.gaps = gaps;
    }

    fn absorb(&mut self, gone: &MapPlane, into: u64) {
        let seen = self.sightings(into);
        if let Some(place) = self.place(into) {
            let plane = &mut self.planes[place];
            plane.moments.add(&gone.moments);
            plane.patch.add(&gone.patch);
            plane.sightings = seen;
            plane.refit();
        }
    }

    /// Takes a key frame's sums out of the planes.
    fn subtract(&mut self, gone: &KeyFrame) {
        for share in &gone.contributions {
            let id = self.resolve(share.plane);
            let Some(place) = self.place(id) else { continue };
            let seen = self.sightings(id);
            if seen.count == 0 {
                self.planes.remove(place);
                continue;
            }
            let plane = &mut self.planes[place];
            plane.moments.subtract(&share.moments);
            plane.patch.subtract(&share.patch);
            plane.sightings = seen;
            plane.refit();
        }
    }

    /// Takes those merges out of the key frames that have too few witnesses left without a key frame.
    fn take_unwitnessed(&mut self, gone: u64) -> Vec<PlaneMerge> {
        let least = self.config.association.min_hidden_sightings as usize;
        let mut taken = Vec::new();
        for key_frame in self.key_frames.values_mut() {
            key_frame.merges.retain_mut(|merge| {
                let Some(witnesses) = &mut merge.witnesses else { return true };
                witnesses.retain(|&witness| witness != gone);
                let holds = witnesses.len() >= least;
                if !holds {
                    taken.push(merge.merge);
                }
                holds
            });
        }
        taken
    }

    /// Parts planes that a key frame made one, or that it was needed as a witness for, and makes all that it touched anew without it.
    fn undo_merges(&mut self, gone: &KeyFrame, undone: &[PlaneMerge]) {
        let mut touched: Vec<u64> =
            gone.contributions.iter().map(|share| self.resolve(share.plane)).collect();
        touched.extend(undone.iter().map(|merge| self.resolve(merge.into)));
        for merge in undone {
            self.merged.remove(&merge.from);
        }
        touched.extend(undone.iter().flat_map(|merge| [self.resolve(merge.from), self.resolve(merge.into)]));
        touched.sort_unstable();
        touched.dedup();
        self.rebuild(&touched);
    }

    /// The key frames that saw a plane.
    fn sightings(&self, id: u64) -> Sightings {
        let mut sightings = Sightings::default();
        for key_frame in self.key_frames.values() {
            if key_frame.contributions.iter().any(|share| self.resolve(share.plane) == id) {
                sightings.add(key_frame.timestamp);
            }
        }
        sightings
    }

    /// Makes planes anew from what the key frames have added to them. O(all contributions).
    fn rebuild(&mut self, ids: &[u64]) {
        for &id in ids {
            if let Some(place) = self.place(id) {
                self.planes.remove(place);
            }
            let seen = self.sightings(id);
            if seen.count == 0 {
                continue;
            }
            let (mut moments, mut patch) = (FixedMoments::default(), Patch::default());
            for share in self.key_frames.values().flat_map(|key_frame| &key_frame.contributions) {
                if self.resolve(share.plane) == id {
                    moments.add(&share.moments);
                    patch.add(&share.patch);
                }
            }
            let Some(fitted) = moments.fit().and_then(|fit| fit.plane()) else { continue };
            let mut plane = MapPlane::new(id, fitted, self.shape());
            (plane.moments, plane.patch) = (moments, patch);
            plane.sightings = seen;
            plane.refit();
            let place = self.planes.partition_point(|other| other.id < id);
            self.planes.insert(place, plane);
        }
    }

    /// What the key frames have added to some planes, moved; by key frame and place in it.
    #[allow(clippy::type_complexity, reason = "a list that lives for a few lines")]
    fn moved_contributions(
        &self,
        planes: &[u64],
        new_from_old: &Pose,
    ) -> Result<Vec<((u64, usize), (FixedMoments, Patch))>, PlaneError> {
        let voxel_size = self.config.voxel_size;
        let reach = Observation::reach(voxel_size);
        let mut moved = Vec::new();
        for (&number, key_frame) in &self.key_frames {
            for (index, share) in key_frame.contributions.iter().enumerate() {
                if !planes.contains(&self.resolve(share.plane)) {
                    continue;
                }
                let old = share.moments.about_centroid().map_or([0.0; 3], |(_, centroid)| centroid);
                let centroid = new_from_old.transform_point(old);
                let within = centroid.iter().all(|c| c.abs() < reach);
                let moments = share.moments.moved(new_from_old).filter(|_| within);
                let moments = moments.ok_or(PlaneError::OutOfReach { centroid, reach })?;
                moved.push(((number, index), (moments, share.patch.moved(new_from_old, voxel_size))));
            }
        }
        Ok(moved)
    }

    fn shape(&self) -> ShapeSettings {
        let PlaneMapConfig { voxel_size, max_hole_area, boundary_tolerance, .. } = self.config;
        ShapeSettings { voxel_size, max_hole_area, boundary_tolerance }
    }

    /// The plane that an id stands for now.
    fn resolve(&self, id: u64) -> u64 {
        resolve(&self.merged, id)
    }

    fn place(&self, id: u64) -> Option<usize> {
        self.planes.binary_search_by_key(&id, |plane| plane.id).ok()
    }
}

/// The plane that an id stands for, after merges.
fn resolve(merged: &BTreeMap<u64, u64>, mut id: u64) -> u64 {
    while let Some(&into) = merged.get(&id) {
        id = into;
    }
    id
}

/// The plane of two that the other would go into, and the other: that with more observations, the older of equals.
fn in_order<'a>(a: &'a MapPlane, b: &'a MapPlane) -> (&'a MapPlane, &'a MapPlane) {
    let rank = |plane: &MapPlane| (plane.sightings.count, std::cmp::Reverse(plane.id));
    if rank(a) > rank(b) { (a, b) } else { (b, a) }
}
